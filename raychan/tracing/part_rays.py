"""Rays of parts of tubes, by weights of their parents' corners (numba kernels).

Everywhere: points, k, normals (n, 4, 3), length (n, 4) of tubes (three corners, the centre); bary (n, 3, 3) corners on
the first facet; weights (m, 3, 3) of the parent's corners in each corner of a part, which lies on the parent's edges.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import rise_off_chord
from raychan.vectors import distance, largest

_LEAST_AREA = 1e-14  # m^2: a part of no more area is dropped


@njit(cache=True, nogil=True)
def longest_edges(points, rows):  # type: ignore[no-untyped-def]
    """Return the longest edge (m,) of each of the tubes `rows` (m,): from corner 0, 1 or 2 to the next."""
    out = np.empty(len(rows), np.int64)
    for i in range(len(rows)):
        p = points[rows[i]]
        out[i] = largest(distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0]))
    return out


@njit(cache=True, nogil=True)
def bisection_weights(edge, jitter):  # type: ignore[no-untyped-def]
    """Return the weights (2 n, 3, 3) of both halves of tubes, cut from the middle of `edge` (n,), or a share `jitter`
    of the edge off it, to the opposite corner; all first halves, then all second ones."""
    out = np.zeros((2 * len(edge), 3, 3))
    bisect_each(edge, jitter, out)
    return out


@njit(cache=True, nogil=True, uncounted=True)
def bisect_each(edge, jitter, out):  # type: ignore[no-untyped-def]
    """Write what `bisection_weights` returns into zeros."""
    n = len(edge)
    for i in range(n):
        a, b = edge[i], (edge[i] + 1) % 3
        share = 0.5 + (jitter if i % 2 else -jitter)
        for part in range(2):
            w, moved = out[part * n + i], b if part == 0 else a
            for c in range(3):
                w[c, c] = 1.0
            w[moved, a], w[moved, b] = share, 1.0 - share


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def clip_each(side, rows, out):  # type: ignore[no-untyped-def]
    """Write into zeros (3 m, 3, 3) the weights of three parts of the tubes `rows` (m,), clipped along a straight line:
    all parts with the lone corner, then the others.

    Args: side (n, 3) signed distances of the corners from the line; one corner has a sign of its own.
    """
    n = len(rows)
    for i in range(n):
        s = side[rows[i]]
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


@njit(cache=True, nogil=True, uncounted=True)
def part_coordinates(weights, parent, bary, out):  # type: ignore[no-untyped-def]
    """Write the barycentric corners (m, 3, 3) of parts on the first facet of their parents (m,)."""
    for i in range(len(parent)):
        w, b = weights[i], bary[parent[i]]
        for c in range(3):
            for x in range(3):
                out[i, c, x] = w[c, 0] * b[0, x] + w[c, 1] * b[1, x] + w[c, 2] * b[2, x]


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


@njit(cache=True, forceinline=True, uncounted=True)
def _mean(w, x, out):  # type: ignore[no-untyped-def]
    """Write the mean of the rows of x (3, 3) by weights w (3,)."""
    for c in range(3):
        out[c] = w[0] * x[0, c] + w[1] * x[1, c] + w[2] * x[2, c]


@njit(cache=True, forceinline=True, uncounted=True)
def _to_unit(v):  # type: ignore[no-untyped-def]
    """Scale v (3,) to length one; a vector of none stays as it is."""
    size = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if size > 0.0:
        for c in range(3):
            v[c] /= size


@njit(cache=True, forceinline=True, uncounted=True)
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


@njit(cache=True, forceinline=True, uncounted=True)
def _rise(w, p, n, out):  # type: ignore[no-untyped-def]
    """Write how far (3,) [m] a corner of weights w (3,) on the parent's edges lies off their chords; return whether it
    does."""
    for a in range(3):
        b = (a + 1) % 3
        if w[a] > 0.0 and w[b] > 0.0:
            return rise_off_chord(p[a], p[b], n[a], n[b], w[b], out)
    return False


@njit(cache=True, nogil=True, uncounted=True)
def part_rays(  # type: ignore[no-untyped-def]
    weights, parent, points, k, length, normals, out_points, out_k, out_length, out_normals, offset
):  # fmt: skip
    """Write the rays of parts of parents (m,): points, directions and normals are weighted means, points raised to the
    curved surface; lengths follow the cubic Hermite rule, the centre's is the mean of parabolas along the medians.

    Args: offset (3,) room for work.
    """
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
