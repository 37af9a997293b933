"""Where edges of surfaces cross tubes, so that a tube can be clipped exactly there (numba kernels).

The rays of a tube come from a source: a point, or a direction. With the source an edge spans a plane; where that plane
parts the corners of the tube and the edge passes through the pyramid of its rays, the tube is clipped along it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.vectors import copy_to, dot

_MOST_EDGES = 64  # around a plane: beyond, bisecting the tube is taken to be cheaper than testing each; not measured
_INSIDE = 1e-3  # of a tube's half width: an edge nearer than this to the tube's side does not clip it; not measured


class TubeRays(NamedTuple):
    """Rays of tubes that leave a mirror: points (n, 4, 3) [m] corners and centre; directions (n, 4, 3); length (n, 4)
    [m] back to the image source; flat (n,) whether all mirrors so far were planes, so that there is one; hit (n, 4)
    facet on which each ray lands, -1 for none, after reach (n, 4) [m]."""

    points: NDArray[np.float64]
    directions: NDArray[np.float64]
    length: NDArray[np.float64]
    flat: NDArray[np.bool_]
    hit: NDArray[np.int32]
    reach: NDArray[np.float64]


class FacetPlanes(NamedTuple):
    """Of each facet: the number of its plane (f,), a point on it (f, 3) [m] and its normal (f, 3)."""

    number: NDArray[np.int32]
    point: NDArray[np.float64]
    normal: NDArray[np.float64]


@njit(cache=True, forceinline=True, uncounted=True)
def _normal(a, b, image, k, far):  # type: ignore[no-untyped-def]
    """Return a vector normal to the plane through segment ab and the image."""
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    if far:
        wx, wy, wz = k[0], k[1], k[2]
    else:
        wx, wy, wz = image[0] - a[0], image[1] - a[1], image[2] - a[2]
    return dy * wz - dz * wy, dz * wx - dx * wz, dx * wy - dy * wx


@njit(cache=True, forceinline=True, uncounted=True)
def pyramid(corners, image, k, far, planes):  # type: ignore[no-untyped-def]
    """Write the normals of the planes through the image and a tube's sides, one over the centre's height long, inward;
    return how far the centre lies ahead along k [m]."""
    for e in range(3):
        p, q = corners[e], corners[(e + 1) % 3]
        x, y, z = _normal(p, q, image, k, far)
        whole = (corners[3, 0] - p[0]) * x + (corners[3, 1] - p[1]) * y + (corners[3, 2] - p[2]) * z
        # A tube without width has no inside.
        over = 1.0 / whole if whole != 0.0 else np.nan
        planes[e, 0], planes[e, 1], planes[e, 2] = x * over, y * over, z * over
    return (corners[3, 0] - image[0]) * k[0] + (corners[3, 1] - image[1]) * k[1] + (corners[3, 2] - image[2]) * k[2]


@njit(cache=True, forceinline=True, uncounted=True)
def scale_at(a, b, image, k, far, here):  # type: ignore[no-untyped-def]
    """Return the tube's width at the middle of segment ab over that at its footprint, `here` [m] ahead of the image."""
    if far:
        return 1.0
    edge = 0.0
    for c in range(3):
        edge += (0.5 * (a[c] + b[c]) - image[c]) * k[c]
    return min(max(edge / here, 0.01), 100.0)


@njit(cache=True, forceinline=True, uncounted=True)
def within(a, b, corners, planes, scale, begin, end):  # type: ignore[no-untyped-def]
    """Return the part of segment ab (within begin to end, 0 to 1) that lies inside the pyramid of rays."""
    for e in range(3):
        fa, fb = -_INSIDE * scale, -_INSIDE * scale
        for c in range(3):
            fa += (a[c] - corners[e, c]) * planes[e, c]
            fb += (b[c] - corners[e, c]) * planes[e, c]
        if not (fa >= 0.0 or fb >= 0.0):
            return 0.0, 0.0
        if fa < 0.0:
            begin = max(begin, fa / (fa - fb))
        elif fb < 0.0:
            end = min(end, fa / (fa - fb))
    return begin, max(end, begin)


@njit(cache=True, forceinline=True, uncounted=True)
def apart(a, b, corners, image, k, far, side):  # type: ignore[no-untyped-def]
    """Write into side (3,) the signed distances [m] of the corners from the plane through the image and segment ab;
    return whether the plane parts them."""
    x, y, z = _normal(a, b, image, k, far)
    size = math.sqrt(x * x + y * y + z * z)
    if size == 0.0:
        return False
    low, high = np.inf, -np.inf
    for q in range(3):
        side[q] = ((corners[q, 0] - a[0]) * x + (corners[q, 1] - a[1]) * y + (corners[q, 2] - a[2]) * z) / size
        low, high = min(low, side[q]), max(high, side[q])
    return low < 0.0 < high


