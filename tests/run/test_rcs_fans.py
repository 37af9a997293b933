"""Curved mirrors before small parts: tubes that spread over gaps and over several facets do not decide as a whole."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.targets import F

from raychan.poses import direction
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry
from raychan.world.meshes.mesh import make_mesh


def ball_before_a_comb(teeth):
    """Return a sphere of 320 facets with its normals, and a comb: bars 6 mm wide, gaps as wide."""
    ball = trimesh.creation.icosphere(2, 0.15)
    bars = [trimesh.creation.box((0.02, 0.006, 0.3)) for _ in range(teeth)]
    for i, bar in enumerate(bars):
        bar.apply_translation([-0.02, 0.2 + 0.012 * i, 0.0])
    whole = trimesh.util.concatenate([ball, *bars])
    normals = np.repeat(whole.face_normals[:, None], 3, axis=1)
    corners = ball.vertices[ball.faces]
    normals[: len(corners)] = corners / np.linalg.norm(corners, axis=2, keepdims=True)
    return make_mesh(whole.vertices, whole.faces, normals=normals)


@pytest.mark.parametrize("azimuth_deg", [20.0, 35.0])
def test_a_curved_mirror_before_gaps_returns_what_a_much_finer_launch_returns(azimuth_deg):
    """Two bounces; the finer launch cuts tubes to 3 mm, whatever their fans, and thirty times weaker ones. Each of the
    first three launches is within 5 % of it in amplitude."""
    geometry = Geometry(facets_of(ball_before_a_comb(8), "pec", F))
    leg = Leg(end=direction(np.radians(azimuth_deg), 0.1), far=True)
    coarse = list(itertools.islice(refinements(geometry, F), 3))
    fine = replace(coarse[1], max_edge=0.003, relative=coarse[1].relative / 30.0, fan=np.inf)
    true = scattering(geometry, leg, leg, F, 2, fine)[:, 0, 0]
    # Fans matter here.
    assert abs(true[1]) > 0.05 * abs(true[0])
    for rule in coarse:
        got = scattering(geometry, leg, leg, F, 2, rule)[:, 0, 0]
        assert abs((got - true).sum()) < 0.05 * abs(true.sum())
