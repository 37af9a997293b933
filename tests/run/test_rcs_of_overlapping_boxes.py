"""rcs of boxes that run through each other, two bounces, against exact footprints: edges that no facet draws part tubes
there, gaps between shadows are narrow, and the phase may run fast on one face and not at all on the next."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.targets import F, K, db, sigma, view
from truth import corner, po

from raychan.run.rcs import rcs

_SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def _boxes(seed):
    """Return two to four boxes, turned about all axes, about z or not at all, and a view of them: azimuth, elevation
    [deg]."""
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(int(rng.integers(2, 5))):
        box, place = trimesh.creation.box(extents=rng.uniform(0.05, 0.4, 3)), np.eye(4)
        if seed % 3 == 0:
            place = trimesh.transformations.random_rotation_matrix(rng.random(3))
        elif seed % 3 == 1:
            place = trimesh.transformations.rotation_matrix(rng.uniform(0, 6.28), [0, 0, 1])
        place[:3, 3] = rng.uniform(-0.12, 0.12, 3)
        boxes.append(box.apply_transform(place))
    return boxes, (float(rng.uniform(0, 360)), float(rng.uniform(-30, 60)))


def _exact(boxes, angles):
    """Return the scattering matrix (2, 2) [m] up to two bounces."""
    look = view(*angles)
    faces = [np.array(b.vertices[list(side)]) for b in boxes for side in _SIDES]
    outward = np.array([po.unit_normal(face) for face in faces])
    orders = []
    for i in np.flatnonzero(outward @ look[0] > 0.0):
        along = 2.0 * (look[0] @ outward[i]) * outward[i] - look[0]
        back = (outward @ along < 0.0) & (outward @ look[0] > 0.0)
        orders += [(i,), *((i, j) for j in np.flatnonzero(back))]
    return corner.corner(faces, K, look, orders=orders)


@pytest.mark.parametrize(("seed", "tolerance_db"), [(32, 0.5), (86, 0.5), (103, 0.5), (144, 0.5), (230, 0.05)])
def test_two_bounces_of_overlapping_boxes_are_their_exact_footprints(seed, tolerance_db):
    boxes, angles = _boxes(seed)
    got = rcs(trimesh.util.concatenate(boxes), F, *angles, tolerance_db=tolerance_db, max_bounces=2)
    off = abs(db(got.sigma / sigma(_exact(boxes, angles))))
    assert off < 0.4 * tolerance_db
    assert off <= got.error_db
