"""Normals at many vertices at once, from the facets about each and from surfaces through its neighbours (numba
kernels)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import cross, dot, less, row

_UNKNOWNS = 9  # of the cubic surface: two slopes, three terms of second and four of third order
_QUADRATIC = 5  # of them, without the third order; at the border of a patch two rings of facets determine no cubic one
_SMALL = 1e-300  # below any number that counts: nothing is divided by zero


@njit(cache=True, nogil=True, error_model="numpy")
def fold_angles(normal, pair):  # type: ignore[no-untyped-def]
    """Return the angle (e,) [rad] between the unit normals (f, 3) of the facets on both sides of half edges (e, 2)."""
    out = np.empty(len(pair))
    for e in range(len(pair)):
        a, b = row(normal, pair[e, 0] // 3), row(normal, pair[e, 1] // 3)
        c = cross(a, b)
        out[e] = math.atan2(math.sqrt(dot(c, c)), dot(a, b))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def weighted_normals(v, faces, group, count):  # type: ignore[no-untyped-def]
    """Return the sums (count, 3) of the facets' normals at vertices, weighted by the sine of each corner over both edge
    lengths, and of their sizes (count,); group (3 f,) the vertex of each corner of faces (f, 3) of v (k, 3)."""
    total, whole = np.zeros((count, 3)), np.zeros(count)
    for f in range(len(faces)):
        p = row(v, faces[f, 0]), row(v, faces[f, 1]), row(v, faces[f, 2])
        for k in range(3):
            here = p[0] if k == 0 else p[1] if k == 1 else p[2]
            after = p[1] if k == 0 else p[2] if k == 1 else p[0]
            before = p[2] if k == 0 else p[0] if k == 1 else p[1]
            to, back = less(after, here), less(before, here)
            by = max(dot(to, to) * dot(back, back), _SMALL)
            c = cross(to, back)
            g = group[3 * f + k]
            for x in range(3):
                total[g, x] += c[x] / by
            whole[g] += math.sqrt(dot(c, c)) / by
    return total, whole


@njit(cache=True, nogil=True, error_model="numpy")
def turns(normal, group, pair, fold, total):  # type: ignore[no-untyped-def]
    """Return the largest fold (g,) [rad] over an edge of a facet at each vertex, and by how much facets turn off its
    normal, total (g, 3), at most (g,) [rad].

    Args: normal (f, 3) of facets; group (3 f,) the vertex of each corner; pair (e, 2) half edges with fold (e,) [rad].
    """
    around, most, turn = np.zeros(len(normal)), np.zeros(len(total)), np.zeros(len(total))
    for e in range(len(pair)):
        a, b = pair[e, 0] // 3, pair[e, 1] // 3
        around[a], around[b] = max(around[a], fold[e]), max(around[b], fold[e])
    for h in range(len(group)):
        g, f = group[h], h // 3
        most[g] = max(most[g], around[f])
        turn[g] = max(turn[g], math.acos(min(1.0, max(-1.0, dot(row(total, g), row(normal, f))))))
    return most, turn


@njit(cache=True, nogil=True, error_model="numpy")
def corrected(place, first, rows, near, power, limits, out):  # type: ignore[no-untyped-def]
    """Write into out (g, 3) the normals of some smooth vertices, rows (m,), corrected by the surface z(x, y) through
    their neighbours.

    Args: place, first (g, 3) all vertices [m] and their first normals; near: where the neighbours of each begin
    (g + 1,), and these; power of their distance with which weights fall; limits: least pivot of the scaled equations,
    largest residual of a fit over the heights, least neighbours.
    """
    start, other = near
    work = np.zeros((_UNKNOWNS, _UNKNOWNS)), np.zeros(_UNKNOWNS), np.zeros(_UNKNOWNS), np.zeros(_UNKNOWNS)
    for i in range(len(rows)):
        g = rows[i]
        some = other[start[g] : start[g + 1]]
        n = row(first, g)
        u, w, size = _frame(place, g, some, n)
        able = False
        for k in (_UNKNOWNS, _QUADRATIC):
            if not able:
                able = _fitted(place, g, some, (u, w, n), size, k, power, limits, work)
        y = work[1]
        a, b = y[0] / size[0], y[1] / size[1]
        # A correction larger than the turn of the surface over its neighbours is not plausible.
        if not (able and math.hypot(a, b) < size[2] / math.hypot(size[0], size[1])):
            a, b = 0.0, 0.0
        x, y_, z = n[0] - a * u[0] - b * w[0], n[1] - a * u[1] - b * w[1], n[2] - a * u[2] - b * w[2]
        by = math.sqrt(x * x + y_ * y_ + z * z)
        if by > 0.0:
            out[g, 0], out[g, 1], out[g, 2] = x / by, y_ / by, z / by


@njit(cache=True, forceinline=True)
def _frame(place, g, some, n):  # type: ignore[no-untyped-def]
    """Return two axes across the normal n of vertex g, the first in which its neighbours extend farthest, and how far
    they extend along them and along n (rms) [m]."""
    u = cross(n, (1.0, 0.0, 0.0) if abs(n[0]) < 0.7 else (0.0, 1.0, 0.0))
    by = math.sqrt(max(dot(u, u), _SMALL))
    u = u[0] / by, u[1] / by, u[2] / by
    w = cross(n, u)
    xx, xy, yy, zz, p = 0.0, 0.0, 0.0, 0.0, row(place, g)
    for j in some:
        d = less(row(place, j), p)
        x, y, z = dot(d, u), dot(d, w), dot(d, n)
        xx, xy, yy, zz = xx + x * x, xy + x * y, yy + y * y, zz + z * z
    turn = 0.5 * math.atan2(2.0 * xy, xx - yy)
    c, s, count = math.cos(turn), math.sin(turn), max(len(some), 1)
    one = c * u[0] + s * w[0], c * u[1] + s * w[1], c * u[2] + s * w[2]
    two = c * w[0] - s * u[0], c * w[1] - s * u[1], c * w[2] - s * u[2]
    long, across = c * c * xx + 2.0 * c * s * xy + s * s * yy, s * s * xx - 2.0 * c * s * xy + c * c * yy
    return one, two, (
        math.sqrt(max(long / count, _SMALL)),
        math.sqrt(max(across / count, _SMALL)),
        math.sqrt(max(zz / count, _SMALL)),
    )  # fmt: skip


@njit(cache=True, forceinline=True)
def _terms(d, frame, size, basis):  # type: ignore[no-untyped-def]
    """Write the terms (9,) of the surface at a neighbour, d from the vertex; return its height [m] and the square of
    its scaled distance."""
    x, y, z = dot(d, frame[0]), dot(d, frame[1]), dot(d, frame[2])
    s, t, zx, zy = x / size[0], y / size[1], z / size[0], z / size[1]
    basis[0], basis[1] = s, t
    # Quadratic terms use the distance in space instead of that in the plane: a sphere is then fitted exactly.
    basis[2], basis[3], basis[4] = s * s + zx * zx, s * t, t * t + zy * zy
    basis[5], basis[6], basis[7], basis[8] = s * s * s, s * s * t, s * t * t, t * t * t
    return z, s * s + t * t


@njit(cache=True)
def _fitted(place, g, some, frame, size, k, power, limits, work):  # type: ignore[no-untyped-def]
    """Fit the first k terms of the surface by weighted least squares, into work[1]; tell whether the neighbours
    determine them and lie near the surface."""
    m, y, scale, basis = work
    if len(some) < limits[2]:
        return False
    p, whole = row(place, g), 0.0
    m[:], y[:] = 0.0, 0.0
    for j in some:
        z, far = _terms(less(row(place, j), p), frame, size, basis)
        weight = max(far, 1e-12) ** (-0.5 * power)
        whole += weight * z * z
        for r in range(k):
            scaled = weight * basis[r]
            y[r] += scaled * z
            for c in range(r, k):
                m[r, c] += scaled * basis[c]
    if not _solved(m, y, scale, k, limits[0]):
        return False
    rest = 0.0
    for j in some:
        z, far = _terms(less(row(place, j), p), frame, size, basis)
        for r in range(k):
            z -= basis[r] * y[r]
        rest += max(far, 1e-12) ** (-0.5 * power) * z * z
    return rest < limits[1] ** 2 * whole


@njit(cache=True, forceinline=True)
def _solved(m, y, scale, k, least):  # type: ignore[no-untyped-def]
    """Solve k normal equations, of which the upper half is given, into y, scaled to a unit diagonal; return False where
    a pivot is not above the least."""
    for r in range(k):
        scale[r] = math.sqrt(max(m[r, r], _SMALL))
    for r in range(k):
        y[r] /= scale[r]
        for c in range(r, k):
            m[r, c] /= scale[r] * scale[c]
            m[c, r] = m[r, c]
    for i in range(k):
        if not m[i, i] > least:
            return False
        for r in range(i + 1, k):
            factor = m[r, i] / m[i, i]
            for c in range(i, k):
                m[r, c] -= factor * m[i, c]
            y[r] -= factor * y[i]
    for i in range(k - 1, -1, -1):
        for c in range(i + 1, k):
            y[i] -= m[i, c] * y[c]
        y[i] /= m[i, i]
    for i in range(k):
        y[i] /= scale[i]
    return True
