"""Bodies of a scene whose waves come by one leg and go by another."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import facets, quad
from support.targets import F, K, db, view
from truth import po

from raychan.channel.transfer import transfer
from raychan.poses import theta_phi
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.single_body import facets_of
from raychan.run.rcs import rcs
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror
from raychan.tracing.shooting import tube_routes
from raychan.world.geometry import Geometry


def in_a_scene(geometry, azimuth_deg, step=2):
    """S (2, 2) [m] of what comes by one leg and goes by another, as in a scene: without the shadow's wave."""
    leg, out = (Leg(end=e[0], far=True) for e in map(view, azimuth_deg))
    rule = list(refinements(geometry, F))[step]
    total = np.zeros((2, 2), complex)
    for routes in tube_routes(geometry, leg, [out], np.ones(1, bool), rule, 1):
        total += transfer(routes, geometry.facets, F, _basis, _basis).sum(axis=0)
    return total * 2.0 * K


def _basis(look):
    return np.stack(theta_phi(look), axis=1).astype(complex)


def test_sphere_that_comes_by_one_leg_and_goes_by_another_has_no_false_terminator():
    """Within 0.75 dB of a mirror ball to 120 deg, 0.5 dB in the mean; with an end of light at the receiver's horizon
    too it is 1.2 dB off."""
    radius = 0.037
    geometry = Geometry(facets_of(trimesh.creation.icosphere(subdivisions=4, radius=radius), "pec", F))
    off = []
    for angle in (20.0, 40.0, 60.0, 75.0, 90.0, 105.0, 120.0):
        s = in_a_scene(geometry, (0.0, angle))
        back = in_a_scene(geometry, (angle, 0.0))
        off += list(db(np.abs(np.diag(s)) ** 2 * 4.0 / radius**2))
        assert db(np.linalg.norm(s) / np.linalg.norm(back)) == pytest.approx(0.0, abs=0.02)
    assert np.abs(off).max() < 0.75
    assert np.sqrt(np.mean(np.square(off))) < 0.5


@pytest.mark.parametrize(
    "mesh", [quad(po.rectangle(0.2, 0.1)), trimesh.creation.box([0.1, 0.2, 0.1])], ids=["plate", "box"]
)
def test_nothing_comes_straight_through_a_body_that_blocks_the_ray(mesh):
    """A blocked ray stands for the incident wave and the shadow's; the wave that hides a body is not added to it."""
    s = in_a_scene(Geometry(facets_of(mesh, "pec", F)), (0.0, 180.0))
    assert np.abs(s).max() < 1e-3 * K / (2 * np.pi) * 0.02


def test_side_that_only_a_mirror_shows_returns_by_the_mirror():
    """The far side of a box before a wall is that box seen from the radar's image."""
    radar, image = np.array([0.0, 2.0, 0.0]), np.array([16.0, 2.0, 0.0])
    azimuth = np.arctan2(2.0, 16.0 - 5.0)
    block = trimesh.creation.box([0.04, 0.06, 0.05])
    turned = block.copy().apply_transform(trimesh.transformations.rotation_matrix(azimuth, [0, 0, 1], [0, 0, 0]))
    turned.apply_translation([5.0, 0.0, 0.0])
    wall = quad([[8.0, 5.0, -5.0], [8.0, 5.0, 5.0], [8.0, -5.0, 5.0], [8.0, -5.0, -5.0]])
    if wall.face_normals[0, 0] > 0.0:
        wall.invert()
    geometry = Geometry(facets([turned, wall]))
    plane = int(np.flatnonzero(geometry.facets.body == 1)[0])
    over = Leg(end=radar, mirrors=(Mirror.of(geometry, plane, 1.0),))
    rule = list(refinements(geometry, F))[1]
    total = 0j
    for routes in tube_routes(geometry, over, [Leg(end=radar), over], np.array([True, False]), rule, 3):
        if (routes.kind[0] != 0).sum() == 3:
            total += transfer(routes, geometry.facets, F, _basis, _basis)[:, 0, 0].sum()
    distance = float(np.linalg.norm(image - [5.0, 0.0, 0.0]))
    true = rcs(block, F, 0.0, distance=distance).sigma
    got = 4 * np.pi * np.abs(total * 2.0 * K * distance**2) ** 2
    assert db(got / true) == pytest.approx(0.0, abs=0.1)
