"""What tubes on their last surface radiate to an end: which of them, with what two-way phase, and how much at most.

The phase is known at six points, corners and edge middles, through which it is quadratic: what the phase integral
(`em.phase_integral`) takes. Where a quadratic misses the centre, or the surface turns too far, the tube is `rough`.
Currents beyond the horizon radiate through the body on which they flow, to where their ray leaves it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.columns import row_numbers
from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.geometry.curved_patches import place_on, rise_off_chord
from raychan.parallel import parallel_for
from raychan.tracing.image_paths import weight
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import MOST_BEND, Refinement, Tubes
from raychan.vectors import distance, length_to, twice_area_across
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_PARALLEL_FROM = 4096  # tubes from which on a second thread pays; not measured
_MOST_MET = 64  # facets met within overlapping bodies before a ray is dropped; not measured

FACING, OBLIQUE, LIT = 0, 1, 2
"""Which tubes radiate: those that face the end; also those whose reflected wave reaches beyond the horizon; all that
are lit."""


@dataclass(frozen=True)
class Phases:
    """Phases of tubes over a leg out [rad]: `six` (n, 6) at corners and edge middles, `bend` (n, 3) of the edges from
    straight, `bound` (n,) [1/m] on what a tube can scatter, `in_phase` the same were it all in phase, `rough` (n,)
    above 1 where a tube bends more than a quadratic phase and one direction of the surface can follow, `length` (n,)
    [m] of the two-way path."""

    six: Floats
    bend: Floats
    bound: Floats
    in_phase: Floats
    rough: Floats
    length: Floats

    def take(self, index: NDArray[np.generic]) -> Phases:
        """Return the phases of the tubes at `index` (mask or numbers)."""
        rows = row_numbers(index)
        return Phases(**{f.name: getattr(self, f.name).take(rows, axis=0) for f in fields(self)})

    @staticmethod
    def join(parts: list[Phases]) -> Phases:
        """Return the phases of several sets of tubes as one."""
        return Phases(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Phases)})


class PhaseTubes(NamedTuple):
    """Columns of `tubes.Tubes` from which phases follow."""

    points: Floats
    k: Floats
    length: Floats
    normals: Floats
    facet: Ints
    bary: Floats
    strength: Floats
    spread: Floats


class PhaseFacets(NamedTuple):
    """Facets: corners and edge curvatures (f, 3, 3) [m]; lossy (f,) those that reflect in part by their material (f,),
    a row of `materials` (kind, eps, thickness, roughness)."""

    vertices: Floats
    edge_curvature: Floats
    lossy: NDArray[np.bool_]
    material: Ints
    materials: tuple[Any, ...]


class PhaseColumns(NamedTuple):
    """The fields of `Phases`, and what `radiates` tells of each tube, to be written."""

    six: Floats
    bend: Floats
    bound: Floats
    in_phase: Floats
    rough: Floats
    length: Floats
    share: Floats
    facing: Bools


def radiating(out: Leg, tubes: Tubes, which: int) -> tuple[Floats, Bools]:
    """Return what share (n,) of their obliquity tubes have towards the end of `out`, and which (n,) face it (see
    `radiating_share`)."""
    share, facing = radiating_share(tubes.points, tubes.k, tubes.normals, out.image, out.far, which)
    return share, facing


def phases_of(geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, rule: Refinement) -> Phases:
    """Return the phases of tubes that came by `leg` over the leg `out`, and what each can scatter there at most."""
    return radiating_phases(geometry, leg, out, tubes, rule, LIT)[0]


def radiating_phases(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, rule: Refinement, which: int
) -> tuple[Phases, Floats, Bools]:
    """Return the phases of tubes that came by `leg` over the leg `out`, what share (n,) of their obliquity they have
    towards its end, and which (n,) face it (see `radiates`); phases of those of no share are not set."""
    n, f = len(tubes), geometry.facets
    bound, in_phase, rough, length, share = np.empty((5, n))
    facing = np.empty(n, bool)
    written = PhaseColumns(np.empty((n, 6)), np.empty((n, 3)), bound, in_phase, rough, length, share, facing)
    given = PhaseTubes(*(getattr(tubes, name) for name in PhaseTubes._fields))
    facets = PhaseFacets(f.vertices, geometry.edge_curvature, geometry.lossy, *geometry.material_columns)
    limits = rule.phase, rule.turn, MOST_BEND

    def some(rows: slice) -> None:
        every = rows.start, rows.stop, which
        phases(given, facets, leg.image, leg.far, out.antenna, rule.wavenumber, limits, every, written)

    parallel_for(n, some, _PARALLEL_FROM)
    return Phases(written.six, written.bend, bound, in_phase, rough, length), share, facing


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _length_at_middle(c, points, k, length, normals, bary, v, b, image, far, middle):  # type: ignore[no-untyped-def]
    """Write the middle of edge c of a tube; return the length there [m]: straight to the curved surface on the first
    facet, later by the cubic Hermite rule on the chord, and along the rays from there to the surface."""
    d = (c + 1) % 3
    if len(bary) == 3:
        w = bary
        x, y, z = 0.5 * (w[c, 0] + w[d, 0]), 0.5 * (w[c, 1] + w[d, 1]), 0.5 * (w[c, 2] + w[d, 2])
        place_on(v, b, x, y, z, middle)
        return length_to(middle, image, far)
    turned, risen = 0.0, 0.0
    rise_off_chord(points[c], points[d], normals[c], normals[d], 0.5, middle)
    for x in range(3):
        turned += (k[c, x] - k[d, x]) * (points[d, x] - points[c, x])
        risen += 0.5 * (k[c, x] + k[d, x]) * middle[x]
        middle[x] += 0.5 * (points[c, x] + points[d, x])
    return 0.5 * (length[c] + length[d]) + 0.125 * turned + risen


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _reflection(j, materials, normal, k, wavenumber):  # type: ignore[no-untyped-def]
    """Return the larger of |R_s|, |R_p| of material j for a ray along k (3,)."""
    kind, eps, thickness, roughness = materials
    cosine = 0.0
    for c in range(3):
        cosine += normal[c] * k[c]
    r_s, r_p, _, _ = coefficients(kind[j], eps[j], thickness[j], roughness[j], abs(cosine), wavenumber)
    return max(abs(r_s), abs(r_p))


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def radiates(point, k, normal, image, far, which):  # type: ignore[no-untyped-def]
    """Return what share of the obliquity cos_i of a tube is left towards an end, 0 where it does not radiate, and
    whether it faces it.

    Args: point, k, normal (3,) of its arriving centre ray; image (3,) [m] of the end, or the direction to it when far;
    which of FACING, OBLIQUE, LIT. The reflected wave's obliquity is (cos_i + r . n) / 2 towards r: it goes on beyond
    the horizon r . n = 0 and ends where it changes its sign (Ufimtsev 2014, ch. 1).
    """
    size, towards, cosine = 0.0, 0.0, 0.0
    for c in range(3):
        d = image[c] if far else image[c] - point[c]
        size += d * d
        towards += d * normal[c]
        cosine -= k[c] * normal[c]
    towards /= math.sqrt(size)
    if towards > 0.0 or which == LIT:
        return 1.0, towards > 0.0
    left = 0.5 * (cosine + towards) if which == OBLIQUE else 0.0
    return (left / cosine if left > 0.0 else 0.0), False


@njit(cache=True, nogil=True, error_model="numpy")
def phases(tubes, facets, image, far, antenna, wavenumber, limits, every, out):  # type: ignore[no-untyped-def]
    """Write the two-way phases of tubes that radiate at corners and edge middles, and bounds on what each may scatter.

    The bound is the amplitude k A cos_i / (2 pi r) of the tube all in phase, over one plus half the span of its phase
    at the corners.

    Args: tubes as `PhaseTubes`, with bary (n, 3, 3) on their first facet, (n, 0, 3) later; facets as `PhaseFacets`;
    image (3,) of the end by which they came, or the direction to it when far; antenna of the leg out (see
    `image_paths.weight`); limits (phase, turn, most_bend) as for `edge_to_cut`; every first of the
    tubes to look at, the one after the last, and which of them radiate; out as `PhaseColumns`.
    """
    _each_phase(tubes, facets, image, far, antenna, wavenumber, limits, every, out, np.empty((2, 3)))


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _each_phase(tubes, facets, image, far, antenna, wavenumber, limits, every, out, room):  # type: ignore[no-untyped-def]
    """Do what `phases` does, with room (2, 3) for work."""
    images, out_far, mirrors, table = antenna
    out_image = images[len(mirrors)]
    phase, turn, most_bend = limits
    corners, ks, lengths, normals, facet, bary, strength, spread = tubes
    vertices, edge_curvature, lossy, material, materials = facets
    all_six, all_bend, bound, in_phase, rough, whole, shares, facing = out
    middle, look = room[0], room[1]
    begin, end, which = every
    for i in range(begin, end):
        shares[i], facing[i] = radiates(corners[i, 3], ks[i, 3], normals[i, 3], out_image, out_far, which)
        if shares[i] == 0.0:
            continue
        points, k, length, f = corners[i], ks[i], lengths[i], facet[i]
        six, bend = all_six[i], all_bend[i]
        low, high = np.inf, -np.inf
        for c in range(3):
            six[c] = wavenumber * (length[c] + length_to(points[c], out_image, out_far))
            low, high = min(low, six[c]), max(high, six[c])
        span = high - low
        whole[i] = (six[0] + six[1] + six[2]) / 3.0 / wavenumber
        for c in range(3):
            shape = vertices[f], edge_curvature[f]
            there = _length_at_middle(c, points, k, length, normals[i], bary[i], *shape, image, far, middle)
            six[3 + c] = wavenumber * (there + length_to(middle, out_image, out_far))
            bend[c] = six[3 + c] - 0.5 * (six[c] + six[(c + 1) % 3])
            low, high = min(low, six[3 + c]), max(high, six[3 + c])
        back = length_to(points[3], out_image, out_far)
        miss = wavenumber * (length[3] + back) - (six[0] + six[1] + six[2]) / 3.0
        miss -= (bend[0] + bend[1] + bend[2]) * (4.0 / 9.0)
        gain = weight(points[3], images, out_far, mirrors, table, look)
        if lossy[f]:
            gain *= _reflection(material[f], materials, normals[i, 3], k[3], wavenumber)
        share = wavenumber / (4.0 * math.pi) * abs(twice_area_across(points, k[3])) * strength[i] * spread[i]
        share /= 1.0 if out_far else back
        in_phase[i] = gain * share
        bound[i] = gain * (share / (1.0 + 0.5 * span))
        off = max(abs(miss) / phase, max(abs(bend[0]), abs(bend[1]), abs(bend[2])) / most_bend)
        for c in range(3):
            off = max(off, distance(normals[i, c], normals[i, 3]) / turn)
        rough[i] = off / (1.0 + 0.5 * (high - low))


@njit(cache=True, nogil=True)
def radiating_share(points, k, normals, image, far, which):  # type: ignore[no-untyped-def]
    """Return share and side (n,) of `radiates` for tubes of points, k, normals (n, 4, 3), the centre last."""
    share, facing = np.empty(len(points)), np.empty(len(points), np.bool_)
    for i in range(len(points)):
        share[i], facing[i] = radiates(points[i, 3], k[i, 3], normals[i, 3], image, far, which)
    return share, facing


def exit_points(geometry: Geometry, leg: Leg, points: Floats, facet: Ints) -> tuple[Floats, Ints]:
    """Return points (n, 3) [m] and facets (n,), moved along the ray to the end to where it leaves the bodies, for rays
    that enter them.

    A closed body does not hide its own currents: in physical optics they radiate in free space (Ufimtsev 2014, ch. 1).
    What stands behind its other side hides them as it hides all else.
    """
    d, length = leg.rays(points)
    inward = np.einsum("ij,ij->i", d, geometry.normal[facet]) > 0.0
    rows = np.flatnonzero(geometry.closed_opaque[facet] & inward)
    points, facet = points.copy(), facet.copy()
    outward, far = -d[rows], np.full(len(rows), np.inf) if leg.far else length[rows]
    skip, start, depth = facet[rows], np.zeros(len(rows)), np.ones(len(rows), int)
    for _ in range(_MOST_MET):
        if not len(rows):
            break
        hit, t = geometry.cast(points[rows], outward, skip, start)
        met = (hit >= 0) & (t < far)
        leaves = np.einsum("ij,ij->i", outward, geometry.normal[hit]) > 0.0
        depth += np.where(met & geometry.closed_opaque[hit], np.where(leaves, -1, 1), 0)
        out = met & (depth <= 0)
        points[rows[out]] += t[out, None] * outward[out]
        facet[rows[out]] = hit[out]
        on = met & ~out
        start = np.where(on, t + geometry.touch, 0.0)[on]
        rows, outward, far, skip, depth = rows[on], outward[on], far[on], skip[on], depth[on]
    return points, facet
