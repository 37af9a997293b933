"""At which edge patches of curved surfaces are bisected (numba kernels); arguments as in `curved_patches`."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import copy_corners, middle, normal_on, place_on
from raychan.vectors import distance, distance_to_triangle, largest, length_to, twice_area, twice_area_across

# Bisections from which on the longest edge is cut: between two bends of the phase that cancel at its middle an edge
# tells no bend, and cuts of the other two leave ever narrower patches along it, without end. Not measured.
_MANY = 20
_FAR = 0.5  # of a patch's distance from an end: smaller ones are told by the distance of their centre; not measured


@njit(cache=True, forceinline=True, uncounted=True)
def _length_across(p, q, image, far):  # type: ignore[no-untyped-def]
    """Return the length of pq across the rays from the image [m]."""
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
    facet, bary, v, n, b, image, far, out_image, out_far, wavenumber, phase, turn, max_edge, most_bend,
    widest, across, least, near,
):  # fmt: skip
    """Return at which edge (n,) to bisect each patch so that its two-way phase comes nearer to a quadratic; -1: none.

    All limits on phase and normal grow with half the span of phase: where it runs, a patch scatters less.

    Args: phase [rad] by which the quadratic through corners and edge middles may miss the centre; turn [rad] of the
    normal; max_edge [m], across the rays of the first leg if `across`, of patches that may scatter `least` [1/m] or
    more, all in phase under a unit field at 1 m; most_bend [rad] of the phase along an edge; widest [rad] under which
    an end may see an edge; near the share of its distance from an end that a patch which may scatter `least` may reach.
    """
    out = np.empty(len(facet), np.int8)
    p, normal, total = np.empty((7, 3)), np.empty((4, 3)), np.empty(7)
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for c in range(3):
            d = (c + 1) % 3
            place_on(v[f], b[f], w[c, 0], w[c, 1], w[c, 2], p[c])
            normal_on(n[f], w[c, 0], w[c, 1], w[c, 2], normal[c])
            place_on(
                v[f], b[f], 0.5 * (w[c, 0] + w[d, 0]), 0.5 * (w[c, 1] + w[d, 1]), 0.5 * (w[c, 2] + w[d, 2]), p[3 + c]
            )
        x, y, z = middle(w)
        place_on(v[f], b[f], x, y, z, p[6])
        normal_on(n[f], x, y, z, normal[3])
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
            e0, e1 = _length_across(p[0], p[1], image, far), _length_across(p[1], p[2], image, far)
            e2 = _length_across(p[2], p[0], image, far)
        else:
            e0, e1, e2 = distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0])
        limit = 1.0 + 0.5 * (high - low)
        if off > limit:
            out[i] = largest(bend0, bend1, bend2)
        elif turned > limit:
            # Where the phase is quadratic, only a cut across the turn of the normal lessens it.
            n0, n1 = distance(normal[0], normal[1]), distance(normal[1], normal[2])
            out[i] = largest(n0, n1, distance(normal[2], normal[0]))
        elif max(e0, e1, e2) > max_edge and _may_bring(p, image, far, out_image, out_far, wavenumber) >= least:
            out[i] = largest(e0, e1, e2)
        else:
            out[i] = _edge_by_distance(p, image, far, out_image, out_far, wavenumber, widest, least, near)
    return out


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _edge_by_distance(p, image, far, out_image, out_far, wavenumber, widest, least, near):  # type: ignore[no-untyped-def]
    """Return at which edge to bisect a patch of corners p (7, 3) [m], the last its centre, that is too large for its
    distance from an end; -1: none. Else as for `edge_to_cut`."""
    nearest = 1.0 / wavenumber
    large = _reaches_far(p, image, far, near, nearest) or _reaches_far(p, out_image, out_far, near, nearest)
    if large and _may_bring(p, image, far, out_image, out_far, wavenumber) >= least:
        # Its reach lessens by cuts of the longest edge, not of that across the rays.
        return largest(distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0]))
    edge = _widest_edge(p, image, far, widest)
    return edge if edge >= 0 else _widest_edge(p, out_image, out_far, widest)


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _reaches_far(p, image, far, near, nearest):  # type: ignore[no-untyped-def]
    """Tell whether a patch of corners p (7, 3) [m], the last its centre, reaches beyond a share `near` of its distance
    from an end, taken to be `nearest` [m] or more: neither a quadratic phase nor one amplitude follows the waves."""
    if far:
        return False
    size = _size(p)
    # No point is nearer than the centre by more than the size.
    if size <= near * max(length_to(p[6], image, False) - size, nearest):
        return False
    return size > near * max(distance_to_triangle(p, image), nearest)


@njit(cache=True, forceinline=True, uncounted=True)
def _size(p):  # type: ignore[no-untyped-def]
    """Return how far the corners of a patch p (7, 3) [m] lie from the last, its centre, at most [m]."""
    return max(distance(p[0], p[6]), distance(p[1], p[6]), distance(p[2], p[6]))


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _may_bring(p, image, far, out_image, out_far, wavenumber):  # type: ignore[no-untyped-def]
    """Return what a patch may scatter [1/m], as `_in_phase`; where it reaches far beyond its distance from an end, a
    bound: the distances of its centre tell nothing of what lies nearest."""
    size = _size(p)
    there = np.inf if far else length_to(p[6], image, False)
    back = np.inf if out_far else length_to(p[6], out_image, False)
    if size <= _FAR * min(there, back):
        return _in_phase(p, image, far, out_image, out_far, wavenumber)
    most = wavenumber / (4.0 * math.pi) * twice_area(p)
    if not far:
        most /= distance_to_triangle(p, image)
    return most if out_far else most / distance_to_triangle(p, out_image)


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _in_phase(p, image, far, out_image, out_far, wavenumber):  # type: ignore[no-untyped-def]
    """Return what a patch of corners p (7, 3), the last its centre, may scatter [1/m], all in phase: k A / (2 pi r r')
    of its area across the rays (see `radiation.phases`)."""
    if far:
        across = twice_area_across(p, (image[0], image[1], image[2]))
    else:
        k = p[6, 0] - image[0], p[6, 1] - image[1], p[6, 2] - image[2]
        across = twice_area_across(p, k) / length_to(p[6], image, False) ** 2
    if not out_far:
        across /= length_to(p[6], out_image, False)
    return wavenumber / (4.0 * math.pi) * abs(across)


@njit(cache=True, forceinline=True)
def _widest_edge(p, image, far, widest):  # type: ignore[no-untyped-def]
    """Return the edge of a patch of corners p (7, 3) that is seen under the largest angle from the image, if that is
    larger than `widest`; else -1."""
    if far or widest == np.inf:
        return -1
    e0, e1 = _length_across(p[0], p[1], image, far), _length_across(p[1], p[2], image, far)
    e2 = _length_across(p[2], p[0], image, far)
    return largest(e0, e1, e2) if max(e0, e1, e2) > widest * length_to(p[6], image, far) else -1


@njit(cache=True, nogil=True, error_model="numpy")
def edge_of_fan(facet, bary, n, fan):  # type: ignore[no-untyped-def]
    """Return at which edge (n,) to bisect each patch that spreads reflected rays by more than `fan` [rad]; -1: none."""
    out, normal = np.empty(len(facet), np.int8), np.empty((3, 3))
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for c in range(3):
            normal_on(n[f], w[c, 0], w[c, 1], w[c, 2], normal[c])
        n0, n1, n2 = distance(normal[0], normal[1]), distance(normal[1], normal[2]), distance(normal[2], normal[0])
        # A ray turns by twice the turn of the normal.
        out[i] = largest(n0, n1, n2) if 2.0 * max(n0, n1, n2) > fan else -1
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def halved(facet, bary, edge, rows, jitter, level):  # type: ignore[no-untyped-def]
    """Return (facet, bary) of both halves of the patches `rows` (m,), cut from a point of `edge` (n,), after many cuts
    of the longest one, to the opposite corner.

    The point is the middle, or a share `jitter` of the edge to either side of it.
    """
    m = len(rows)
    facets, barys = np.empty(2 * m, facet.dtype), np.empty((2 * m, 3, 3))
    for j in range(m):
        i = rows[j]
        w, a = bary[i], np.int64(edge[i])
        if level >= _MANY:
            a = np.int64(largest(distance(w[0], w[1]), distance(w[1], w[2]), distance(w[2], w[0])))
        c = (a + 1) % 3
        # To which side is pseudo-random, by facet and level, and the same in every run.
        share = 0.5 + (jitter if ((facet[i] * 40503 >> 7) + level) & 1 else -jitter)
        facets[2 * j], facets[2 * j + 1] = facet[i], facet[i]
        copy_corners(barys[2 * j], bary[i])
        copy_corners(barys[2 * j + 1], bary[i])
        for x in range(3):
            cut = share * bary[i, a, x] + (1.0 - share) * bary[i, c, x]
            barys[2 * j, c, x], barys[2 * j + 1, a, x] = cut, cut
    return facets, barys
