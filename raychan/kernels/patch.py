"""Patches: triangles of a true surface behind flat facets, seen from a point or a direction (numba loops).

Everywhere: v, n, b (m, 3, 3) corners, corner normals and edge bulges of the facets; image (3,) the source's mirror
image [m], or the unit direction towards it when far; bary (n, 3, 3) corners of patches on their facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.kernels.jit import njit

_ALIKE = 1.0 + 1e-9  # sizes nearer than this are one: rounding must not choose between them


@njit(cache=True, inline="always")
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, inline="always")
def place_on(v, b, x, y, z, p):  # type: ignore[no-untyped-def]
    """Write into p the point of the true surface at barycentric (x, y, z)."""
    xy, yz, zx = x * y, y * z, z * x
    for c in range(3):
        p[c] = x * v[0, c] + y * v[1, c] + z * v[2, c] - xy * b[0, c] - yz * b[1, c] - zx * b[2, c]


@njit(cache=True, inline="always")
def _face(n, x, y, z, out):  # type: ignore[no-untyped-def]
    """Write into out the unit normal of the true surface at barycentric (x, y, z)."""
    for c in range(3):
        out[c] = x * n[0, c] + y * n[1, c] + z * n[2, c]
    size = math.sqrt(_dot(out, out))
    for c in range(3):
        out[c] /= size


@njit(cache=True, inline="always")
def _ray(p, image, far, k):  # type: ignore[no-untyped-def]
    """Write into k the direction in which a ray of the source travels at p; return its length."""
    if far:
        k[0], k[1], k[2] = -image[0], -image[1], -image[2]
        return -_dot(p, image)
    k[0], k[1], k[2] = p[0] - image[0], p[1] - image[1], p[2] - image[2]
    length = math.sqrt(_dot(k, k))
    k[0] /= length
    k[1] /= length
    k[2] /= length
    return length


@njit(cache=True, inline="always")
def length_to(p, image, far):  # type: ignore[no-untyped-def]
    if far:
        return -_dot(p, image)
    return math.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)


@njit(cache=True, inline="always")
def largest(a, b, c):  # type: ignore[no-untyped-def]
    if a * _ALIKE >= b and a * _ALIKE >= c:
        return 0
    return 1 if b * _ALIKE >= c else 2


@njit(cache=True, inline="always")
def distance(p, q):  # type: ignore[no-untyped-def]
    return math.sqrt((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)


@njit(cache=True, inline="always")
def _seen(p, q, image, far):  # type: ignore[no-untyped-def]
    """Return how long pq looks from the end of a way [m]."""
    whole, along, size = 0.0, 0.0, 0.0
    for c in range(3):
        d = q[c] - p[c]
        k = image[c] if far else 0.5 * (p[c] + q[c]) - image[c]
        whole += d * d
        along += d * k
        size += k * k
    return math.sqrt(max(whole - along * along / max(size, 1e-300), 0.0))


@njit(cache=True, nogil=True, error_model="numpy")
def edge_to_cut(  # type: ignore[no-untyped-def]
    facet, bary, v, n, b, image, far, out_image, out_far, wavenumber, phase, turn, max_edge, most_bend, across
):  # fmt: skip
    """Return which edge (n,) of each patch to halve so that its two-way phase comes nearer to a quadratic; -1: none.

    Args: phase [rad] that the quadratic through corners and mid-edges may miss the centre by; turn [rad] of the
    normal; max_edge [m], as seen from the end of the first way if `across`; most_bend [rad] that an edge may bend.
    """
    out = np.empty(len(facet), np.int8)
    p, normal, total = np.empty((7, 3)), np.empty((4, 3)), np.empty(7)
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for c in range(3):
            d = (c + 1) % 3
            place_on(v[f], b[f], w[c, 0], w[c, 1], w[c, 2], p[c])
            _face(n[f], w[c, 0], w[c, 1], w[c, 2], normal[c])
            place_on(
                v[f], b[f], 0.5 * (w[c, 0] + w[d, 0]), 0.5 * (w[c, 1] + w[d, 1]), 0.5 * (w[c, 2] + w[d, 2]), p[3 + c]
            )
        x, y, z = (w[0] + w[1] + w[2]) / 3.0
        place_on(v[f], b[f], x, y, z, p[6])
        _face(n[f], x, y, z, normal[3])
        low, high = np.inf, -np.inf
        for q in range(7):
            total[q] = wavenumber * (length_to(p[q], image, far) + length_to(p[q], out_image, out_far))
            if q < 6:
                low, high = min(low, total[q]), max(high, total[q])
        bend0 = total[3] - 0.5 * (total[0] + total[1])
        bend1 = total[4] - 0.5 * (total[1] + total[2])
        bend2 = total[5] - 0.5 * (total[2] + total[0])
        miss = total[6] - (total[0] + total[1] + total[2]) / 3.0 - (bend0 + bend1 + bend2) * (4.0 / 9.0)
        bend0, bend1, bend2 = abs(bend0), abs(bend1), abs(bend2)
        off = max(abs(miss) / phase, max(bend0, bend1, bend2) / most_bend)
        turned = 0.0
        for c in range(3):
            turned = max(turned, distance(normal[c], normal[3]) / turn)
        if across:
            e0, e1, e2 = _seen(p[0], p[1], image, far), _seen(p[1], p[2], image, far), _seen(p[2], p[0], image, far)
        else:
            e0, e1, e2 = distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0])
        limit = 1.0 + 0.5 * (high - low)
        if off > limit:
            out[i] = largest(bend0, bend1, bend2)
        elif turned > limit:
            # Where the phase bends no more, only a cut across the turn brings it down.
            n0, n1 = distance(normal[0], normal[1]), distance(normal[1], normal[2])
            out[i] = largest(n0, n1, distance(normal[2], normal[0]))
        elif max(e0, e1, e2) > max_edge:
            out[i] = largest(e0, e1, e2)
        else:
            out[i] = -1
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def halved(facet, bary, edge, jitter, level):  # type: ignore[no-untyped-def]
    """Return (facet, bary) of both halves of patches cut from a point of `edge` to the corner opposite.

    The point is the middle, or `jitter` of the edge off it, this way and that.
    """
    m = len(facet)
    facets, barys = np.empty(2 * m, facet.dtype), np.empty((2 * m, 3, 3))
    for i in range(m):
        a, c = edge[i], (edge[i] + 1) % 3
        # Which way is drawn by lot, the same lot in every run.
        share = 0.5 + (jitter if ((facet[i] * 40503 >> 7) + level) & 1 else -jitter)
        facets[2 * i], facets[2 * i + 1] = facet[i], facet[i]
        barys[2 * i], barys[2 * i + 1] = bary[i], bary[i]
        for x in range(3):
            cut = share * bary[i, a, x] + (1.0 - share) * bary[i, c, x]
            barys[2 * i, c, x], barys[2 * i + 1, a, x] = cut, cut
    return facets, barys


@njit(cache=True, inline="always")
def _lit(v, n, b, is_open, w, image, far, way_image, way_far, cosine, p, normal, k):  # type: ignore[no-untyped-def]
    """Write the cosines towards the end of a way at the corners and the centre of a patch; an open sheet faces
    the source."""
    sign = 1.0
    for q in range(3, -1, -1):
        if q == 3:
            x, y, z = (w[0] + w[1] + w[2]) / 3.0
        else:
            x, y, z = w[q, 0], w[q, 1], w[q, 2]
        place_on(v, b, x, y, z, p[q])
        _face(n, x, y, z, normal)
        if q == 3 and is_open:
            _ray(p[q], image, far, k)
            sign = -1.0 if _dot(k, normal) > 0.0 else 1.0
        _ray(p[q], way_image, way_far, k)
        cosine[q] = -sign * _dot(k, normal)


@njit(cache=True, inline="always")
def _faces(v, n, b, image, far):  # type: ignore[no-untyped-def]
    """Return 1 if all of a facet's true surface is turned to the image, -1 if all away, 0 if that is not sure."""
    low, high = np.inf, -np.inf
    for i in range(3):
        swell = 0.0
        for j in range(3):
            # The edges' bulges weigh a third in all at most.
            swell = max(swell, abs(_dot(n[i], b[j])) / 3.0)
        for j in range(3):
            height = 0.0
            for c in range(3):
                height += n[i, c] * (image[c] if far else image[c] - v[j, c])
            low, high = min(low, height - swell), max(high, height + swell)
    return 1 if low > 0.0 else (-1 if high < 0.0 else 0)


