"""First checks of raw triangles: finite vertices, existing indices, welding, faces of zero area and duplicates."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.world.errors import SceneError
from raychan.world.meshes.pieces import grouped

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]

_WELD = 1e-9  # of the mesh's size: vertices nearer to each other are one
_SIZES = (1e-6, 1e6)  # m: least and largest size that is not a mistake of unit or scale


def used(v: Floats, f: Ints) -> tuple[Floats, Ints]:
    """Return the vertices that faces use, and the faces.

    Raises: SceneError for vertices that are not finite or are missing, and for a size that no radar can resolve.
    """
    if not np.isfinite(v).all():
        bad = int((~np.isfinite(v)).any(axis=1).sum())
        raise SceneError(f"{bad} vertices hold NaN or infinity", value=bad, allowed="finite coordinates")
    lost = int(((f < 0) | (f >= len(v))).any(axis=1).sum())
    if lost:
        raise SceneError(f"{lost} faces name vertices that are not there", value=lost, allowed=f"0 to {len(v) - 1}")
    if not len(f):
        return v, f
    v, f = named(v, f)
    far, size = float(np.abs(v).max()), 2.0 * float(np.ptp(0.5 * v, axis=0).max())
    if not max(far, size) <= _SIZES[1] or 0.0 < size < _SIZES[0]:
        least, most = _SIZES
        allowed = f"a size from {least:g} m, and coordinates up to {most:g} m: check unit and scale"
        raise SceneError(f"mesh is {size:.3g} m across, {far:.3g} m from its origin", value=size, allowed=allowed)
    return v, f


def named(v: Floats, f: Ints) -> tuple[Floats, Ints]:
    """Return the vertices that faces use, in their order, and the faces with their numbers."""
    wanted = np.zeros(len(v), bool)
    wanted[f] = True
    if wanted.all():
        return v, f
    return v[wanted], (np.cumsum(wanted) - 1)[f]


def weld(v: Floats, f: Ints) -> tuple[Floats, Ints]:
    """Return vertices of which no two coincide, and the faces with their numbers."""
    if not len(v):
        return v, f
    step = max(float(np.ptp(v, axis=0).max()), 1e-300) * _WELD
    key = np.round((v - v.min(axis=0)) / step).astype(np.int64)
    order = np.argsort(key[:, 0], kind="stable")
    # The two others in one number: they go to 1e9.
    rest = (key[:, 2] << 31) + key[:, 1]
    order = order[np.argsort(rest[order], kind="stable")]
    new = np.concatenate([[True], (np.diff(rest[order]) != 0) | (np.diff(key[order, 0]) != 0)])
    index = np.empty(len(v), np.int64)
    index[order] = np.cumsum(new) - 1
    return v[order[new]], index[f]


def alive(v: Floats, f: Ints) -> tuple[NDArray[np.bool_], int, int]:
    """Return which faces to keep, and how many have no area and how many are duplicates."""
    a, b, c = (np.take(v, f[:, i], axis=0) for i in range(3))
    edge = b - a, c - b, a - c
    squares = [np.einsum("ij,ij->i", e, e) for e in edge]
    longest = np.maximum(np.maximum(squares[0], squares[1]), squares[2])
    flat = np.linalg.norm(np.cross(edge[0], edge[2]), axis=1) <= 1e-12 * longest
    order, run = grouped(*np.sort(f, axis=1).T)
    unique = np.ones(len(f), bool)
    unique[order[1:][run[1:] == run[:-1]]] = False
    return unique & ~flat, int(flat.sum()), int((~unique & ~flat).sum())
