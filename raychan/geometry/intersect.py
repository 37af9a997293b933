"""Ray casting in float64 around Embree's float32 hits (numba kernels).

Embree names a triangle; where the ray meets its plane is computed here. Each ray is cast with two companions a few
float32 spacings aside, since Embree lets some rays aimed at corners and edges of a mesh through.

Everywhere: origin, direction (n, 3) [m], unit; normal (f, 3), first (f, 3) and vertices (f, 3, 3) of the facets.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.vectors import plane_distance

_FAR = 32.0  # radii of the bounding sphere beyond which an origin is moved towards it; not measured
_GRAZING = 1e-9  # sine of the angle under which a ray runs along a facet: far from the origin rounding is of this size
_BESIDE = 1e-3  # of a facet's length along a ray: what a grazing ray's hit may lie beside it; not measured
_OFFSETS_BESIDE = 64.0  # the same in offsets of the ray, for facets no larger than these; not measured

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class CastRays(NamedTuple):
    """Rays to cast: origin, direction (n, 3); skip (n,) facet that each leaves, -1 for none; start (n,) [m] from which
    hits count."""

    origin: Floats
    direction: Floats
    skip: Ints
    start: Floats


class FacetShapes(NamedTuple):
    """Facets: vertices (f, 3, 3) [m], a point on each (f, 3) [m], unit normals (f, 3)."""

    vertices: Floats
    first: Floats
    normal: Floats


@njit(cache=True, nogil=True)
def plane_distances(facet, origin, direction, first, normal):  # type: ignore[no-untyped-def]
    """Return the distance [m] along each ray to the plane of its facet (n,), inf when parallel."""
    out = np.empty(len(facet))
    for i in range(len(facet)):
        f = facet[i]
        out[i] = plane_distance(normal[f], first[f], origin[i], 0.0, direction[i])
    return out


@njit(cache=True, forceinline=True)
def contains(v, n, x, t, d, margin):  # type: ignore[no-untyped-def]
    """Tell whether x + t d, a point of a facet's plane, lies on the facet, or at most `margin` [m] outside."""
    for a in range(3):
        b = (a + 1) % 3
        sx, sy, sz = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
        px, py, pz = x[0] + t * d[0] - v[a, 0], x[1] + t * d[1] - v[a, 1], x[2] + t * d[2] - v[a, 2]
        depth = px * (n[1] * sz - n[2] * sy) + py * (n[2] * sx - n[0] * sz) + pz * (n[0] * sy - n[1] * sx)
        if depth <= -margin * math.sqrt(sx * sx + sy * sy + sz * sz):
            return False
    return True


@njit(cache=True, nogil=True)
def near_spheres(origin, direction, most, centre, radius):  # type: ignore[no-untyped-def]
    """Return which rays (k,) may meet a sphere before `most` (n,) [m]; spheres: centre (s, 3), radius (s,) [m]."""
    rows = np.empty(len(origin), np.int64)
    count = 0
    for i in range(len(origin)):
        for s in range(len(radius)):
            along, apart, size = 0.0, 0.0, radius[s]
            for c in range(3):
                d = centre[s, c] - origin[i, c]
                along += d * direction[i, c]
                apart += d * d
            aside = apart - along * along
            if along > -size and along - size < most[i] and aside < size * size * (1.0 + 1e-9) + 1e-9 * apart:
                rows[count] = i
                count += 1
                break
    return rows[:count].copy()


@njit(cache=True, nogil=True)
def offset_origins(rays, centre, radius, relative, size):  # type: ignore[no-untyped-def]
    """Return how far ahead (n,) [m] of its origin each ray is cast, and its offset (n,) [m]: a few float32 spacings.

    Args: rays as `CastRays`; centre (3,), radius [m] of a bounding sphere of all facets; relative offset in parts of a
    coordinate; size [m] that a coordinate counts at least.
    """
    origin, direction, skip, starts = rays
    n = len(origin)
    ahead, offset = np.empty(n), np.empty(n)
    for i in range(n):
        x, d, start = origin[i], direction[i], starts[i]
        along = 0.0
        for c in range(3):
            along += (centre[c] - x[c]) * d[c]
        aside = 0.0
        for c in range(3):
            aside += (x[c] + along * d[c] - centre[c]) ** 2
        # Before the bounding sphere nothing is hit: rays from far off are cast from there, where float32 is finer.
        at = along - math.sqrt(max(radius * radius - aside, 0.0))
        at = at if at > max(start, _FAR * radius) else start
        most = 0.0
        for c in range(3):
            most = max(most, abs(x[c] + at * d[c] - centre[c]))
        offset[i] = relative * (size + most)
        ahead[i] = at + (offset[i] if at == start and (skip[i] >= 0 or start > 0.0) else 0.0)
    return ahead, offset


