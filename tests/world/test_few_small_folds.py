"""Small folds of a sharp body are no evidence of a smooth one: what they change, read as edges, is in the stated error;
of finely tessellated smooth bodies nothing is in doubt."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from truth import po, shapes

from raychan.run.rcs import rcs
from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes.creases import alternatives, uncertain_folds


def gem(height, sides=4, radius=0.1):
    """Return a flat pyramid on a prism: as many even folds at its tip as a smooth surface may have, sharp ones round
    it."""
    a = 2.0 * np.pi * np.arange(sides) / sides + 0.3
    rim = radius * np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)
    return trimesh.convex.convex_hull(np.concatenate([rim, rim - [0.0, 0.0, 0.05], [[0.0, 0.0, height]]]))


@pytest.mark.parametrize("sides", [4, 5, 6])
def test_a_flat_tip_between_sharp_edges_is_in_doubt_and_the_error_holds_its_facets(sides):
    mesh = gem(0.004, sides)
    small = np.degrees(mesh.face_adjacency_angles)
    assert ((small > 0.1) & (small < 20.0)).sum() == sides
    assert alternatives(from_trimesh(mesh)).creased is not None
    assert f"{sides} of them may be edges" in uncertain_folds(from_trimesh(mesh), "crease_deg")
    az, el = np.array([10.0, 73.0, 201.0, 300.0]), np.array([88.0, 85.0, 80.0, 70.0])
    looks = (po.direction(np.radians(a), np.radians(e)) for a, e in zip(az, el, strict=True))
    flat = np.array([shapes.flat(mesh, look) for look in looks])
    got = rcs(mesh, shapes.F, az, el)
    known = got.converged
    off = np.abs(10.0 * np.log10(got.sigma / flat))
    assert (off <= got.error_db)[known].all() and known.any()
    told = rcs(mesh, shapes.F, az, el, crease_deg=1.0)
    assert (np.abs(10.0 * np.log10(told.sigma / flat)) <= told.error_db).all() and told.error_db.max() < 0.25


def cap():
    """Return the upper part of a ball, open below."""
    ball = trimesh.creation.icosphere(3)
    return trimesh.Trimesh(ball.vertices, ball.faces[ball.triangles_center[:, 2] > 0.1])


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.icosphere(3),
        trimesh.creation.icosphere(4).apply_scale([0.3, 0.2, 0.25]),
        trimesh.creation.uv_sphere(count=[24, 48]),
        trimesh.creation.torus(0.3, 0.1, major_sections=96, minor_sections=48),
        trimesh.creation.cylinder(0.1, 0.3, sections=200),
        trimesh.creation.cone(0.1, 0.3, sections=200),
        cap(),
    ],
    ids=["ball", "ellipsoid", "globe", "ring", "cylinder", "cone", "cap"],
)
def test_finely_tessellated_smooth_bodies_are_in_no_doubt(mesh):
    assert uncertain_folds(from_trimesh(mesh), "crease_deg") == ""
    assert alternatives(from_trimesh(mesh)).creased is None
