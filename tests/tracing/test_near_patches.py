"""Patches near an end: the distance of their nearest point, and how far they are cut."""

from __future__ import annotations

import numpy as np
import pytest
from trimesh.triangles import closest_point

from raychan.geometry.patch_cuts import edge_to_cut, halved
from raychan.vectors import distance_to_triangle

_K = 2.0 * np.pi / 0.004  # rad/m
_NEAR = 0.2
_FACET = np.array([[[0.0, -1.0, -1.0], [0.0, 3.0, -1.0], [0.0, -1.0, 2.0]]])


def test_the_nearest_point_of_a_triangle_may_lie_within_on_an_edge_or_at_a_corner():
    rng = np.random.default_rng(4)
    corners, at = rng.normal(size=(500, 3, 3)), rng.normal(scale=2.0, size=(500, 3))
    truth = np.linalg.norm(closest_point(corners, at) - at, axis=1)
    found = [distance_to_triangle(c, x) for c, x in zip(corners, at, strict=True)]
    assert found == pytest.approx(truth, rel=1e-9, abs=1e-12)


def _cut(image, least):
    """Return the corners (n, 3, 3) [m] of the facet's parts once none is cut any more."""
    normals = np.broadcast_to([-1.0, 0.0, 0.0], (1, 3, 3)).copy()
    flat = np.zeros((1, 3, 3))
    facet, bary, done = np.zeros(1, np.int32), np.eye(3)[None].copy(), []
    limits = _K, 1e9, 1e9, np.inf, 1e9, np.inf, True, least, _NEAR
    for level in range(200):
        edge = edge_to_cut(facet, bary, _FACET, normals, flat, image, False, image, False, *limits)
        done.append(bary[edge < 0] @ _FACET[0])
        facet, bary = halved(facet, bary, edge, np.flatnonzero(edge >= 0), 0.0, level)
        if not len(facet):
            return np.concatenate(done)
        assert len(facet) < 20_000
    raise AssertionError("cut without end")


@pytest.mark.parametrize("place", [(-0.01, 0.2, 0.1), (-0.5, 0.0, 0.0), (-0.002, 2.99, -1.0), (0.0, -1.001, 0.3)])
def test_patches_are_cut_to_a_share_of_the_distance_of_their_nearest_point(place):
    image = np.array(place)
    parts = _cut(image, 0.0)
    nearest = np.linalg.norm(closest_point(parts, np.broadcast_to(image, (len(parts), 3))) - image, axis=1)
    reach = np.linalg.norm(parts - parts.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    assert (reach <= _NEAR * np.maximum(nearest, 1.0 / _K) * (1.0 + 1e-9)).all()
    assert 50 < len(parts) < 20_000


def test_an_end_on_a_patch_does_not_cut_it_without_end():
    assert len(_cut(np.array([0.0, 0.3, 0.2]), 0.0)) < 20_000


def test_patches_that_bring_little_are_left_whole():
    assert len(_cut(np.array([-0.5, 0.0, 0.0]), 1e9)) == 1
