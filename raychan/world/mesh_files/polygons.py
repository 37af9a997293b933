"""Faces of more than three corners, which the reader of a mesh file cuts into a fan of triangles: where they are not
convex, the fan folds over itself and covers more than the face."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

_POLYGON = re.compile(rb"^f(?: +[^\s#]+){4}", re.M)
_OPPOSITE = -0.9999  # cosine between normals of triangles that lie on each other


def has_polygons(text: bytes) -> bool:
    """Return whether an OBJ, its text without indents, tabs and divided lines, has faces of more than 3 corners."""
    return _POLYGON.search(text) is not None


def folded(meshes: Iterable[Any]) -> int:
    """Return how many pairs of triangles with a common edge lie on each other, of `vertices` and `faces` that were read
    from a file with polygons."""
    from trimesh.graph import face_adjacency

    count = 0
    for one in meshes:
        corner = np.asarray(one.vertices)[one.faces]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        a, b = face_adjacency(one.faces).reshape(-1, 2).T
        count += int(((normal[a] * normal[b]).sum(axis=1) < _OPPOSITE).sum())
    return count
