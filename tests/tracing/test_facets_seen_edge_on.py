"""Facets seen edge-on: no hit is infinite, none hides what stands behind it, and no rotation changes anything."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import box, facets, quad

import raychan as rc
from raychan.world.ray_caster import RayCaster

F = 77e9
NONE = np.int32(-1)


def rotations(count, seed):
    rng = np.random.default_rng(seed)
    return [trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3] for _ in range(count)]


def turned(mesh, turn, shift=(0.0, 0.0, 0.0)):
    return trimesh.Trimesh(mesh.vertices @ turn.T + shift, mesh.faces, process=False)


def azimuth_elevation(look):
    return np.degrees(np.arctan2(look[1], look[0])), np.degrees(np.arcsin(np.clip(look[2], -1.0, 1.0)))


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (1e4, -2e4, 30.0)])
def test_a_sheet_seen_edge_on_hides_nothing_behind_it(shift):
    sheet = quad([[2, -1, 0], [3, -1, 0], [3, 1, 0], [2, 1, 0]])
    wall = quad([[5, -9, -9], [5, 9, -9], [5, 9, 9], [5, -9, 9]])
    rng = np.random.default_rng(1)
    for turn in rotations(60, 2):
        tracer = RayCaster(facets([turned(m, turn, shift) for m in (sheet, wall)]))
        # Origins in the sheet's plane, ways along it.
        start = np.column_stack([np.zeros(40), rng.uniform(-0.9, 0.9, 40), np.zeros(40)])
        stop = np.column_stack([np.full(40, 5.0), rng.uniform(-0.9, 0.9, 40), np.zeros(40)])
        way = (stop - start) / np.linalg.norm(stop - start, axis=1)[:, None]
        hit, t = tracer.cast(start @ turn.T + shift, way @ turn.T, np.full(40, NONE))
        assert (hit >= 2).all()
        np.testing.assert_allclose(t, np.linalg.norm(stop - start, axis=1), atol=1e-9 + 1e-11 * np.abs(shift).max())


def test_every_hit_lies_on_its_facet_however_a_body_is_turned():
    body = box((-1, -0.6, -0.4), (1, 0.6, 0.4))
    rng = np.random.default_rng(3)
    for turn in rotations(60, 4):
        f = facets([turned(body, turn)])
        tracer = RayCaster(f)
        axis = np.zeros((300, 3))
        axis[np.arange(300), rng.integers(3, size=300)] = rng.choice([-1.0, 1.0], 300)
        # Places on the box's corners, edges and faces, seen along its faces.
        place = rng.choice([-1.0, 0.3, 1.0], (300, 3)) * (1.0, 0.6, 0.4)
        hit, t = tracer.cast((place - 5.0 * axis) @ turn.T, axis @ turn.T, np.full(300, NONE))
        met = hit >= 0
        assert np.isfinite(t[met]).all() and np.isinf(t[~met]).all()
        at = (place - 5.0 * axis)[met] + t[met, None] * axis[met]
        assert (np.abs(at) <= np.array([1.0, 0.6, 0.4]) + 2e-3).all()


def test_the_face_of_a_box_is_a_plate_however_box_and_view_are_turned():
    body = box((-0.2, -0.15, -0.1), (0.2, 0.15, 0.1))
    plate = 4.0 * np.pi * (0.3 * 0.2) ** 2 / (299_792_458.0 / F) ** 2
    for turn in rotations(25, 5):
        found = rc.rcs(turned(body, turn), F, *azimuth_elevation(turn @ (1.0, 0.0, 0.0)))
        assert 10.0 * np.log10(found.sigma / plate) == pytest.approx(0.0, abs=float(found.error_db) + 1e-3)


def test_a_rear_view_of_a_body_is_the_same_however_body_and_view_are_turned():
    body = trimesh.util.concatenate([box((-2, -0.8, 0.2), (2, 0.8, 0.8)), box((-1.2, -0.7, 0.8), (0.9, 0.7, 1.4))])
    found = []
    for degrees in (0.0, 37.0, 90.0, 117.3, 211.0, 300.5):
        turn = trimesh.transformations.rotation_matrix(np.radians(degrees), (0, 0, 1))[:3, :3]
        found.append(rc.rcs(turned(body, turn), F, degrees + 180.0, 0.0, max_rays=200_000))
    level = 10.0 * np.log10([float(f.sigma) for f in found])
    stated = max(float(f.error_db) for f in found)
    assert np.isfinite(level).all()
    assert np.ptp(level) <= 2.0 * stated + 1e-3
