"""A cross-section that converges: coarse launches first, then finer where it is open, and the error to state.

The first two launches trace the whole body. Their change tells which sources of tubes (first facet, number of bounces)
leave the sum open; these are traced again, each time finer or on another lattice.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import COVER, stated_error
from raychan.channel.mesh_error import creeping, has_edges
from raychan.channel.terminator_error import TERMINATOR, terminator_error
from raychan.run.cross_section.case import COUNTS, Case, Value, further_db
from raychan.run.cross_section.doubt import Doubt
from raychan.run.cross_section.edges import edges_db
from raychan.run.cross_section.scattering import BodyLaunch, BySource, rounding
from raychan.run.cross_section.source_sums import SourceSums
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.geometry import Geometry

Complexes = NDArray[np.complex128]

_FAN = 0.05  # rad by which a tube may spread the rays that a curved surface reflects: trades rays for the bias of fans
# that meet gaps (bodies of primitives, a person and a traffic light, 4 views; command not noted)
_WEAKER = 0.7  # of the last rule, a rule from the third on: contribution of tubes too weak to be cut. At 0.5 parts that
# hide each other from curved mirrors take three to six times the rays at the seventh rule and are off about as much (a
# person, seed 7702, view 2, each of four sources by three lattices; command not kept)
_STEPS = 12  # rules, each of half the phase of the one before: rays run out earlier
_FIRST_EDGE = 0.1  # m: parts of cars that hide others are of this size, and larger tubes may miss them (not measured)
_EDGE_ALONE = 0.3  # m: the same for convex bodies; a larger tube may bend more than its phase integral follows
_RAYS = 200.0  # rays of two launches over a flat body, about, for an area of max_edge squared
_COVER_ALONE = 1.05  # in place of COVER for convex bodies: no launch misses a hidden part (command not noted)
_CURVED = 0.01  # of the value, a radian of a rule's `phase`: error that launches over the same curved facets share
_TUBES = 30_000  # tubes that a launch may always subdivide, if max_rays allow
_NULL = 1e-4  # of the strongest polarisation, -80 dB: a change below it does not count
_ROUNDING = 16.0  # times what rounding may leave: below it is none. Amplitudes that are zero (the other polarisation,
# edges on, nulls; plates, boxes, corners, cylinder, sphere; 1 and 77 GHz; no command) are 0.04 times it at most
_LEFT = 0.3  # of the tolerance: what the last changes of sources that are not traced again may add up to; not measured
_HALF = 0.5  # of the tolerance: launches within it are refined no further for what the mesh leaves open; not measured
_OVER = 2.0  # times the rays left: what a launch that was expected to cost less may cast; not measured
_JITTER = 0.2  # of an edge: how far cuts may lie off its middle, for lattices of their own; not measured
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)  # spreads numbered lattices evenly
_GROWTH = 2.6  # rays of the next rule over those of all before it, about


def refined(case: Case) -> Value:
    """Return the cross-section of a case, refined until it is within the tolerance or rays run out."""
    rays = case.rays
    rules = [
        replace(step, max_tubes=_most_tubes(i, case.max_rays), max_rays=case.max_rays)
        for i, step in enumerate(refinements(case.geometry, case.frequency, max_rays=case.max_rays))
    ]
    sums, error_db, numerical_db = _launched(case, rules)
    amplitudes = sums.sums.by_bounce(case.bounces)
    by_bounce = amplitudes[:, case.row, case.col]
    counted = np.flatnonzero(np.abs(by_bounce) > COUNTS * np.abs(by_bounce).max(initial=0.0))
    most, further = int(counted.max(initial=-1)) + 1, further_db(case, rules[0], by_bounce)
    matrix = amplitudes.sum(axis=0)
    left = rounding(case.geometry, (case.leg, case.out), case.frequency, sums.sums.amplitude)
    if abs(sums.value) <= _ROUNDING * left:
        matrix[case.row, case.col], error_db, numerical_db = 0.0, np.nan, np.nan
    value, rays = complex(matrix[case.row, case.col]), case.rays - rays
    edges = edges_db(case.geometry, (case.leg, case.out), rules[0].wavenumber, value, (case.col, case.row))
    return Value(4.0 * np.pi * abs(value) ** 2, error_db, numerical_db, rays, most, further, edges, matrix)


def _terminator(case: Case) -> float:
    """Return the error [m] due to the terminator of a smooth body, a ring all of which may return in phase; 0 for
    bodies with edges."""
    geometry = case.geometry
    if not geometry.convex_alone or not geometry.curved.any() or has_edges(geometry):
        return 0.0
    k = 2.0 * np.pi * case.frequency / C0
    area, ends = float(geometry.area.sum()), (case.leg.end, case.out.end)
    return TERMINATOR / k + (terminator_error(area, *ends, k, case.row, case.col) if case.out != case.leg else 0.0)


def _launched(case: Case, rules: list[Refinement]) -> tuple[SourceSums, float, float]:
    """Launch the whole body twice, once more the sources that bring most, then those that leave the sum open, until it
    is within the tolerance or rays run out; return the sums, the error to state [dB], and what launches leave of it."""
    launch = BodyLaunch(case.geometry, (case.leg, case.out), case.frequency, case.bounces)
    start, within = case.geometry.rays, 1.0 - 10.0 ** (-case.tolerance_db / 20.0)
    sums, first, known = _whole(case, launch, rules)
    doubt, off = _doubt(case, rules[0], first), np.inf
    while known:
        off = _off(case, sums, rules)
        left, leave = case.max_rays - (case.geometry.rays - start), _LEFT * within * abs(sums.value)
        if left <= 0:
            break
        # No launch over a convex body misses a hidden part.
        rows = sums.to_confirm(leave, 0 if case.geometry.convex_alone else left)
        if not len(rows):
            if _agreed(case, sums, doubt, off):
                break
            rows = sums.to_refine(_cover(case), leave, left, len(rules))
        if not len(rows):
            break
        coarse = case.geometry.uncut
        parts = [
            launch.again(replace(rules[i], jitter=_jitter(n), max_rays=_OVER * left), source)
            for i, n, source in sums.groups(rows)
        ]
        if case.geometry.uncut > coarse:
            # Rays ran out before it was known what hides what.
            break
        sums = sums.joined(rows, parts)
    return sums, doubt.error_db(sums.value, off), doubt.numerical_db(sums.value, off)


def _doubt(case: Case, rule: Refinement, first: complex) -> Doubt:
    """Return the errors that refinement does not reduce; first the amplitude by a launch of the rule."""

    def other(mesh: Geometry) -> complex:
        return complex(case.launch(mesh, rule)[:, case.row, case.col].sum())

    waves = creeping(case.mesh_error.rounded or case.geometry, rule.wavenumber)
    return Doubt(case.mesh_error, other, first, _cover(case) * _terminator(case), waves)


def _jitter(launch: int) -> float:
    """Return how far the cuts of a launch lie off the middle of edges: no two launches share a lattice."""
    return _JITTER * (launch * _GOLDEN % 1.0)


def _agreed(case: Case, sums: SourceSums, doubt: Doubt, off: float) -> bool:
    """Tell whether the sum is within the tolerance, or as near as refinement brings it."""
    value = sums.value
    # In a null of this polarisation nothing is left to find.
    if abs(sums.doubt_of.sum()) < _NULL * np.abs(sums.sums.amplitude.sum(axis=0)).max():
        return True
    launches_db = stated_error(value, off, 1.0)
    if launches_db > case.tolerance_db:
        return False
    if doubt.error_db(value, off) <= case.tolerance_db or not doubt.error_db(value, 0.0) <= case.tolerance_db:
        return True
    return launches_db <= _HALF * case.tolerance_db


def _off(case: Case, sums: SourceSums, rules: list[Refinement]) -> float:
    """Return how far [m] the sum may be off by the tubes of launches."""
    curved = _CURVED if case.geometry.curved.any() else 0.0
    coarsest = rules[int(sums.rule.min(initial=len(rules) - 1))].phase
    merged = _off_by_merging(case.geometry, sums.sums.by_bounce(case.bounces)[:, case.row, case.col])
    cover = _cover(case)
    return float(sums.off(cover) + cover * (curved * coarsest * abs(sums.value) + merged))


def _cover(case: Case) -> float:
    """Return the factor from the change between launches to the error to state."""
    cover = _COVER_ALONE if case.geometry.convex_alone else COVER
    # Long tubes may err alike in two launches.
    return float(cover * np.sqrt(_stretch(case.geometry, case.max_rays)))


def _whole(case: Case, launch: BodyLaunch, rules: list[Refinement]) -> tuple[SourceSums, complex, bool]:
    """Launch the whole body twice, and again while tubes are coarser than asked for; return the sums of the last two,
    the amplitude by the first, and whether rays sufficed to know what hides what."""
    geometry, start = case.geometry, case.geometry.rays
    before: BySource | None = None
    first = 0j
    for i, rule in enumerate(rules):
        coarse, so_far = geometry.uncut, geometry.rays
        found = launch.whole(rule)
        sums = SourceSums.of(before or found, found, (case.row, case.col), i)
        first = first if i else sums.value
        if geometry.uncut > coarse and geometry.rays - so_far > case.max_rays:
            return sums, first, False
        spent = (geometry.rays - start) * _GROWTH > case.max_rays
        # Tubes that only max_tubes kept from being subdivided may err alike in two launches.
        if i and (spent or geometry.uncut == coarse):
            break
        before = found
    return sums, first, True


def _off_by_merging(geometry: Geometry, by_bounce: Complexes) -> float:
    """Return the error [m] of an amplitude, given by bounces, due to facets that were merged."""
    if geometry.merged is None:
        return 0.0
    return float(geometry.merged.share(np.arange(1, len(by_bounce) + 1)) @ np.abs(by_bounce))


def refinements(
    geometry: Geometry, frequency: float, steps: int = _STEPS, max_rays: float = np.inf
) -> Iterator[Refinement]:
    """Yield ever finer rules for subdividing tubes.

    The lattice of cuts differs from one rule to the next, so that two launches do not share their errors, and every
    rule subdivides most facets again. The first two need about max_rays at most, where curvature and edges allow.
    """
    edge = _first_edge(geometry) * _stretch(geometry, max_rays)
    own = _typical_edge(geometry)
    for i in range(steps):
        fine = 2.0**-i
        longest = edge if i == 0 else min(edge, 1.35 * own) * 0.6**i
        yield Refinement(
            wavenumber=2.0 * np.pi * frequency / C0,
            phase=0.2 * fine,
            turn=0.3 * fine,
            relative=0.03 * max(fine, 0.5 * _WEAKER ** (i - 1)),
            max_edge=longest,
            jitter=0.0 if i % 2 == 0 else 0.13,
            fan=max(_FAN, 4.0 * _FAN * fine),
            patch=1.0,
        )


def _first_edge(geometry: Geometry) -> float:
    """Return the longest tube edge [m] of the first launch."""
    return min(_EDGE_ALONE if geometry.convex_alone else _FIRST_EDGE, geometry.extent / 4.0)


def _stretch(geometry: Geometry, max_rays: float) -> float:
    """Return the factor by which the first tubes are longer than `_first_edge`, so that max_rays suffice."""
    edge = _first_edge(geometry)
    return max(1.0, float(np.sqrt(_RAYS * geometry.area.sum() / max_rays)) / edge) if edge > 0.0 else 1.0


def _typical_edge(geometry: Geometry) -> float:
    """Return the area-weighted median of the facets' longest edges [m]."""
    v = geometry.facets.vertices
    longest = np.linalg.norm(np.roll(v, -1, axis=1) - v, axis=2).max(axis=1)
    order = np.argsort(longest)
    covered = np.cumsum(geometry.area[order])
    return float(longest[order][np.searchsorted(covered, 0.5 * covered[-1])])


def _most_tubes(step: int, max_rays: int) -> int:
    """Return how many tubes a launch may subdivide: the first two a quarter of what later ones may, so that a body each
    of whose tubes needs many rays does not spend max_rays at once."""
    later = max(1000, max_rays // 4)
    return later if step > 1 else max(later // 4, min(later, _TUBES))
