"""Coplanar neighbouring faces are merged and triangulated anew, so that a mesh and its subdivision are the same body.

Without this the corner normals of a curved surface, which are estimated at the vertices, would change with every
subdivision of its facets.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_PLANE = 1.0 - 1e-9  # cosine between normals from which neighbours are coplanar
_STRAIGHT = 1e-6  # sine of a turn below which an outline is straight at a vertex


def merge_flat(
    v: Floats, f: Ints, part: Ints, pairs: Callable[[Any], Any], components: Callable[[Any, Any, int], Ints]
) -> tuple[Ints, Ints]:
    """Return faces and their parts with convex coplanar pieces triangulated anew from their corners.

    Args: v (v, 3) [m], f (f, 3), part (f,); pairs, components the mesh's own edge pairs and connected components. A
    vertex is dropped only if no piece about it has a corner there, so that no edge gets a vertex in its middle.
    """
    normal = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    a, b, ea, eb, opposed = pairs(f)
    flat = opposed & (np.einsum("ij,ij->i", normal[a], normal[b]) > _PLANE) & (part[a] == part[b])
    if not flat.any():
        return f, part
    piece = components(a[flat], b[flat], len(f))
    rim = np.ones(3 * len(f), bool)
    rim[np.concatenate([3 * a[flat] + ea[flat], 3 * b[flat] + eb[flat]])] = False
    edges = np.flatnonzero(rim)
    owner, start = piece[edges // 3], f[edges // 3, edges % 3]
    stop = f[edges // 3, (edges % 3 + 1) % 3]
    # Link each outline: the next edge starts where this one stops, in the same piece.
    size = np.int64(v.shape[0])
    order = np.argsort(owner * size + start, kind="stable")
    key = (owner * size + start)[order]
    at = np.searchsorted(key, owner * size + stop)
    at = np.minimum(at, len(key) - 1)
    following = order[at]
    simple = (key[at] == owner * size + stop) & (np.diff(np.append(key, -1))[at] != 0)
    d0, d1 = _unit(v[stop] - v[start]), _unit(v[stop[following]] - v[start[following]])
    turn = np.einsum("ij,ij->i", np.cross(d0, d1), normal[edges // 3])
    is_corner, concave = turn > _STRAIGHT, turn < -_STRAIGHT
    broken = np.zeros(len(f), bool)
    broken[owner[~simple | concave]] = True
    count = np.bincount(piece, minlength=len(f))
    kept = np.zeros(len(v), bool)
    kept[stop[is_corner | concave]] = True
    while True:
        # A piece that must keep a vertex which is no corner of its outline stays as it is, with all its vertices.
        stuck = broken.copy()
        stuck[owner[kept[stop] & ~is_corner]] = True
        stuck &= count > 1
        before = kept.sum()
        kept[f[stuck[piece]].ravel()] = True
        if kept.sum() == before:
            break
    whole = (count > 1) & ~stuck
    fans, parts = [f[~whole[piece]]], [part[~whole[piece]]]
    first_face = np.full(len(f), -1, np.int64)
    first_face[piece[::-1]] = np.arange(len(f))[::-1]
    by_owner = np.argsort(owner, kind="stable")
    begin = np.searchsorted(owner[by_owner], np.arange(len(f) + 1))
    for p in np.flatnonzero(whole):
        corners = _loop(by_owner[begin[p] : begin[p + 1]], following, stop, is_corner)
        begins = _first(v[corners])
        corners = corners[begins:] + corners[:begins]
        fans.append(np.array([[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]))
        parts.append(np.full(len(corners) - 2, part[first_face[p]]))
    return np.concatenate(fans), np.concatenate(parts)


def _loop(mine: Ints, following: Ints, stop: Ints, is_corner: NDArray[np.bool_]) -> list[int]:
    """Return the corners of one outline in order."""
    corners, edge = [], int(mine[0])
    for _ in range(len(mine)):
        if is_corner[edge]:
            corners.append(int(stop[edge]))
        edge = int(following[edge])
    return corners


def _first(corners: Floats) -> int:
    """Return the number of the corner, of (c, 3) [m], at which a triangle fan begins, independent of how the outline
    was subdivided or turned: chosen by the lengths of the edges that follow, of equal ones by position."""
    length = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    lengths = [tuple(row) for row in np.round(length / length.max(), 6)[_round(len(length))]]
    return min(range(len(corners)), key=lambda i: (tuple(-x for x in lengths[i]), tuple(corners[i])))


def _round(n: int) -> Ints:
    """Return the cyclic sequences (n, n) of 0 to n - 1, one starting at each number."""
    return (np.arange(n)[:, None] + np.arange(n)) % n


def _unit(d: Floats) -> Floats:
    return d / np.linalg.norm(d, axis=1, keepdims=True)
