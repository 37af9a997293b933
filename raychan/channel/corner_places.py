"""Where the corners of footprints lie for the elements of an array.

A tube is one path, or three that leave from the corners of its footprint. The terms of neighbouring tubes cancel at the
corners they share, at every element only if both see the corner at the same place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.fields_along import curved, mirrored, vec
from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.records import REFLECT, Facets, Routes
from raychan.vectors import cross, dot, less

Floats = NDArray[np.float64]

_REFLECT = int(REFLECT)  # a plain number for the kernels
_GRAZING = 1e-6  # cosine below which a ray along a mirror is not followed to it
_SLIVER = 0.01
"""Square of the sine of a footprint's angle below which two slopes tell nothing across it: they are exact to 1e-3."""


def corner_places(routes: Routes, rows: NDArray[np.int64], facets: Facets) -> tuple[NDArray[np.float32], Floats]:
    """Return where the corners of some footprints lie as seen from transmitter and receiver.

    Over plane mirrors that is the image of the corner. Over a curved one it lies along the ray that leaves to the
    corner, as far as this is long: the ray is followed back from the footprint, whose lengths tell its direction.
    Args: rows (r,) of the routes, which have a footprint.
    Returns: by how much (r, 3, 2, 3) [m] each corner lies off the centre, as seen from the transmitter and from the
    receiver; and that across the line of sight over the distance, (r, 3, 2, 3) [rad].
    """
    places, angles = np.empty((len(rows), 3, 2, 3), np.float32), np.empty((len(rows), 3, 2, 3))

    def some(at: slice) -> None:
        _corner_places(
            rows[at], (routes.tx, routes.rx),
            (routes.vertices, routes.normals, routes.kind, routes.facet, routes.scatter, routes.points, routes.lengths),
            (facets.vertices, facets.normals), places[at], angles[at],
        )  # fmt: skip

    parallel_for(len(rows), some)
    return places, angles


