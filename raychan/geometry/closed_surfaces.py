"""Closed surfaces of facets: what is inside, and how far away they are (numba kernels).

Everywhere: v (n, 3, 3) [m] corners of the facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import dot


@njit(cache=True, nogil=True)
def crossed_cells(v, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return which cubes of a grid (shape (3,), side `cell` [m], from `low` (3,) [m] on) facets pass through, and
    perhaps some beside them."""
    out = np.zeros((shape[0], shape[1], shape[2]), np.bool_)
    begin, end, n = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3)
    wide = 1e-6 * cell
    for f in range(len(v)):
        for c in range(3):
            least, most = min(v[f, 0, c], v[f, 1, c], v[f, 2, c]), max(v[f, 0, c], v[f, 1, c], v[f, 2, c])
            begin[c] = max(int((least - low[c] - wide) / cell), 0)
            end[c] = min(int((most - low[c] + wide) / cell) + 1, shape[c])
            a, b = (c + 1) % 3, (c + 2) % 3
            n[c] = (v[f, 1, a] - v[f, 0, a]) * (v[f, 2, b] - v[f, 0, b])
            n[c] -= (v[f, 1, b] - v[f, 0, b]) * (v[f, 2, a] - v[f, 0, a])
        # A cube whose corners are all on one side of the facet's plane is not met.
        reach = (0.5 * cell + wide) * (abs(n[0]) + abs(n[1]) + abs(n[2]))
        for i in range(begin[0], end[0]):
            x = n[0] * (low[0] + (i + 0.5) * cell - v[f, 0, 0])
            for j in range(begin[1], end[1]):
                y = n[1] * (low[1] + (j + 0.5) * cell - v[f, 0, 1])
                for k in range(begin[2], end[2]):
                    z = n[2] * (low[2] + (k + 0.5) * cell - v[f, 0, 2])
                    out[i, j, k] |= abs(x + y + z) <= reach
    return out


@njit(cache=True, nogil=True)
def winding(v, point):  # type: ignore[no-untyped-def]
    """Return the winding number of the facets about a point (3,) [m]: 1 inside a closed surface, 0 outside.

    Source: Van Oosterom and Strackee (1983), IEEE Trans. Biomed. Eng. 30(2).
    """
    total = 0.0
    for f in range(len(v)):
        ax, ay, az = v[f, 0, 0] - point[0], v[f, 0, 1] - point[1], v[f, 0, 2] - point[2]
        bx, by, bz = v[f, 1, 0] - point[0], v[f, 1, 1] - point[1], v[f, 1, 2] - point[2]
        cx, cy, cz = v[f, 2, 0] - point[0], v[f, 2, 1] - point[1], v[f, 2, 2] - point[2]
        a, b = math.sqrt(ax * ax + ay * ay + az * az), math.sqrt(bx * bx + by * by + bz * bz)
        c = math.sqrt(cx * cx + cy * cy + cz * cz)
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        dots = (ax * bx + ay * by + az * bz) * c + (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b
        total += math.atan2(volume, a * b * c + dots)
    return total / (2.0 * math.pi)


@njit(cache=True, nogil=True)
def clearance(v, point):  # type: ignore[no-untyped-def]
    """Return the distance [m] from a point (3,) to the nearest facet."""
    best = np.inf
    for f in range(len(v)):
        off, size = 0.0, 0.0
        for c in range(3):
            off += (v[f, 0, c] - point[c]) ** 2
            size = max(size, abs(v[f, 1, c] - v[f, 0, c]), abs(v[f, 2, c] - v[f, 0, c]))
        # No point of the facet is farther from its first corner than the longer edge there.
        if math.sqrt(off) - math.sqrt(3.0) * size < best:
            best = min(best, _distance(v[f, 0], v[f, 1], v[f, 2], point))
    return best


@njit(cache=True)
def _distance(a, b, c, p):  # type: ignore[no-untyped-def]
    """Return the distance from p to triangle a, b, c. Source: Ericson (2005), Real-Time Collision Detection, 5.1.5."""
    ab, ac, ap, bp, cp = _minus(b, a), _minus(c, a), _minus(p, a), _minus(p, b), _minus(p, c)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    d3, d4, d5, d6 = dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - t
    else:
        s, t = vb / (va + vb + vc), vc / (va + vb + vc)
    off = 0.0
    for i in range(3):
        off += (p[i] - (a[i] + s * ab[i] + t * ac[i])) ** 2
    return math.sqrt(off)


@njit(cache=True, forceinline=True)
def _minus(a, b):  # type: ignore[no-untyped-def]
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
