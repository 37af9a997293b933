"""From the hits of rays to tubes on their next surface, and bounds on what a tube may contribute (numba kernels).

Everywhere: points, k, normals (n, 4, 3) [m], length (n, 4) [m] of tubes on their mirror (three corners, the centre);
directions (n, 4, 3) after it; first, normal (f, 3): a point and the normal of each facet.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.geometry.curved_patches import distance_to_patch, weights_at
from raychan.vectors import dot, length_to, twice_area_across

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_SHRINK = 0.98  # of a corner's distance from the centre: corners lie on edges that other facets share; not measured
_BEHIND = -1e-6  # m: a hit no farther behind its tube than this is rounding
_BULGE = -0.05  # m: how far curved patches of coarse meshes bulge through their neighbours, about; not measured
_ONE_PLANE = 1.0 - 1e-9  # cosine between normals from which on they are those of one plane: rounding
_PARALLEL = 0.1
"""Of the way of the ray that was cast beside a corner: where the corner's own ray meets the plane of that facet by so
much sooner or later, the plane lies almost along it, and the corner counts as where the other ray landed (not
measured)."""
_GRAZING_REACH = (
    10.0  # times the centre's distance (and 1 m more) to a corner's hit: beyond, a ray grazes; not measured
)


class IncidentTubes(NamedTuple):
    """Tubes on a mirror with the directions in which they leave it; fields as of `tubes.Tubes`."""

    points: Floats
    directions: Floats
    length: Floats
    normals: Floats
    facet: NDArray[np.int32]
    spread: Floats
    strength: Floats
    flat: Bools
    caustics: NDArray[np.signedinteger]


class LandedTubes(NamedTuple):
    """Tubes on their next surface, to be written; fields as of `tubes.Tubes`."""

    points: Floats
    k: Floats
    length: Floats
    normals: Floats
    spread: Floats
    strength: Floats
    flat: Bools
    caustics: NDArray[np.signedinteger]


class ReflectingFacets(NamedTuple):
    """Facets: corners and corner normals (f, 3, 3), which are curved (f,), the material of each (f,), a row of
    `materials` (kind, eps, thickness, roughness)."""

    vertices: Floats
    normals: Floats
    curved: Bools
    material: NDArray[np.int32]
    materials: tuple[Any, ...]


@njit(cache=True, forceinline=True, uncounted=True)
def _strength(j, materials, cosine, wavenumber):  # type: ignore[no-untyped-def]
    """Return the larger of |R_s|, |R_p| of a material."""
    kind, eps, thickness, roughness = materials
    back_s, back_p, _, _ = coefficients(kind[j], eps[j], thickness[j], roughness[j], cosine, wavenumber)
    return max(abs(back_s), abs(back_p))


@njit(cache=True, forceinline=True, uncounted=True)
def reflect_directions(k, normals, directions):  # type: ignore[no-untyped-def]
    """Write the directions (4, 3) of a tube after reflection at the curved surface."""
    for q in range(4):
        twice = 2.0 * dot(k[q], normals[q])
        for c in range(3):
            directions[q, c] = k[q, c] - twice * normals[q, c]


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def contribution_bounds(tubes, image, far, wavenumber, lossy, material, materials, in_phase, bound, whole):  # type: ignore[no-untyped-def]
    """Write what tubes may scatter straight back, all in phase (`in_phase`) and by how their corners' phases run
    (`bound`) (n,) [1/m], and the two-way length `whole` (n,) [m] (see `contribution_bound`)."""
    surface = lossy, material, materials
    for i in range(len(tubes.facet)):
        in_phase[i], bound[i], whole[i] = contribution_bound(i, tubes, image, far, wavenumber, surface)


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def contribution_bound(i, tubes, image, far, wavenumber, surface):  # type: ignore[no-untyped-def]
    """Return what tube i may scatter straight back, all in phase and by how its corners' phases run [1/m], and the
    two-way length [m]: k A / (4 pi r) times the field there, over one plus half the span of phase. See
    `radiation.phases`, which knows the edges' middles too.

    Args: surface which facets (f,) are lossy, the material of each (f,), and the materials.
    """
    lossy, material, materials = surface
    points, k, facet = tubes.points[i], tubes.k[i], tubes.facet[i]
    low, high, total = np.inf, -np.inf, 0.0
    for c in range(3):
        there = tubes.length[i, c] + length_to(points[c], image, far)
        low, high, total = min(low, there), max(high, there), total + there
    share = wavenumber / (4.0 * math.pi) * abs(twice_area_across(points, k[3])) * tubes.strength[i] * tubes.spread[i]
    if not far:
        share /= length_to(points[3], image, far)
    if lossy[facet]:
        share *= _strength(material[facet], materials, abs(dot(tubes.normals[i, 3], k[3])), wavenumber)
    return share, share / (1.0 + 0.5 * wavenumber * (high - low)), total / 3.0


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def phase_at_hit(points, directions, length, f, reach, first, normal, out, wavenumber, p):  # type: ignore[no-untyped-def]
    """Return by how much the two-way phase runs over a tube where it lands [rad], and the two-way length [m] over
    there.

    Args: f facet that the centre ray meets after reach [m], -1 for none: then the phase does not run and the path ends
    at the mirror; out (image, far) of the leg out; p (3,) room for work.
    """
    image, far = out
    t = reach if f >= 0 else 0.0
    for c in range(3):
        p[c] = points[3, c] + t * directions[3, c]
    whole = length[3] + t + length_to(p, image, far)
    low, high = np.inf, -np.inf
    for q in range(3):
        if f < 0:
            return 0.0, whole
        height = 0.0
        for c in range(3):
            height += (first[f, c] - points[q, c]) * normal[f, c]
        slope = dot(directions[q], normal[f])
        if height * slope <= 0.0:
            # Not all of the tube can land there: how much of it does is not known yet.
            return 0.0, whole
        t = height / slope
        for c in range(3):
            p[c] = points[q, c] + t * directions[q, c]
        phase = wavenumber * (length[q] + t + length_to(p, image, far))
        low, high = min(low, phase), max(high, phase)
    return high - low, whole


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def growth_at_hit(points, directions, f, reach, p):  # type: ignore[no-untyped-def]
    """Return by how much more a tube may scatter where it lands than on its mirror, at least 1: the root of the area
    across the centre's ray there over that before, for of A E the field E falls with the root of A.

    Args: f facet that the centre ray meets after reach [m], -1 for none: then 1; p (3, 3) room for work.
    """
    if f < 0:
        return 1.0
    for q in range(3):
        for c in range(3):
            p[q, c] = points[q, c] + reach * directions[q, c]
    there, before = twice_area_across(p, directions[3]), twice_area_across(points, directions[3])
    return math.sqrt(max(abs(there / before), 1.0)) if before != 0.0 else 1.0


@njit(cache=True, forceinline=True, uncounted=True)
def corner_origin(points, q):  # type: ignore[no-untyped-def]
    """Return from where [m] the ray of corner q of a tube's points (4, 3) is cast."""
    return (
        points[3, 0] + _SHRINK * (points[q, 0] - points[3, 0]),
        points[3, 1] + _SHRINK * (points[q, 1] - points[3, 1]),
        points[3, 2] + _SHRINK * (points[q, 2] - points[3, 2]),
    )


