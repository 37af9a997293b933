"""Subdivision of tubes: bisected at an edge, or clipped along the line in which an edge of a body runs through them.

A tube is a triangle of corner rays, so its parts need no new casts: on the first surface their rays are computed anew,
later they are interpolated between the parent's corners.

Everywhere: points, k, normals (n, 4, 3), length (n, 4) of tubes (three corners, the centre); bary (n, 3, 3) corners on
the first facet; weights (m, 3, 3) of the parent's corners in each corner of a part, which lies on the parent's edges.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import rise_off_chord
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import CENTRE, Tubes, first_rays
from raychan.vectors import distance, largest
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Rows = NDArray[np.signedinteger]

_LEAST_AREA = 1e-14  # m^2: a part of no more area is dropped
_COPIED = "strength", "flat", "slots", "bounces", "caustics", "last"  # columns that parts take from their parent


def bisect(
    geometry: Geometry, leg: Leg, tubes: Tubes, rows: Rows, edge: Rows, first: bool, jitter: float = 0.0
) -> Tubes:
    """Return both halves of the tubes `rows` (m,), cut from the middle of edge 0, 1 or 2 (m,) to the opposite corner.

    Args: first whether they stand on their first surface; jitter share of the edge by which cuts lie off its middle.
    """
    if not len(rows):
        return tubes.take(rows)
    parent = np.concatenate([rows, rows])
    return _parts(geometry, leg, tubes, parent, bisection_weights(edge, jitter), first, len(parent))[0]


def subdivide(
    geometry: Geometry, leg: Leg, tubes: Tubes, rows: Rows, side: Floats, first: bool, jitter: float
) -> tuple[Tubes, Rows]:
    """Clip the tubes `rows` (m,) along the edge that runs through them, or bisect them at their longest edge where none
    is known; return the parts, and the parent of each.

    Args: side (n, 3) of all tubes, signed distances [m] of the corners from that edge, zeros where none is known; first
    and jitter as for `bisect`.
    """
    if not len(rows):
        return tubes.take(rows), rows
    known = side[rows].any(axis=1)
    bisected, clipped = rows[~known], rows[known]
    parent = np.concatenate([bisected, bisected, clipped, clipped, clipped])
    half = bisection_weights(longest_edges(tubes.points[bisected]), jitter)
    return _parts(geometry, leg, tubes, parent, np.concatenate([half, clip_weights(side[clipped])]), first, len(half))


def _parts(
    geometry: Geometry, leg: Leg, tubes: Tubes, parent: Rows, weights: Floats, first: bool, halves: int
) -> tuple[Tubes, Rows]:
    """Return part tubes whose corner i is the mean of the parent's corners by weights[:, i] (m, 3, 3), and the parent
    (m,) of each; but for the first `halves` only those that have an area."""
    n, facet = len(parent), tubes.facet[parent]
    bary = part_coordinates(weights, parent, tubes.bary) if first else np.empty((n, 0, 3))
    if first:
        points, k, length, normals = first_rays(geometry, leg, facet, bary)
        spread = leg.spread(length[:, CENTRE])
    else:
        points, k, normals, length = np.empty((n, 4, 3)), np.empty((n, 4, 3)), np.empty((n, 4, 3)), np.empty((n, 4))
        part_rays(weights, parent, tubes.points, tubes.k, tubes.length, tubes.normals, points, k, length, normals)
        spread = tubes.spread[parent]
    parts = Tubes(
        points=points,
        k=k,
        length=length,
        normals=normals,
        facet=facet,
        spread=spread,
        bary=bary,
        **{name: getattr(tubes, name).take(parent) for name in _COPIED},
        history=tubes.history,
    )
    rows = nonempty_parts(points, halves)
    return (parts, parent) if len(rows) == n else (parts.take(rows), parent[rows])


@njit(cache=True, nogil=True)
def edge_of_spread(k, normals, facet, curved, fan):  # type: ignore[no-untyped-def]
    """Return the edge (n,) between whose corners the reflected rays of each tube spread most; -1 where they spread by
    no more than `fan` [rad], or the facet is not curved (f,)."""
    out, d = np.full(len(k), -1, np.int64), np.empty((3, 3))
    for i in range(len(k)):
        if curved[facet[i]]:
            for q in range(3):
                twice = 0.0
                for c in range(3):
                    twice += 2.0 * k[i, q, c] * normals[i, q, c]
                for c in range(3):
                    d[q, c] = k[i, q, c] - twice * normals[i, q, c]
            e0, e1, e2 = distance(d[0], d[1]), distance(d[1], d[2]), distance(d[2], d[0])
            if max(e0, e1, e2) > fan:
                out[i] = largest(e0, e1, e2)
    return out


@njit(cache=True, nogil=True)
def longest_edges(points):  # type: ignore[no-untyped-def]
    """Return the longest edge (n,) of each tube: from corner 0, 1 or 2 to the next."""
    out = np.empty(len(points), np.int64)
    for i in range(len(points)):
        p = points[i]
        out[i] = largest(distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0]))
    return out


@njit(cache=True, nogil=True)
def bisection_weights(edge, jitter):  # type: ignore[no-untyped-def]
    """Return the weights (2 n, 3, 3) of both halves of tubes, cut from the middle of `edge` (n,), or a share `jitter`
    of the edge off it, to the opposite corner; all first halves, then all second ones."""
    n = len(edge)
    out = np.zeros((2 * n, 3, 3))
    for i in range(n):
        a, b = edge[i], (edge[i] + 1) % 3
        share = 0.5 + (jitter if i % 2 else -jitter)
        for part in range(2):
            w, moved = out[part * n + i], b if part == 0 else a
            for c in range(3):
                w[c, c] = 1.0
            w[moved, a], w[moved, b] = share, 1.0 - share
    return out


@njit(cache=True, nogil=True)
def clip_weights(side):  # type: ignore[no-untyped-def]
    """Return the weights (3 n, 3, 3) of three parts of tubes, clipped along a straight line: all parts with the lone
    corner, then the others.

    Args: side (n, 3) signed distances of the corners from the line; one corner has a sign of its own.
    """
    n = len(side)
    out = np.zeros((3 * n, 3, 3))
    for i in range(n):
        s = side[i]
        positive = int(s[0] > 0.0) + int(s[1] > 0.0) + int(s[2] > 0.0)
        lone = 0
        for c in range(2, -1, -1):
            if (s[c] > 0.0) == (positive == 1):
                lone = c
        b, c = (lone + 1) % 3, (lone + 2) % 3
        to_b, to_c = s[lone] / (s[lone] - s[b]), s[lone] / (s[lone] - s[c])
        # u on the edge to b, v on that to c: parts (lone, u, v), (u, b, c), (u, c, v).
        for part, corner in ((0, 1), (1, 0), (2, 0)):
            out[part * n + i, corner, lone], out[part * n + i, corner, b] = 1.0 - to_b, to_b
        for part in (0, 2):
            out[part * n + i, 2, lone], out[part * n + i, 2, c] = 1.0 - to_c, to_c
        out[i, 0, lone] = 1.0
        out[n + i, 1, b], out[n + i, 2, c], out[2 * n + i, 1, c] = 1.0, 1.0, 1.0
    return out


@njit(cache=True, nogil=True)
def part_coordinates(weights, parent, bary):  # type: ignore[no-untyped-def]
    """Return the barycentric corners (m, 3, 3) of parts on the first facet of their parents (m,)."""
    out = np.empty((len(parent), 3, 3))
    for i in range(len(parent)):
        w, b = weights[i], bary[parent[i]]
        for c in range(3):
            for x in range(3):
                out[i, c, x] = w[c, 0] * b[0, x] + w[c, 1] * b[1, x] + w[c, 2] * b[2, x]
    return out


@njit(cache=True, nogil=True)
def nonempty_parts(points, halves):  # type: ignore[no-untyped-def]
    """Return the parts (m,) that have an area, and the first `halves`, which always have."""
    out, count = np.empty(len(points), np.int64), 0
    for i in range(len(points)):
        p, q, r = points[i, 0], points[i, 1], points[i, 2]
        ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        if i < halves or 0.5 * math.sqrt(x * x + y * y + z * z) > _LEAST_AREA:
            out[count] = i
            count += 1
    return out[:count]


@njit(cache=True, forceinline=True)
def _mean(w, x, out):  # type: ignore[no-untyped-def]
    """Write the mean of the rows of x (3, 3) by weights w (3,)."""
    for c in range(3):
        out[c] = w[0] * x[0, c] + w[1] * x[1, c] + w[2] * x[2, c]


@njit(cache=True, forceinline=True)
def _to_unit(v):  # type: ignore[no-untyped-def]
    """Scale v (3,) to length one; a vector of none stays as it is."""
    size = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if size > 0.0:
        for c in range(3):
            v[c] /= size


@njit(cache=True, forceinline=True)
def _length_on(w, p, k, length):  # type: ignore[no-untyped-def]
    """Return the length [m] at a corner of weights w (3,) on the parent's edges, by the cubic Hermite rule."""
    for a in range(3):
        if w[a] == 1.0:
            return length[a]
    h = length[0]
    for a in range(3):
        b, t = (a + 1) % 3, w[(a + 1) % 3]
        if t > 0.0 and w[a] > 0.0:
            slope, ga, gb = length[b] - length[a], 0.0, 0.0
            for c in range(3):
                d = p[b, c] - p[a, c]
                ga += k[a, c] * d
                gb += k[b, c] * d
            h = length[a] + t * slope + t * (1 - t) * ((1 - t) * (ga - slope) - t * (gb - slope))
    return h