@njit(cache=True, inline="always")
def _lit_whole(v, n, b, is_open, image, far, way_image, way_far):  # type: ignore[no-untyped-def]
    """Return 1 if all of a facet faces the end of a way, -1 if nothing of it does, 0 if that is not sure."""
    towards = _faces(v, n, b, way_image, way_far)
    return towards * _faces(v, n, b, image, far) if is_open else towards


@njit(cache=True, nogil=True)
def may_be_lit(facet, v, n, b, is_open, image, far, way_image, way_far):  # type: ignore[no-untyped-def]
    """Tell of which facets (n,) some part may face the end of a way (see `lit_parts`)."""
    out = np.empty(len(facet), np.bool_)
    for i in range(len(facet)):
        f = facet[i]
        out[i] = _lit_whole(v[f], n[f], b[f], is_open[f], image, far, way_image, way_far) >= 0
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def lit_parts(facet, bary, v, n, b, is_open, image, far, way_image, way_far):  # type: ignore[no-untyped-def]
    """Return (facet, bary) of the parts of patches that face the end of a way, cut along the terminator.

    Args: is_open (m,) facets of open sheets, which face the source from either side.
    """
    m = len(facet)
    facets, barys = np.empty(3 * m, facet.dtype), np.empty((3 * m, 3, 3))
    p, normal, k, cosine, side = np.empty((4, 3)), np.empty(3), np.empty(3), np.empty(4), np.empty(3)
    part = np.empty((3, 3, 3))
    count, f, whole = 0, -1, 0
    for i in range(m):
        if facet[i] != f:
            f = facet[i]
            whole = _lit_whole(v[f], n[f], b[f], is_open[f], image, far, way_image, way_far)
        if whole != 0:
            if whole > 0:
                facets[count], barys[count] = f, bary[i]
                count += 1
            continue
        _lit(v[f], n[f], b[f], is_open[f], bary[i], image, far, way_image, way_far, cosine, p, normal, k)
        corner = cosine[:3]
        if not (corner.max() > 1e-9 and corner.min() < -1e-9):
            if corner.sum() > 0.0:
                facets[count], barys[count] = f, bary[i]
                count += 1
            continue
        for c in range(3):
            side[c] = corner[c] if corner[c] != 0.0 else 1e-12
        _three(bary[i], side, part)
        for j in range(3):
            _lit(v[f], n[f], b[f], is_open[f], part[j], image, far, way_image, way_far, cosine, p, normal, k)
            if cosine[3] > 0.0 and _twice_area(p) > 2e-14:
                facets[count], barys[count] = f, part[j]
                count += 1
    return facets[:count].copy(), barys[:count].copy()


