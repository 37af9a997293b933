"""Edges: which edge of the surfaces runs through a tube, so that the tube can be cut exactly there."""

from __future__ import annotations

import numpy as np

from raychan.kernels.jit import njit

_MANY = 64  # edges around a plane beyond which halving is cheaper than looking at each
INSIDE = 1e-3  # of a tube's half width: an edge nearer than this to the tube's side does not cut it


@njit(cache=True, inline="always")
def dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross_into(a, b, out):  # type: ignore[no-untyped-def]
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def inside(a, b, corners, centre, source, k, far, begin, end, n):  # type: ignore[no-untyped-def]
    """Return the part of segment ab (within begin to end, 0 to 1) that lies inside the pyramid of rays."""
    scale = 1.0
    if not far:
        edge, here = 0.0, 0.0
        for c in range(3):
            edge += (0.5 * (a[c] + b[c]) - source[c]) * k[c]
            here += (centre[c] - source[c]) * k[c]
        scale = min(max(edge / here, 0.01), 100.0)
    for e in range(3):
        p, q = corners[e], corners[(e + 1) % 3]
        if far:
            cross_into(q - p, k, n)
        else:
            cross_into(p - source, q - source, n)
        whole, fa, fb = 0.0, 0.0, 0.0
        for c in range(3):
            whole += (centre[c] - p[c]) * n[c]
            fa += (a[c] - p[c]) * n[c]
            fb += (b[c] - p[c]) * n[c]
        if whole == 0.0:
            return 0.0, 0.0
        fa, fb = fa / whole - INSIDE * scale, fb / whole - INSIDE * scale
        if fa < 0.0 and fb < 0.0:
            return 0.0, 0.0
        if fa < 0.0:
            begin = max(begin, fa / (fa - fb))
        elif fb < 0.0:
            end = min(end, fa / (fa - fb))
    return begin, max(end, begin)


@njit(cache=True, inline="always")
def above(ha, hb):  # type: ignore[no-untyped-def]
    """Return the part (0 to 1) of a segment whose ends have heights ha, hb that lies above zero; equal: none."""
    if ha <= 0.0 and hb <= 0.0:
        return 0.0, 0.0
    if ha <= 0.0:
        return ha / (ha - hb), 1.0
    return 0.0, 1.0 if hb > 0.0 else ha / (ha - hb)


@njit(cache=True)
def _between(points, source, k, far, plane, p1, n1, p2, n2, a, b, side):  # type: ignore[no-untyped-def]
    """Write into side (3,) the corners' distances from the plane through the source and the line where two planes meet.

    Returns whether it parts the rays that land on plane a from those that land on plane b (bodies that
    run into each other have no edge there).
    """
    c1 = dot(k, n1) if far else dot(source - p1, n1)
    c2 = dot(k, n2) if far else dot(source - p2, n2)
    m = c2 * n1 - c1 * n2
    size = np.sqrt(dot(m, m))
    if size < 1e-12:
        return False
    offset = c2 * dot(p1, n1) - c1 * dot(p2, n2)
    sign = 0.0
    for q in range(4):
        f = (dot(points[q], m) - offset) / size
        if q < 3:
            side[q] = f
        if plane[q] == a or plane[q] == b:
            wanted = f if plane[q] == a else -f
            if sign == 0.0:
                sign = wanted
            elif sign * wanted <= 0.0:
                return False
    return side.min() < 0.0 and side.max() > 0.0


@njit(cache=True)
def starts_again(first):  # type: ignore[no-untyped-def]
    """Put the starts of each cell's entries back in place after filling has moved each to its end."""
    for at in range(len(first) - 1, 0, -1):
        first[at] = first[at - 1]
    first[0] = 0


@njit(cache=True, nogil=True)
def meeting_lines(points, source, k, far, plane, facet, first, normal, own, side):  # type: ignore[no-untyped-def]
    """Fill in rows of side (n, 3) that are zero: the line where two of the planes that a tube's rays met run into
    each other.

    Args as for `edge_within`; facet (n, 4) met by each ray, -1 for the tube's own plane, of normal own (n, 3); first,
    normal (m, 3): a point and the normal of each facet.
    """
    work = np.empty(3)
    for i in range(points.shape[0]):
        if side[i].any():
            continue
        for r in range(3):
            a, b = plane[i, r], plane[i, r + 1]
            if a < 0 or b < 0 or a == b:
                continue
            fa, fb = facet[i, r], facet[i, r + 1]
            pa, na = (first[fa], normal[fa]) if fa >= 0 else (points[i, 3], own[i])
            pb, nb = (first[fb], normal[fb]) if fb >= 0 else (points[i, 3], own[i])
            if _between(points[i], source[i], k[i], far, plane[i], pa, na, pb, nb, a, b, work):
                side[i] = work
                break


@njit(cache=True, nogil=True)
def edge_within(points, source, k, far, plane, first_edge, outline):  # type: ignore[no-untyped-def]
    """Return signed distances (n, 3) [m] of each tube's corners from the plane through its source and an edge inside
    it.

    Args: points (n, 4, 3) [m] corners and centre; source (n, 3) [m] where the rays come from, or k (n, 3) their
    direction when far; plane (n, 4) where each ray lands (-1: nowhere); first_edge, outline: the edges around planes.
    Of the edges around the planes that were hit, the one of which the longest part lies inside; zeros when none does.
    """
    n = points.shape[0]
    best_side = np.zeros((n, 3))
    side, m, work = np.empty(3), np.empty(3), np.empty(3)
    for i in range(n):
        best = 0.0
        for r in range(4):
            g = plane[i, r]
            if g < 0 or (r > 0 and g == plane[i, r - 1]) or first_edge[g + 1] - first_edge[g] > _MANY:
                continue
            for e in range(first_edge[g], first_edge[g + 1]):
                a, b = outline[e, 0], outline[e, 1]
                begin, end = above(dot(a - points[i, 3], k[i]), dot(b - points[i, 3], k[i]))
                if begin == end:
                    continue
                begin, end = inside(a, b, points[i], points[i, 3], source[i], k[i], far, begin, end, work)
                length = (end - begin) * np.sqrt(np.sum((b - a) ** 2))
                if length <= best:
                    continue
                cross_into(b - a, k[i] if far else source[i] - a, m)
                size = np.sqrt(dot(m, m))
                if size == 0.0:
                    continue
                for q in range(3):
                    side[q] = dot(points[i, q] - a, m) / size
                if side.min() < 0.0 and side.max() > 0.0:
                    best = length
                    best_side[i] = side
    return best_side