@njit(cache=True, forceinline=True, uncounted=True)
def on_one_surface(h, plane, smooth, normal, least_cosine):  # type: ignore[no-untyped-def]
    """Tell whether all rays land on one plane, or on one smooth patch whose normals there have at least `least_cosine`
    with the centre's.

    Args: h (4,) facets met, -1 for none; plane, smooth (f,) to which facets belong.
    """
    f = h[3]
    one_plane = one_patch = f >= 0
    for q in range(3):
        g = h[q]
        one_plane = one_plane and g >= 0 and plane[g] == plane[f]
        one_patch = one_patch and g >= 0 and smooth[g] == smooth[f] and dot(normal[g], normal[f]) > least_cosine
    return one_plane or one_patch


@njit(cache=True, nogil=True, error_model="numpy")
def resolve_hits(rows, points, directions, hit, cast, one_surface, first, normal, patches):  # type: ignore[no-untyped-def]
    """Return the tubes (m,) of `rows` that land, the facet (m, 4) on whose curved patch each ray lands, and after how
    far (m, 4) [m]. Tubes with a ray that misses or grazes the centre's plane are slivers, and are dropped.

    Where two surfaces run into each other, or a curved patch bulges over its facet, a corner lies behind the surface
    beside it: of a tube all rays of which meet one surface they may land as far behind as that.

    Args: hit (n, 4) facets that the rays cast met, after `cast` (n, 4) [m]; patches vertices, edge curvature (f, 3, 3)
    and curved (f,) of the facets.
    """
    m = len(rows)
    kept, facet, reach = np.empty(m, np.int64), np.empty((m, 4), hit.dtype), np.empty((m, 4))
    count = _each_hit(rows, points, directions, hit, cast, one_surface, first, normal, patches, kept, facet, reach)
    return kept[:count], facet[:count], reach[:count]


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _each_hit(rows, points, directions, hit, cast, one_surface, first, normal, patches, kept, facet, reach):  # type: ignore[no-untyped-def]
    """Write what `resolve_hits` returns, of the first m tubes; return m."""
    vertices, edge_curvature, curved = patches
    count = 0
    for j in range(len(rows)):
        i = rows[j]
        lands = True
        for q in range(3, -1, -1):
            f = hit[i, q] if one_surface[i] else hit[i, 3]
            slope, height = dot(directions[i, q], normal[f]), 0.0
            for c in range(3):
                height += normal[f, c] * (first[f, c] - points[i, q, c])
            t = height / slope if slope != 0.0 else np.inf
            if curved[f] and slope != 0.0:
                t = distance_to_patch(vertices[f], edge_curvature[f], normal[f], points[i, q], directions[i, q], t)
            # Of one plane all corners land on it, however flatly.
            bent = one_surface[i] and dot(normal[f], normal[hit[i, 3]]) < _ONE_PLANE
            if bent and abs(t - cast[i, q]) > _PARALLEL * cast[i, q]:
                t = cast[i, q]
            facet[count, q], reach[count, q] = f, t
            least = _BULGE if one_surface[i] else _BEHIND
            lands &= t > least and t < _GRAZING_REACH * abs(reach[count, 3]) + 1.0
        if lands:
            kept[count] = i
            count += 1
    return count