@njit(cache=True, inline="always")
def _three(w, side, part):  # type: ignore[no-untyped-def]
    """Write the three parts of a triangle cut where `side` (3,) changes sign: the lone corner's first."""
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


@njit(cache=True, inline="always")
def _twice_area(p):  # type: ignore[no-untyped-def]
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    return math.sqrt((ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2)


@njit(cache=True, nogil=True, error_model="numpy")
def rays_on(facet, bary, v, n, b, is_open, image, far):  # type: ignore[no-untyped-def]
    """Return points (n, 4, 3) [m], directions (n, 4, 3), lengths (n, 4) [m] and normals (n, 4, 3) of four rays.

    They are those of the source to corners and centre of each patch; normals face the source on open sheets.
    """
    m = len(facet)
    p, k, length, normal = np.empty((m, 4, 3)), np.empty((m, 4, 3)), np.empty((m, 4)), np.empty((m, 4, 3))
    for i in range(m):
        f, w = facet[i], bary[i]
        for q in range(4):
            if q == 3:
                x, y, z = (w[0] + w[1] + w[2]) / 3.0
            else:
                x, y, z = w[q, 0], w[q, 1], w[q, 2]
            place_on(v[f], b[f], x, y, z, p[i, q])
            _face(n[f], x, y, z, normal[i, q])
            length[i, q] = _ray(p[i, q], image, far, k[i, q])
        if is_open[f] and _dot(normal[i, 3], k[i, 3]) > 0.0:
            for q in range(4):
                for c in range(3):
                    normal[i, q, c] = -normal[i, q, c]
    return p, k, length, normal