@njit(cache=True, forceinline=True)
def _rise(w, p, n, out):  # type: ignore[no-untyped-def]
    """Write how far (3,) [m] a corner of weights w (3,) on the parent's edges lies off their chords; return whether it
    does."""
    for a in range(3):
        b = (a + 1) % 3
        if w[a] > 0.0 and w[b] > 0.0:
            return rise_off_chord(p[a], p[b], n[a], n[b], w[b], out)
    return False


@njit(cache=True, nogil=True)
def part_rays(  # type: ignore[no-untyped-def]
    weights, parent, points, k, length, normals, out_points, out_k, out_length, out_normals
):  # fmt: skip
    """Write the rays of parts of parents (m,): points, directions and normals are weighted means, points raised to the
    curved surface; lengths follow the cubic Hermite rule, the centre's is the mean of parabolas along the medians."""
    offset = np.empty(3)
    for i in range(len(parent)):
        j = parent[i]
        p, direction, normal = out_points[i], out_k[i], out_normals[i]
        for c in range(3):
            p[3, c], direction[3, c], normal[3, c] = 0.0, 0.0, 0.0
        for q in range(3):
            w = weights[i, q]
            _mean(w, points[j], p[q])
            _mean(w, k[j], direction[q])
            _mean(w, normals[j], normal[q])
            _to_unit(direction[q])
            _to_unit(normal[q])
            out_length[i, q] = _length_on(w, points[j], k[j], length[j])
            if _rise(w, points[j], normals[j], offset):
                for c in range(3):
                    p[q, c] += offset[c]
                    out_length[i, q] += offset[c] * direction[q, c]
            for c in range(3):
                p[3, c] += p[q, c] / 3.0
                direction[3, c] += direction[q, c]
                normal[3, c] += normal[q, c]
        _to_unit(direction[3])
        _to_unit(normal[3])
        for q in range(3):
            d = (q + 1) % 3
            if rise_off_chord(p[q], p[d], normal[q], normal[d], 0.5, offset):
                for c in range(3):
                    p[3, c] += 4.0 / 9.0 * offset[c]
        total = 0.0
        for q in range(3):
            reach = 0.0
            for c in range(3):
                reach += (direction[q, c] + direction[3, c]) * (p[3, c] - p[q, c])
            total += out_length[i, q] + 0.5 * reach
        out_length[i, 3] = total / 3.0
