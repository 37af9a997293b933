"""Coplanar neighbouring faces are merged and triangulated anew, so that a mesh and its subdivision are the same body.

Without this the corner normals of a curved surface, which are estimated at the vertices, would change with every
subdivision of its facets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
    first_face = np.full(len(f), -1, np.int64)
    first_face[piece[::-1]] = np.arange(len(f))[::-1]
    owners, triangles = _filled(v, np.flatnonzero(whole), owner, following, stop, is_corner)
    left = ~whole[piece]
    return np.concatenate([f[left], triangles]), np.concatenate([part[left], part[first_face[owners]]])


def _filled(
    v: Floats, rows: Ints, owner: Ints, following: Ints, stop: Ints, is_corner: NDArray[np.bool_]
) -> tuple[Ints, Ints]:
    """Return the triangles (t, 3) that fill pieces `rows` (p,), and the piece (t,) of each.

    Args: v (v, 3) [m]; of the edges of all outlines (e,) the piece, the edge that follows, the vertex where it stops,
    and whether there is a corner.
    """
    by_owner = np.argsort(owner, kind="stable")
    begin, end = (np.searchsorted(owner[by_owner], rows, side=side) for side in ("left", "right"))
    made = [(rows[:0], np.zeros((0, 3), np.int64))]
    for many in np.unique(end - begin):
        some = end - begin == many
        made += _fans(v, rows[some], by_owner[begin[some]], many, following, stop, is_corner)
    owners, triangles = (np.concatenate(x) for x in zip(*made, strict=True))
    order = np.argsort(owners, kind="stable")
    return owners[order], triangles[order]


def _fans(
    v: Floats, rows: Ints, edge: Ints, many: int, following: Ints, stop: Ints, is_corner: NDArray[np.bool_]
) -> Iterator[tuple[Ints, Ints]]:
    """Give pieces (t,) and triangles (t, 3) of the fans that fill pieces `rows` (p,), whose outlines have so `many`
    edges, the first ones `edge` (p,)."""
    outline, turns = np.empty((len(rows), many), np.int64), np.empty((len(rows), many), bool)
    for j in range(many):
        outline[:, j], turns[:, j] = stop[edge], is_corner[edge]
        edge = following[edge]
    count = turns.sum(axis=1)
    for n in np.unique(count):
        some = np.flatnonzero(count == n)
        corners = outline[some][turns[some]].reshape(len(some), n)
        first = _first(v[corners])
        corners = np.take_along_axis(corners, (first[:, None] + np.arange(n)) % n, axis=1)
        fan = np.stack([np.repeat(corners[:, :1], n - 2, axis=1), corners[:, 1:-1], corners[:, 2:]], axis=2)
        yield np.repeat(rows[some], n - 2), fan.reshape(-1, 3)


def _first(corners: Floats) -> Ints:
    """Return the number of the corner (p,), of (p, c, 3) [m], at which a triangle fan begins, independent of how the
    outline was subdivided or turned: chosen by the lengths of the edges that follow, of equal ones by position."""
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    length = np.round(length / length.max(axis=1, keepdims=True), 6)
    left = np.ones(length.shape, bool)
    for key in (*(-np.roll(length, -j, axis=1) for j in range(length.shape[1])), *np.moveaxis(corners, 2, 0)):
        least = np.where(left, key, np.inf).min(axis=1, keepdims=True)
        left &= key == least
    return np.asarray(left.argmax(axis=1))


def _unit(d: Floats) -> Floats:
    return d / np.linalg.norm(d, axis=1, keepdims=True)