@njit(cache=True, forceinline=True)
def _plus(a, s, b):  # type: ignore[no-untyped-def]
    """Return a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@njit(cache=True, nogil=True)
def _corner_places(rows, ends, routes, surface, places, angles):  # type: ignore[no-untyped-def]
    for r in range(len(rows)):
        for end in range(2):
            _seen_from(rows[r], end, ends, routes, surface, places[r], angles[r])


@njit(cache=True)
def _seen_from(i, end, ends, routes, surface, places, angles):  # type: ignore[no-untyped-def]
    """Write places (3, 2, 3) [m] and angles (3, 2, 3) [rad] of route i as seen from one end."""
    vertices, normals, kind, facet, scatter, points, _ = routes
    d, at, step = kind.shape[1], scatter[i], 1 if end == 1 else -1
    centre, here = vec(vertices[i, at]), vec(vertices[i, at])
    # The way from the centre to the end: its length, its first and last stretch, and whether a mirror is curved.
    first, last, far, bent, j = (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, False, at + step
    while True:
        over = j < 0 or j == d or kind[i, j] == 0
        there = vec(ends[end]) if over else vec(vertices[i, j])
        stretch = less(there, here)
        size = max(dot(stretch, stretch) ** 0.5, 1e-300)
        far += size
        last = stretch[0] / size, stretch[1] / size, stretch[2] / size
        if j == at + step:
            first = last
        if over:
            break
        bent |= kind[i, j] == _REFLECT and facet[i, j] >= 0 and curved(surface[1], facet[i, j])
        here, j = there, j + step
    for c in range(3):
        off = less(vec(points[i, c]), centre)
        if bent and end == 0:
            source = _leaving_to(i, c, first, ends, routes, surface)
            off = _plus(source, far, last)
        else:
            for m in range(at + step, j, step):
                if kind[i, m] == _REFLECT:
                    n = vec(normals[i, m])
                    off = _plus(off, -2.0 * dot(off, n), n)
        across = _plus(off, -dot(off, last), last)
        for x in range(3):
            places[c, end, x], angles[c, end, x] = off[x], across[x] / far


@njit(cache=True)
def _leaving_to(i, c, back, ends, routes, surface):  # type: ignore[no-untyped-def]
    """Return the vector [m] from the transmitter along the ray that leaves to corner c of route i, as long as that ray:
    followed back from the footprint, from whose centre the direction `back` leads to the stop before.

    A curved mirror is met at its tangent plane at the vertex, with the normal that those at the corners of its facet
    give there by the linear rule.
    """
    vertices, normals, kind, facet, scatter, _, _ = routes
    here, length, k = _arriving(i, c, back, ends[1], routes)
    for j in range(scatter[i] - 1, -1, -1):
        if kind[i, j] != _REFLECT:
            continue
        n, vertex = vec(normals[i, j]), vec(vertices[i, j])
        steep = dot(k, n)
        if abs(steep) > _GRAZING:
            here = _plus(here, -dot(less(here, vertex), n) / steep, k)
        if facet[i, j] >= 0:
            n = _normal_at(here, vertex, n, surface[0][facet[i, j]], surface[1][facet[i, j]])
        k = _plus(k, -2.0 * dot(k, n), n)
    ray = less(here, vec(ends[0]))
    size = length / max(dot(ray, ray) ** 0.5, 1e-300)
    return ray[0] * size, ray[1] * size, ray[2] * size


@njit(cache=True)
def _arriving(i, c, back, rx, routes):  # type: ignore[no-untyped-def]
    """Return corner c of the footprint of route i, the length from the transmitter to it, and the unit direction in
    which the wave arrives: along the footprint the slope of that length.

    It follows from the total lengths through corners and middles of edges, on which it is quadratic.
    """
    vertices, normals, kind, _, scatter, points, lengths = routes
    image, m = vec(rx), kind.shape[1] - 1
    while m > scatter[i]:
        if kind[i, m] == _REFLECT:
            image = mirrored(image, vec(vertices[i, m]), vec(normals[i, m]))
        m -= 1
    here = vec(points[i, c])
    way = less(here, image)
    length = lengths[i, c] - dot(way, way) ** 0.5
    slopes, edges = (0.0, 0.0), (way, way)
    for e in range(2):
        corner, middle = (c + 1 + e) % 3, 3 + (c if e == 0 else (c + 2) % 3)
        way = less(vec(points[i, corner]), image)
        there = lengths[i, corner] - dot(way, way) ** 0.5
        way = less(vec(points[i, middle]), image)
        slope = 4.0 * (lengths[i, middle] - dot(way, way) ** 0.5) - 3.0 * length - there
        edge = less(vec(points[i, corner]), here)
        slopes, edges = (slopes[1], slope), (edges[1], edge)
    a, b = edges
    n = cross(a, b)
    square = dot(n, n)
    k = -back[0], -back[1], -back[2]
    if square > _SLIVER * dot(a, a) * dot(b, b):
        # The vector in the plane of a and b with these slopes along them, and what it lacks to 1 across.
        flat = _plus((0.0, 0.0, 0.0), slopes[0] / square, cross(b, n))
        flat = _plus(flat, slopes[1] / square, cross(n, a))
        across = (max(1.0 - dot(flat, flat), 0.0) / square) ** 0.5
        k = _plus(flat, across if dot(k, n) > 0.0 else -across, n)
    else:
        long, slope = (a, slopes[0]) if dot(a, a) > dot(b, b) else (b, slopes[1])
        k = _plus(k, (slope - dot(k, long)) / max(dot(long, long), 1e-300), long)
    return here, length, k


@njit(cache=True)
def _normal_at(here, vertex, normal, v, n):  # type: ignore[no-untyped-def]
    """Return the unit normal at a point beside a vertex, where it is `normal`, of a facet with corners v (3, 3) [m] and
    normals n (3, 3) there."""
    a, b = less(v[1], v[0]), less(v[2], v[0])
    flat = cross(a, b)
    square = max(dot(flat, flat), 1e-300)
    off = less(here, vertex)
    s, t = dot(cross(off, b), flat) / square, dot(cross(a, off), flat) / square
    side = 1.0 if dot(normal, vec(n[0])) > 0.0 else -1.0
    turned = _plus(normal, side * s, less(n[1], n[0]))
    turned = _plus(turned, side * t, less(n[2], n[0]))
    size = max(dot(turned, turned) ** 0.5, 1e-300)
    return turned[0] / size, turned[1] / size, turned[2] / size
