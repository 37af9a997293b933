"""Faces of more than three corners, which the reader of a mesh file cuts into a fan of triangles: where they are not
convex, the fan folds over itself and covers more than the face."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

_POLYGON = re.compile(rb"^f(?:[ \t]+[^\s#]+){4}", re.M)
_PLY_FACES = re.compile(rb"^element face (\d+)\s", re.M)
_HEADER = 1 << 16  # bytes that hold the header of a PLY
_OPPOSITE = -0.9999  # cosine between normals of triangles that lie on each other


def folded(file: Path, scene: Any) -> int:
    """Return how many pairs of triangles with a common edge lie on each other, of a scene of trimesh that was read from
    a file with polygons; 0 where all its faces are triangles."""
    meshes = [g for g in scene.geometry.values() if len(getattr(g, "faces", ()))]
    if not _has_polygons(file, sum(len(g.faces) for g in meshes)):
        return 0
    from trimesh.graph import face_adjacency

    count = 0
    for one in meshes:
        corner = np.asarray(one.vertices)[one.faces]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        a, b = face_adjacency(one.faces).reshape(-1, 2).T
        count += int(((normal[a] * normal[b]).sum(axis=1) < _OPPOSITE).sum())
    return count


def _has_polygons(file: Path, triangles: int) -> bool:
    """Tell whether a file, read as so many triangles, holds faces of more than three corners."""
    kind = file.suffix.lower()
    if kind == ".obj":
        return _POLYGON.search(file.read_bytes()) is not None
    if kind != ".ply":
        return False
    with file.open("rb") as stream:
        said = _PLY_FACES.search(stream.read(_HEADER))
    return said is not None and int(said[1]) < triangles
