"""Ray casting in float64 around Embree's float32 hits (numba kernels).

Embree names a triangle; where the ray meets its plane is computed here. Each ray is cast with two companions a few
float32 spacings aside: of rays aimed at corners Embree lets one in some hundreds through, of those aimed at edges one
in a million (`raychan study stability`, leaks), and companions find what they miss.

Everywhere: origin, direction (n, 3) [m], unit; normal (f, 3), first (f, 3) and vertices (f, 3, 3) of the facets.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.embree_packet import first_triangles, put_ray
from raychan.vectors import plane_distance

_FAR = 32.0  # radii of the bounding sphere beyond which an origin is moved towards it; not measured
_GRAZING = 1e-9  # sine of the angle under which a ray runs along a facet: far from the origin rounding is of this size
_BESIDE = 1e-3  # of a facet's length along a ray: what a grazing ray's hit may lie beside it; not measured
_OFFSETS_BESIDE = 64.0  # the same in offsets of the ray, for facets no larger than these; not measured
OFFSET = 2e-6  # of a coordinate: a few float32 spacings
EDGE = 0.15  # of the offset: what float32 may move a ray aside; not measured
_TRIES = 8  # casts of a ray whose hit is its own facet or one that it runs along

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class CastRays(NamedTuple):
    """Rays to cast: origin, direction (n, 3); skip (n,) facet that each leaves, -1 for none; start (n,; empty: 0) [m]
    from which hits count."""

    origin: Floats
    direction: Floats
    skip: Ints
    start: Floats


class FacetShapes(NamedTuple):
    """Facets: vertices (f, 3, 3) [m], a point on each (f, 3) [m], unit normals (f, 3); size [m] that a coordinate
    counts at least; nearest [m]: a closer hit is the surface that the ray leaves."""

    vertices: Floats
    first: Floats
    normal: Floats
    size: float
    nearest: float


class FacetGroups(NamedTuple):
    """Groups of facets that rays are cast at, one after the other.

    Fields: intersect address of rtcIntersect4; scene (g,) address of Embree's scene of each; facet[first_facet[j] :
    first_facet[j + 1]] number of each triangle; spheres about a group j > 0, outside of which no ray is cast:
    [first_sphere[j] : first_sphere[j + 1]] of sphere_centre (s, 3), sphere_radius (s,) [m]; behind (g,) [m] by which a
    hit must lie before those of earlier groups; centre (g, 3), radius (g,) [m] of a bounding sphere; middle (g, 3) [m]
    from which Embree's coordinates count, in a frame of which turned says whether it is not the world's: matrix (g, 3,
    3), shift (g, 3) [m] lead there.
    """

    intersect: np.uintp
    scene: NDArray[np.uintp]
    facet: Ints
    first_facet: NDArray[np.int64]
    sphere_centre: Floats
    sphere_radius: Floats
    first_sphere: NDArray[np.int64]
    behind: Floats
    centre: Floats
    radius: Floats
    middle: Floats
    turned: NDArray[np.bool_]
    matrix: Floats
    shift: Floats


@njit(cache=True, nogil=True)
def plane_distances(facet, origin, direction, first, normal):  # type: ignore[no-untyped-def]
    """Return the distance [m] along each ray to the plane of its facet (n,), inf when parallel."""
    out = np.empty(len(facet))
    for i in range(len(facet)):
        f = facet[i]
        out[i] = plane_distance(normal[f], first[f], origin[i], 0.0, direction[i])
    return out


@njit(cache=True, forceinline=True, uncounted=True)
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


@njit(cache=True, forceinline=True, uncounted=True)
def _is_near(x, d, most, begin, end, centre, radius):  # type: ignore[no-untyped-def]
    """Tell whether a ray may meet one of the spheres from `begin` to `end` before `most` [m]; centre (s, 3), radius
    (s,) [m]."""
    for s in range(begin, end):
        along, apart, size = 0.0, 0.0, radius[s]
        for c in range(3):
            to = centre[s, c] - x[c]
            along += to * d[c]
            apart += to * to
        aside = apart - along * along
        if along > -size and along - size < most and aside < size * size * (1.0 + 1e-9) + 1e-9 * apart:
            return True
    return False


@njit(cache=True, forceinline=True, uncounted=True)
def _ahead(x, d, leaves, start, centre, radius, size):  # type: ignore[no-untyped-def]
    """Return how far ahead [m] of its origin a ray is cast, and its offset [m]: a few float32 spacings.

    Args: leaves whether it leaves a facet; start [m] from which hits count; centre (3,), radius [m] of a bounding
    sphere; size [m] that a coordinate counts at least.
    """
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
    offset = OFFSET * (size + most)
    return at + (offset if at == start and (leaves or start > 0.0) else 0.0), offset


@njit(cache=True, forceinline=True, uncounted=True)
def _put_companions(x, d, ahead, offset, middle, turn, floats, words):  # type: ignore[no-untyped-def]
    """Write a ray and its two companions into Embree's packet: an offset [m] to either side, or a quarter turn from
    there if `turn`; no plane through the ray holds both pairs. Coordinates count from the `middle` (3,) [m]."""
    # Not parallel to the direction, and not along the axes, on which edges like to lie.
    u = d[1] * (d[1] - 0.7) - d[2] * (d[0] + 0.3)
    v = d[2] * d[2] - d[0] * (d[1] - 0.7)
    w = d[0] * (d[0] + 0.3) - d[1] * d[2]
    if turn:
        u, v, w = d[1] * w - d[2] * v, d[2] * u - d[0] * w, d[0] * v - d[1] * u
    p, q, r = x[0] + ahead * d[0], x[1] + ahead * d[1], x[2] + ahead * d[2]
    u, v, w = offset * u, offset * v, offset * w
    put_ray(floats, words, 0, p - middle[0], q - middle[1], r - middle[2], d)
    put_ray(floats, words, 1, p + u - middle[0], q + v - middle[1], r + w - middle[2], d)
    put_ray(floats, words, 2, p - u - middle[0], q - v - middle[1], r - w - middle[2], d)


@njit(cache=True, forceinline=True, uncounted=True)
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


@njit(cache=True, forceinline=True, uncounted=True)
def _instead_of_grazed(h, one, other, x, d, ahead, offset, vertices, first, normal):  # type: ignore[no-untyped-def]
    """Return the facet that counts instead of h, which a ray runs along: the nearest that its companions meet, `one`
    and `other`, -1 for none; -2 if they run along one too."""
    found, old = -1, np.inf
    for a in (one, other):
        if a < 0:
            continue
        new = plane_distance(normal[a], first[a], x, 0.0, d)
        if a == h or not _on_facet(vertices[a], normal[a], x, d, new, offset):
            return -2
        if ahead < new < old:
            found, old = a, new
    return found


@njit(cache=True, forceinline=True, uncounted=True)
def _nearer(h, one, other, x, d, ahead, offset, vertices, first, normal):  # type: ignore[no-untyped-def]
    """Return the facet h that a ray meets, -1 for none, or what a companion meets, `one` or `other`, where that is
    nearer and the ray meets it too."""
    for a in (one, other):
        if a < 0 or a == h:
            continue
        old = np.inf if h < 0 else plane_distance(normal[h], first[h], x, ahead, d)
        new = plane_distance(normal[a], first[a], x, ahead, d)
        at = ahead + new
        if (
            0.0 < new < old - offset
            and _on_facet(vertices[a], normal[a], x, d, at, offset)
            and contains(vertices[a], normal[a], x, at, d, EDGE * offset)
        ):
            h = a
    return h


@njit(cache=True, forceinline=True, uncounted=True)
def first_in_group(j, x, d, skip, start, groups, shapes, floats, words):  # type: ignore[no-untyped-def]
    """Return the first facet of group j that a ray meets, -1 for none, its distance [m], and how often it was cast.

    Args: origin x (3,) [m], direction d (3,), skip and start as in `CastRays`; groups as `FacetGroups`, shapes as
    `FacetShapes`; floats, words Embree's packet.
    """
    vertices, first, normal = shapes.vertices, shapes.first, shapes.normal
    ahead, offset = _ahead(x, d, skip >= 0, start, groups.centre[j], groups.radius[j], shapes.size)
    y, e = x, d
    if groups.turned[j]:
        y, e = _turned(groups.matrix[j], groups.shift[j], x, 1.0), _turned(groups.matrix[j], groups.shift[j], d, 0.0)
    begin = groups.first_facet[j]
    for attempt in range(_TRIES):
        _put_companions(y, e, ahead, offset, groups.middle[j], attempt % 2 == 1, floats, words)
        h, one, other = first_triangles(groups.intersect, groups.scene[j], words)
        h = groups.facet[begin + h] if h >= 0 else -1
        one = groups.facet[begin + one] if one >= 0 else -1
        other = groups.facet[begin + other] if other >= 0 else -1
        t = plane_distance(normal[h], first[h], x, 0.0, d) if h >= 0 else 0.0
        if h >= 0 and not _on_facet(vertices[h], normal[h], x, d, t, offset):
            h = _instead_of_grazed(h, one, other, x, d, ahead, offset, vertices, first, normal)
            if h == -2:
                offset *= 2.0
                continue
        h = _nearer(h, one, other, x, d, ahead, offset, vertices, first, normal)
        if h < 0:
            return -1, np.inf, attempt + 1
        t = plane_distance(normal[h], first[h], x, 0.0, d)
        if h != skip and t > start + shapes.nearest:
            return h, t, attempt + 1
        # It left from here, or this lies before the start: cast again from farther on.
        ahead = max(t, ahead) + 2.0 * offset
        offset *= 2.0
    return -1, np.inf, _TRIES


@njit(cache=True, forceinline=True, uncounted=True)
def _turned(m, shift, x, by):  # type: ignore[no-untyped-def]
    """Return matrix m (3, 3) times x (3,), plus `by` times shift (3,)."""
    return (
        m[0, 0] * x[0] + m[0, 1] * x[1] + m[0, 2] * x[2] + by * shift[0],
        m[1, 0] * x[0] + m[1, 1] * x[1] + m[1, 2] * x[2] + by * shift[1],
        m[2, 0] * x[0] + m[2, 1] * x[1] + m[2, 2] * x[2] + by * shift[2],
    )


@njit(cache=True, forceinline=True, uncounted=True)
def first_hit(x, d, skip, start, groups, shapes, floats, words):  # type: ignore[no-untyped-def]
    """Return the first facet that a ray meets, -1 for none, its distance [m], and how often it was cast: once with its
    companions, however many groups it is cast at, and more where its hits do not count. Args as `first_in_group`."""
    facet, distance, casts = -1, np.inf, 0
    for j in range(len(groups.scene)):
        begin, end = groups.first_sphere[j], groups.first_sphere[j + 1]
        if j > 0 and not _is_near(x, d, distance, begin, end, groups.sphere_centre, groups.sphere_radius):
            continue
        h, t, tries = first_in_group(j, x, d, skip, start, groups, shapes, floats, words)
        casts += tries if j == 0 else 0
        behind = groups.behind[j]
        # Of two in the same place the first counts, whichever group it is of.
        if h >= 0 and (t + behind < distance or (t == distance and h < facet and behind == 0.0)):
            facet, distance = h, t
    return facet, distance, casts