@njit(cache=True, nogil=True)
def companions(todo, origin, direction, ahead, offset, centre, turn):  # type: ignore[no-untyped-def]
    """Return float32 origins and directions (3 m, 3) of the rays `todo` (m,), each with two companions, an offset to
    either side, or a quarter turn from there if `turn`: no plane through the ray holds both pairs."""
    m = len(todo)
    o, d = np.empty((3 * m, 3), np.float32), np.empty((3 * m, 3), np.float32)
    side = np.empty(3)
    for j in range(m):
        i = todo[j]
        x, y, z = direction[i]
        # Not parallel to the direction, and not along the axes, on which edges like to lie.
        side[0] = y * (y - 0.7) - z * (x + 0.3)
        side[1] = z * z - x * (y - 0.7)
        side[2] = x * (x + 0.3) - y * z
        if turn:
            u, v, w = side
            side[0], side[1], side[2] = y * w - z * v, z * u - x * w, x * v - y * u
        for c in range(3):
            at, aside = origin[i, c] + ahead[i] * direction[i, c], offset[i] * side[c]
            o[3 * j, c], d[3 * j, c] = at - centre[c], direction[i, c]
            o[3 * j + 1, c], d[3 * j + 1, c] = at + aside - centre[c], direction[i, c]
            o[3 * j + 2, c], d[3 * j + 2, c] = at - aside - centre[c], direction[i, c]
    return o, d


@njit(cache=True, forceinline=True)
def _on_facet(v, n, x, d, t, offset):  # type: ignore[no-untyped-def]
    """Tell whether the distance t [m] along a ray to a facet's plane is one to the facet: not before it nor beyond.

    A facet seen edge-on, which float32 may hit, has no such distance: the ray runs along its plane but for rounding.
    """
    if not (abs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) > _GRAZING and math.isfinite(t)):
        return False
    low, high = np.inf, -np.inf
    for q in range(3):
        along = 0.0
        for c in range(3):
            along += (v[q, c] - x[c]) * d[c]
        low, high = min(low, along), max(high, along)
    room = _BESIDE * (high - low) + _OFFSETS_BESIDE * offset
    return low - room < t < high + room


@njit(cache=True, forceinline=True)
def _instead_of_grazed(j, hit, x, d, ahead, offset, vertices, first, normal):  # type: ignore[no-untyped-def]
    """Return the facet that counts instead of one that a ray runs along: the nearest that its companions meet, -1 for
    none; -2 if they run along one too."""
    h, old = -1, np.inf
    for s in range(1, 3):
        other = hit[3 * j + s]
        if other < 0:
            continue
        new = plane_distance(normal[other], first[other], x, 0.0, d)
        if other == hit[3 * j] or not _on_facet(vertices[other], normal[other], x, d, new, offset):
            return -2
        if ahead < new < old:
            h, old = other, new
    return h


@njit(cache=True, nogil=True)
def resolve_hits(todo, hit, rays, ahead, offset, shapes, limits, facet, distance):  # type: ignore[no-untyped-def]
    """Write facets and distances of the rays `todo` (m,); return those to be cast again, from farther on or with
    companions farther aside, as `ahead` and `offset` (n,) [m] then say.

    Of rays aimed at corners Embree lets one in some hundreds through, of those aimed at edges one in a million
    (`raychan study stability`, leaks): companions find what they miss.

    Args: hit (3 m,) what each ray and its companions met; rays as `CastRays`, shapes as `FacetShapes`; limits (edge,
    nearest): share of the offset by which a ray may miss what its companion met, and distance [m] closer than which a
    hit is the surface left.
    """
    edge, nearest = limits
    # Taken out of the tuples once: each access counts a reference.
    origin, direction, skip, start = rays
    vertices, first, normal = shapes
    again = np.empty(len(todo), np.int64)
    count = 0
    for j in range(len(todo)):
        i = todo[j]
        x, d = origin[i], direction[i]
        h = hit[3 * j]
        t = plane_distance(normal[h], first[h], x, 0.0, d) if h >= 0 else 0.0
        if h >= 0 and not _on_facet(vertices[h], normal[h], x, d, t, offset[i]):
            h = _instead_of_grazed(j, hit, x, d, ahead[i], offset[i], vertices, first, normal)
            if h == -2:
                offset[i] *= 2.0
                again[count] = i
                count += 1
                continue
        for s in range(1, 3):
            other = hit[3 * j + s]
            if other < 0 or other == h:
                continue
            old = np.inf if h < 0 else plane_distance(normal[h], first[h], x, ahead[i], d)
            new = plane_distance(normal[other], first[other], x, ahead[i], d)
            at = ahead[i] + new
            if (
                0.0 < new < old - offset[i]
                and _on_facet(vertices[other], normal[other], x, d, at, offset[i])
                and contains(vertices[other], normal[other], x, at, d, edge * offset[i])
            ):
                h = other
        if h < 0:
            continue
        t = plane_distance(normal[h], first[h], x, 0.0, d)
        if h != skip[i] and t > start[i] + nearest:
            facet[i], distance[i] = h, t
            continue
        ahead[i] = max(t, ahead[i]) + 2.0 * offset[i]
        offset[i] *= 2.0
        again[count] = i
        count += 1
    return again[:count].copy()
