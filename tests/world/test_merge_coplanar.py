"""Flat pieces are triangulated as a plain loop over pieces does it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes import merge_coplanar

BODIES = {
    "torus of quads": lambda: trimesh.creation.torus(0.6, 0.2, 32, 16),
    "divided box": lambda: trimesh.creation.box().subdivide().subdivide(),
    "divided cylinder": lambda: trimesh.creation.cylinder(1.0, 2.0, sections=12).subdivide(),
    "cone": lambda: trimesh.creation.cone(1.0, 2.0, sections=9),
    "ring": lambda: trimesh.creation.annulus(0.3, 1.0, 1.0, sections=16),
}


def plain_first(corners):
    """Return where a fan begins: the longest following edges first, of equal ones the least corner."""
    length = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    length = np.round(length / length.max(), 6)
    return min(range(len(corners)), key=lambda i: (tuple(-np.roll(length, -i)), tuple(corners[i])))


def plain_fans(v, rows, edge, many, following, stop, is_corner):
    """Give what `_fans` does, piece by piece."""
    for row, at in zip(rows, edge, strict=True):
        corners = []
        for _ in range(many):
            corners += [stop[at]] if is_corner[at] else []
            at = following[at]
        begin = plain_first(v[corners])
        corners = corners[begin:] + corners[:begin]
        fan = [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
        yield np.full(len(fan), row), np.array(fan).reshape(-1, 3)


@pytest.mark.parametrize("name", BODIES)
def test_fans_are_those_of_a_loop_over_pieces(name, monkeypatch):
    body = BODIES[name]()
    body.apply_transform(trimesh.transformations.random_rotation_matrix(np.random.default_rng(1).random(3)))
    fast = from_trimesh(body)
    monkeypatch.setattr(merge_coplanar, "_fans", plain_fans)
    slow = from_trimesh(body)
    assert np.array_equal(fast.faces, slow.faces)
    assert np.array_equal(fast.vertices, slow.vertices)
    assert np.array_equal(fast.part, slow.part)