@njit(cache=True, forceinline=True, uncounted=True)
def size_of(a, b):  # type: ignore[no-untyped-def]
    """Return the length of segment ab [m]."""
    return math.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)


@njit(cache=True, forceinline=True, uncounted=True)
def above(ha, hb):  # type: ignore[no-untyped-def]
    """Return from where to where (0 to 1) a segment whose ends have heights ha, hb lies above zero; equal: nowhere."""
    if ha <= 0.0 and hb <= 0.0:
        return 0.0, 0.0
    if ha <= 0.0:
        return ha / (ha - hb), 1.0
    return 0.0, 1.0 if hb > 0.0 else ha / (ha - hb)


@njit(cache=True, forceinline=True, uncounted=True)
def _height(a, p, n):  # type: ignore[no-untyped-def]
    """Return the height [m] of a over the plane through p of normal n."""
    return (a[0] - p[0]) * n[0] + (a[1] - p[1]) * n[1] + (a[2] - p[2]) * n[2]


@njit(cache=True, uncounted=True)
def _two_planes(points, source, k, far, plane, p1, n1, p2, n2, a, b, side):  # type: ignore[no-untyped-def]
    """Write into side (3,) the corners' distances [m] from the plane through the source and the line in which two
    planes meet: where bodies run into each other, no edge is drawn there.

    Returns: whether it parts the rays that land on plane a from those that land on plane b.
    """
    c1 = dot(k, n1) if far else _height(source, p1, n1)
    c2 = dot(k, n2) if far else _height(source, p2, n2)
    m = c2 * n1[0] - c1 * n2[0], c2 * n1[1] - c1 * n2[1], c2 * n1[2] - c1 * n2[2]
    size = math.sqrt(dot(m, m))
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
    return min(side[0], side[1], side[2]) < 0.0 and max(side[0], side[1], side[2]) > 0.0


@njit(cache=True, uncounted=True)
def _meeting_line(points, source, k, far, plane, facet, first, normal, own, side, work):  # type: ignore[no-untyped-def]
    """Write into side (3,) the corners' distances [m] from a line in which two of the planes that the rays hit meet."""
    for r in range(3):
        a, b = plane[r], plane[r + 1]
        if a < 0 or b < 0 or a == b:
            continue
        fa, fb = facet[r], facet[r + 1]
        pa, na = (first[fa], normal[fa]) if fa >= 0 else (points[3], own)
        pb, nb = (first[fb], normal[fb]) if fb >= 0 else (points[3], own)
        if _two_planes(points, source, k, far, plane, pa, na, pb, nb, a, b, work):
            copy_to(side, work)
            break