@njit(cache=True, forceinline=True, uncounted=True)
def _normal_at(v, n, p, out):  # type: ignore[no-untyped-def]
    """Write the unit normal of the curved surface behind p, a point of the plane of a facet (v, n: corners, normals):
    corner normals weighted by barycentric coordinates."""
    none, one, two = weights_at(v, p[0], p[1], p[2])
    none = min(max(none, -0.5), 1.5)
    one, two = min(max(one, -0.5), 1.5), min(max(two, -0.5), 1.5)
    for c in range(3):
        out[c] = none * n[0, c] + one * n[1, c] + two * n[2, c]
    size = math.sqrt(dot(out, out))
    for c in range(3):
        out[c] /= size


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def tubes_at_hits(rows, hit, reach, tubes, facets, far, wavenumber, out):  # type: ignore[no-untyped-def]
    """Write the state of the tubes `rows` (m,) where they land.

    Off plane mirrors the field falls with the length from the image source; off curved ones it thins by the area of the
    tube (conservation of power along a ray tube: Balanis, Advanced Engineering Electromagnetics, 2012, sec. 13.2).

    Args: hit (m, 4) facet on whose plane each ray lands, after reach (m, 4) [m]; tubes as `IncidentTubes`, facets as
    `ReflectingFacets`, out as `LandedTubes`.
    """
    for j in range(len(rows)):
        i = rows[j]
        left = tubes.facet[i]
        cosine = abs(dot(tubes.normals[i, 3], tubes.directions[i, 3]))
        out.strength[j] = tubes.strength[i] * _strength(facets.material[left], facets.materials, cosine, wavenumber)
        for q in range(3, -1, -1):
            out.length[j, q] = tubes.length[i, q] + reach[j, q]
            for c in range(3):
                out.k[j, q, c] = tubes.directions[i, q, c]
                out.points[j, q, c] = tubes.points[i, q, c] + reach[j, q] * tubes.directions[i, q, c]
            f = hit[j, q]
            _normal_at(facets.vertices[f], facets.normals[f], out.points[j, q], out.normals[j, q])
        # The centre says which side is lit; a corner beyond the terminator then shows its back and carries nothing.
        if dot(out.normals[j, 3], tubes.directions[i, 3]) > 0.0:
            for q in range(4):
                for c in range(3):
                    out.normals[j, q, c] = -out.normals[j, q, c]
        before = twice_area_across(tubes.points[i], tubes.directions[i, 3])
        after = twice_area_across(out.points[j], tubes.directions[i, 3])
        out.flat[j] = tubes.flat[i] and not facets.curved[left]
        if out.flat[j]:
            out.spread[j] = 1.0 if far else 1.0 / out.length[j, 3]
        else:
            thinned = tubes.spread[i] * math.sqrt(abs(before / after))
            out.spread[j] = thinned if math.isfinite(thinned) else 0.0
        out.caustics[j] = tubes.caustics[i] + (1 if before * after < 0.0 else 0)
