"""Facets cut as seen from the foot of a point on their plane: into wedges of a small turn about it, and these across,
where near and far end are as far away on both sides, so that pieces along the range are few."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from raychan.poses import sizes
from raychan.tracing.pieces import Quads

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_NOTHING = 1e-12  # of a triangle's area: what is between an edge and the foot, and pieces, of less are rounding


def wedges(corners: Floats, end: Floats, angle: float, long: Callable[[Floats, Ints], Bools]) -> tuple[Quads, Ints]:
    """Return pieces of triangles, and which triangle each is of.

    Args: corners (n, 3, 3) [m] of triangles of some area; end (3,) [m]; angle [rad] that a wedge extends over at most,
    as seen from `end`; long, returns which of some quadrilaterals of corners (k, 2, 2, 3) [m] of triangles (k,) extend
    too far at their near or far side.
    Returns: pieces that add up to the triangles; row (k,) of each.
    """
    to_foot, frame = _planes(corners, end)
    flat = np.einsum("nic,ndc->nid", corners - end, frame)
    far = sizes(flat).max(axis=1)
    row, start, stop, other, edge_near = _fans(flat)
    # The wedge is widest, as seen from `end`, at its farthest corner.
    step = angle * np.hypot(far, sizes(to_foot)) / far
    span = np.arctan2(_cross(start, stop), np.einsum("kc,kc->k", start, stop))
    count = np.ceil(span / step[row]).astype(np.int64)
    of = np.repeat(np.arange(len(row)), count)
    nth = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    turn = (nth[:, None] + [0, 1]) * (span / count)[of, None]
    look = np.cos(turn)[..., None] * start[of, None] + np.sin(turn)[..., None] * _left(start)[of, None]
    edge, beyond = _met(start[of], stop[of], look), _met(other[of, 0], other[of, 1], look)
    near = np.where(edge_near[of, None, None], edge, beyond)
    flat_quads = np.stack([near, edge + beyond - near], axis=1)
    row = row[of]

    def placed(quads: Floats, of: Ints) -> Floats:
        return np.einsum("kijd,kdc->kijc", quads, frame[of]) + (end + to_foot[of])[:, None, None]

    pieces, row = _cut_across(flat_quads, row, long(placed(flat_quads, row), row))
    quads = Quads(placed(pieces, row))
    some = np.flatnonzero(quads.area > _NOTHING * Quads(corners[:, [[0, 0], [1, 2]]]).area[row])
    return quads.take(some), row[some]


def _planes(corners: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Return the ways (n, 3) [m] from a point to its feet on the planes of triangles, and two unit vectors (n, 2, 3) of
    each plane, along which the corners turn to the left."""
    first, last = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    x = first / sizes(first)[:, None]
    normal = np.cross(first, last)
    normal /= sizes(normal)[:, None]
    foot = np.einsum("nc,nc->n", corners[:, 0] - end, normal)[:, None] * normal
    return foot, np.stack([x, np.cross(normal, x)], axis=1)


def _fans(flat: Floats) -> tuple[Ints, Floats, Floats, Floats, Bools]:
    """Return the edges of triangles (n, 3, 2) [m] that wedges from the origin are told by: those that turn alike.

    Where the origin is outside, one edge lies behind the other two or before them; its triangle's wedges end on it.
    Returns: triangle (k,), start and stop (k, 2) [m] of each edge, of the other one (k, 2, 2), all turning to the left,
    the origin where there is none, and whether the edge is the nearer of both (k,).
    """
    following = np.roll(flat, -1, axis=1)
    turn = _cross(flat, following)
    turn[np.abs(turn) < _NOTHING * turn.sum(axis=1, keepdims=True)] = 0.0
    right, left = np.less(turn, 0.0), np.greater(turn, 0.0)
    before = right.sum(axis=1) == 2
    row, at = np.nonzero(np.where(before[:, None], right, left))
    start, stop, edge_near = flat[row, at], following[row, at], before[row]
    start, stop = (np.where(edge_near[:, None], x, y) for x, y in ((stop, start), (start, stop)))
    single = np.where(before[:, None], left, right)
    odd = single.argmax(axis=1)[row]
    other = np.stack([following[row, odd], flat[row, odd]], axis=1)
    other[edge_near] = other[edge_near, ::-1]
    other[~single[row].any(axis=1)] = 0.0
    return row, start, stop, other, edge_near


def _met(start: Floats, stop: Floats, look: Floats) -> Floats:
    """Return where lines (k, 2) [m] are met by directions (k, m, 2) between their ends."""
    first, last = _cross(start[:, None], look), _cross(look, stop[:, None])
    whole = first + last
    share = np.clip(np.divide(first, whole, out=np.zeros_like(whole), where=whole > 0.0), 0.0, 1.0)[..., None]
    return np.asarray((1.0 - share) * start[:, None] + share * stop[:, None])


def _cut_across(quads: Floats, row: Ints, long: Bools) -> tuple[Floats, Ints]:
    """Return wedges (k, 2, 2, 2) [m] of triangles (k,), the long ones cut in three, of which the middle one is as far
    away from the origin on both sides."""
    away = sizes(quads)
    near, far = away[:, 0].max(axis=1), away[:, 1].min(axis=1)
    cut = long & (near < far)
    asked = quads[cut]
    look = asked[:, 1] / away[cut, 1, :, None]
    nearer, farther = (x[cut, None, None] * look for x in (near, far))
    bounds = [asked[:, 0], nearer, farther, asked[:, 1]]
    parts = [np.stack(pair, axis=1) for pair in pairwise(bounds)]
    return np.concatenate([quads[~cut], *parts]), np.concatenate([row[~cut], *(row[cut],) * 3])


def _left(way: Floats) -> Floats:
    return np.stack([-way[..., 1], way[..., 0]], axis=-1)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