@njit(cache=True, uncounted=True)
def _line_beside(points, source, k, far, plane, facet, planes, beside, own, side, work, hidden):  # type: ignore[no-untyped-def]
    """Write into side (3,) the corners' distances [m] from a line that parts the hidden rays from the others, in which
    the tube's own plane meets that of a neighbour, or of a neighbour's, of a facet in the way: a body that runs into
    this one may hide it by faces that no ray met."""
    some = 0
    for r in range(4):
        hidden[r] = 1 if facet[r] >= 0 else (0 if plane[r] >= 0 else -1)
        some |= 1 << hidden[r] if hidden[r] >= 0 else 0
    if some != 3:
        return
    for r in range(4):
        f = facet[r]
        if f < 0 or (r > 0 and f == facet[r - 1]):
            continue
        for e in range(12):
            # Its neighbours, then theirs.
            g = beside[f, e % 3]
            if e >= 3 and g >= 0:
                g = beside[g, e // 3 - 1]
            if g < 0 or planes.number[g] == planes.number[f]:
                continue
            at, n = planes.point[g], planes.normal[g]
            if _two_planes(points, source, k, far, hidden, at, n, points[3], own, np.int32(1), np.int32(0), work):
                copy_to(side, work)
                return


@njit(cache=True, forceinline=True, uncounted=True)
def _any(side):  # type: ignore[no-untyped-def]
    """Tell whether a corner's distance is not zero."""
    return side[0] != 0.0 or side[1] != 0.0 or side[2] != 0.0


@njit(cache=True, nogil=True)
def meeting_lines(points, source, k, far, plane, facet, planes, beside, own, side):  # type: ignore[no-untyped-def]
    """Fill in the rows of side (n, 3) that are zero: distances [m] of corners from the line in which two of the planes
    that a tube's rays hit meet, or else the tube's own plane and one beside them.

    Args: points (n, 4, 3) [m] corners and centre; source (n, 3) [m] where the rays come from, or k (n, 3) their
    direction when far; plane (n, 4) where each ray lands (-1: nowhere); facet (n, 4) met by each ray, -1 for the tube's
    own plane, of normal own (n, 3); planes of all facets as `FacetPlanes`; beside (f, 3) facets across their edges, -1
    for none.
    """
    _each_meeting_line(
        points, source, k, far, plane, facet, planes, beside, own, side, np.empty(3), np.empty(4, np.int32)
    )


@njit(cache=True, nogil=True, uncounted=True)
def _each_meeting_line(points, source, k, far, plane, facet, planes, beside, own, side, work, hidden):  # type: ignore[no-untyped-def]
    """Do what `meeting_lines` does, with room for work (3,) and (4,)."""
    first, normal = planes.point, planes.normal
    for i in range(points.shape[0]):
        if not _any(side[i]):
            _meeting_line(points[i], source[i], k[i], far, plane[i], facet[i], first, normal, own[i], side[i], work)
        if not _any(side[i]):
            _line_beside(
                points[i], source[i], k[i], far, plane[i], facet[i], planes, beside, own[i], side[i], work, hidden
            )


@njit(cache=True, forceinline=True, uncounted=True)
def _longest(corners, source, k, far, plane, first_edge, edges, planes, side, work):  # type: ignore[no-untyped-def]
    """Write into side (3,) the distances [m] of the corners from the edge of which the longest part lies inside a tube;
    return whether there is one."""
    here = pyramid(corners, source, k, far, planes)
    best = 0.0
    for r in range(4):
        g = plane[r]
        if g < 0 or (r > 0 and g == plane[r - 1]) or first_edge[g + 1] - first_edge[g] > _MOST_EDGES:
            continue
        for e in range(first_edge[g], first_edge[g + 1]):
            a = edges[e, 0, 0], edges[e, 0, 1], edges[e, 0, 2]
            b = edges[e, 1, 0], edges[e, 1, 1], edges[e, 1, 2]
            da, db = 0.0, 0.0
            for c in range(3):
                da += (a[c] - corners[3, c]) * k[c]
                db += (b[c] - corners[3, c]) * k[c]
            begin, end = above(da, db)
            if begin == end:
                continue
            begin, end = within(a, b, corners, planes, scale_at(a, b, source, k, far, here), begin, end)
            if begin == end or (end - begin) * size_of(a, b) <= best:
                continue
            if apart(a, b, corners, source, k, far, work):
                best = (end - begin) * size_of(a, b)
                copy_to(side, work)
    return best > 0.0


@njit(cache=True, forceinline=True, uncounted=True)
def edge_within(i, rays, far, extent, planes, first_edge, edges, side, room, landed):  # type: ignore[no-untyped-def]
    """Write into side (3,) the signed distances [m] of the corners of tube i from the plane through its source and an
    edge inside it: of the edges around the planes that its rays hit the one of which the longest part lies inside, or
    else the line in which two of these planes meet.

    Args: rays as `TubeRays`; far whether the source is a direction; extent [m] reach of rays that hit nothing; planes
    as `FacetPlanes`; edges[first_edge[g] : first_edge[g + 1]] (e, 2, 3) [m] around plane g; room (9, 3), landed (4,)
    for work.
    """
    at, source, sides, work = room[:4], room[4], room[5:8], room[8]
    points, k, hit = rays.points[i], rays.directions[i, 3], rays.hit[i]
    t = rays.reach[i, 3] if hit[3] >= 0 else extent
    parallel = far or not rays.flat[i]
    for c in range(3):
        source[c] = points[3, c] - rays.length[i, 3] * k[c]
    for q in range(4):
        landed[q] = planes.number[hit[q]] if hit[q] >= 0 else -1
        for c in range(3):
            # Off a curved mirror rays seem to come from no one point: there they count as parallel, with the section
            # that the tube has where it lands.
            at[q, c] = points[q, c] + (0.0 if rays.flat[i] else t * (rays.directions[i, q, c] - k[c]))
    if not _longest(at, source, k, parallel, landed, first_edge, edges, sides, side, work):
        _meeting_line(at, source, k, parallel, landed, hit, planes.point, planes.normal, k, side, work)
