"""Wedges of triangles about a foot add up to the triangles, in area and its moments, wherever the foot is."""

import numpy as np
import pytest

from raychan.tracing.wedges import wedges

TRIANGLE = np.array([[1.0, 0.5, 2.0], [7.0, -1.0, 3.5], [3.0, 6.0, -1.0]])
EDGES = TRIANGLE[1] - TRIANGLE[0], TRIANGLE[2] - TRIANGLE[0]
NORMAL = np.cross(*EDGES) / np.linalg.norm(np.cross(*EDGES))
# Of the foot, by its shares of both edges: inside, beyond an edge, a corner, on an edge, its extension and a corner.
FEET = [(0.3, 0.3), (1.0, 1.0), (-0.2, -0.7), (2.5, -0.1), (0.5, 0.5), (0.4, 0.0), (-1.0, 0.0), (0.0, 0.0)]


def pieces_of(triangles, end, angle):
    """Return pieces, the triangle of each, and how many were said to be long."""
    told = []

    def long(quads, of):
        away = np.linalg.norm(quads - end, axis=-1)
        told.append(np.abs(away[:, :, 1] - away[:, :, 0]).max(axis=1) > 0.05)
        return told[-1]

    return *wedges(triangles, end, angle, long), int(told[0].sum())


@pytest.mark.parametrize("height", [0.01, 2.0])
@pytest.mark.parametrize("foot", FEET)
def test_pieces_of_a_triangle_add_up_to_it_wherever_the_foot_is(foot, height):
    end = TRIANGLE[0] + foot[0] * EDGES[0] + foot[1] * EDGES[1] + height * NORMAL
    triangles = np.stack([TRIANGLE, TRIANGLE[::-1], TRIANGLE + 3.0 * NORMAL])
    pieces, of, long = pieces_of(triangles, end, 0.1)
    assert long > 0
    for axis in (None, 0, 1):
        if axis is not None:
            pieces, of = pieces.halved(np.full(len(of), axis)), np.tile(of, 2)
        area = np.bincount(of, pieces.area)
        np.testing.assert_allclose(area, 0.5 * np.linalg.norm(np.cross(*EDGES)), rtol=1e-7)
        middle = (
            np.stack([np.bincount(of, pieces.area * pieces.middle[:, c]) for c in range(3)], axis=1) / area[:, None]
        )
        np.testing.assert_allclose(middle, triangles.mean(axis=1), atol=1e-6)


def test_pieces_lie_within_their_triangle_and_extend_over_no_more_than_the_angle():
    rng = np.random.default_rng(3)
    triangles, end = rng.normal(size=(50, 3, 3)) * 5.0, np.array([0.5, 0.2, 1.0])
    pieces, of, _ = pieces_of(triangles, end, 0.05)
    first = triangles[of, 0]
    frame = np.stack([triangles[of, 1] - first, triangles[of, 2] - first], axis=2)
    share = np.linalg.pinv(frame) @ (pieces.middle - first)[..., None]
    assert share.min() > 0.0 and share.sum(axis=1).max() < 1.0
    away = pieces.corners - end
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    # Of lines across the range; those of wedges cut short at an edge differ in range, too.
    within = np.abs(np.diff(np.linalg.norm(pieces.corners - end, axis=-1), axis=2)[..., 0]) < 1e-9
    turned = np.arccos(np.clip(np.einsum("kic,kic->ki", away[:, :, 0], away[:, :, 1]), -1.0, 1.0))
    assert within.sum() > 50 and turned[within].max() < 0.05
