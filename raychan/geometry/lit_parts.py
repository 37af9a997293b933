"""Lit parts of patches: curved patches are clipped at the terminator, where the surface turns away from the source
(numba kernels). Arguments as in `geometry.curved_patches`."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import copy_corners, middle, place_on
from raychan.vectors import dot


@njit(cache=True, forceinline=True)
def _facing(v, n, b, image, far):  # type: ignore[no-untyped-def]
    """Return 1 if all of a facet's curved surface faces the image, -1 if all turns away, 0 if that is not sure."""
    low, high = np.inf, -np.inf
    for i in range(3):
        swell = 0.0
        for j in range(3):
            # Of a patch's three products l_i l_j the sum is at most 1/3.
            swell = max(swell, abs(dot(n[i], b[j])) / 3.0)
        for j in range(3):
            height = 0.0
            for c in range(3):
                height += n[i, c] * (image[c] if far else image[c] - v[j, c])
            low, high = min(low, height - swell), max(high, height + swell)
    return 1 if low > 0.0 else (-1 if high < 0.0 else 0)


@njit(cache=True, forceinline=True)
def _towards(v, n, b, x, y, z, image, far):  # type: ignore[no-untyped-def]
    """Return the cosine of incidence at barycentric (x, y, z) of the curved surface: above 0 where it faces the
    image."""
    xy, yz, zx = x * y, y * z, z * x
    along, size, reach = 0.0, 0.0, 0.0
    for c in range(3):
        p = x * v[0, c] + y * v[1, c] + z * v[2, c] - xy * b[0, c] - yz * b[1, c] - zx * b[2, c]
        k = image[c] if far else image[c] - p
        m = x * n[0, c] + y * n[1, c] + z * n[2, c]
        along += k * m
        size += m * m
        reach += k * k
    return along / math.sqrt(size * reach)


@njit(cache=True, error_model="numpy")
def _parts_towards(v, n, b, is_open, w, image, far, side, p, out):  # type: ignore[no-untyped-def]
    """Write the parts of a patch that face the image into out (3, 3, 3), on facets lit from both sides (is_open) all
    parts; return how many.

    Args: side (3,), p (3, 3) for work.
    """
    low, high, total = np.inf, -np.inf, 0.0
    for q in range(3):
        side[q] = _towards(v, n, b, w[q, 0], w[q, 1], w[q, 2], image, far)
        low, high, total = min(low, side[q]), max(high, side[q]), total + side[q]
    if not (high > 1e-9 and low < -1e-9):
        copy_corners(out[0], w)
        return 1 if is_open or total > 0.0 else 0
    for q in range(3):
        if side[q] == 0.0:
            side[q] = 1e-12
    _clip(w, side, out)
    count = 0
    for j in range(3):
        x, y, z = middle(out[j])
        if not is_open and _towards(v, n, b, x, y, z, image, far) <= 0.0:
            continue
        for q in range(3):
            place_on(v, b, out[j, q, 0], out[j, q, 1], out[j, q, 2], p[q])
        if _twice_area(p) > 2e-14:
            copy_corners(out[count], out[j])
            count += 1
    return count


@njit(cache=True)
def _with_room(facets, barys, room):  # type: ignore[no-untyped-def]
    """Return copies of facets (n,) and barys (n, 3, 3) in arrays with room for `room` rows."""
    more_facets, more_barys = np.empty(room, facets.dtype), np.empty((room, 3, 3))
    for i in range(len(facets)):
        more_facets[i] = facets[i]
        copy_corners(more_barys[i], barys[i])
    return more_facets, more_barys


@njit(cache=True, nogil=True, error_model="numpy")
def lit_parts(facet, bary, v, n, b, is_open, image, far):  # type: ignore[no-untyped-def]
    """Return (facet, bary) of the parts of patches that face the source, clipped along the terminator.

    Args: is_open (f,) facets that are lit from both sides.
    """
    m = len(facet)
    room = m + m // 4 + 9
    facets, barys = np.empty(room, facet.dtype), np.empty((room, 3, 3))
    p, side, part = np.empty((3, 3)), np.empty(3), np.empty((3, 3, 3))
    count, f, lit = 0, -1, 0
    for i in range(m):
        if facet[i] != f:
            f = facet[i]
            lit = _facing(v[f], n[f], b[f], image, far)
            lit = lit * lit if is_open[f] else lit
        if lit < 0:
            continue
        if count + 3 + m - i > len(facets):
            facets, barys = _with_room(facets[:count], barys[:count], len(facets) + m // 4 + 9)
        found = 1
        copy_corners(part[0], bary[i])
        if lit == 0:
            found = _parts_towards(v[f], n[f], b[f], is_open[f], bary[i], image, far, side, p, part)
        for j in range(found):
            facets[count] = f
            copy_corners(barys[count], part[j])
            count += 1
    return facets[:count], barys[:count]


@njit(cache=True, forceinline=True)
def _clip(w, side, part):  # type: ignore[no-untyped-def]
    """Write the three parts of a triangle clipped where `side` (3,) changes sign: first that of the lone corner."""
    positive = int(side[0] > 0.0) + int(side[1] > 0.0) + int(side[2] > 0.0)
    lone = 0
    for c in range(3):
        if (side[c] > 0.0) == (positive == 1):
            lone = c
            break
    b, c = (lone + 1) % 3, (lone + 2) % 3
    to_b, to_c = side[lone] / (side[lone] - side[b]), side[lone] / (side[lone] - side[c])
    for x in range(3):
        u = w[lone, x] * (1.0 - to_b) + w[b, x] * to_b
        t = w[lone, x] * (1.0 - to_c) + w[c, x] * to_c
        part[0, 0, x], part[0, 1, x], part[0, 2, x] = w[lone, x], u, t
        part[1, 0, x], part[1, 1, x], part[1, 2, x] = u, w[b, x], w[c, x]
        part[2, 0, x], part[2, 1, x], part[2, 2, x] = u, w[c, x], t


@njit(cache=True, forceinline=True)
def _twice_area(p):  # type: ignore[no-untyped-def]
    """Return twice the area of a triangle (3, 3) [m^2]."""
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    return math.sqrt((ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2)
