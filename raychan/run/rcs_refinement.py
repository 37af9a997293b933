"""Refinement of a cross-section: ever finer launches until two agree, and the error to state of the last."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import COVER, LARGEST_DB, MAX_ERROR_DB, stated_error
from raychan.channel.mesh_error import MeshError, creeping
from raychan.channel.terminator_error import terminator_error
from raychan.run.scattering import reciprocal_scattering
from raychan.tracing.legs import Leg
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.limits import BOUNCES

Complexes = NDArray[np.complex128]

_STEPS = 12  # rules, each of half the phase of the one before: rays run out earlier
_FIRST_EDGE = 0.1  # m: parts of cars that hide others are of this size, and larger tubes may miss them (not measured)
_EDGE_ALONE = 0.3  # m: the same for convex bodies; a larger tube may bend more than its phase integral follows
_RAYS = 200.0  # rays of two launches over a flat body, about, for an area of max_edge squared
_COVER_ALONE = 1.05  # in place of COVER for convex bodies: no launch misses a hidden part (command not noted)
_CURVED = 0.01  # of the value, a radian of a rule's `phase`: error that launches over the same curved facets share
_TERMINATOR = 0.25  # of 1 / k: PO's abrupt terminator on a sphere of any radius, against Mie's series
_TUBES = 30_000  # tubes that a launch may always subdivide, if max_rays allow
_NULL = 1e-4  # of the strongest polarisation, -80 dB: a change below it does not count
_COUNTS = 1e-3  # of the strongest bounce, -60 dB: one below it does not count
_GROWTH = 2.6  # rays of the next rule over those of all before it, about


@dataclass(frozen=True)
class Case:
    """One cross-section to compute: a body, both legs, polarisation (rows V, H of receiver and transmitter), limits."""

    geometry: Geometry
    mesh_error: MeshError
    leg: Leg
    out: Leg
    frequency: float
    bounces: int
    tolerance_db: float
    max_rays: int
    row: int
    col: int

    @property
    def rays(self) -> int:
        """Rays cast so far on the body and on the other surfaces that its mesh may stand for."""
        return self.geometry.rays + self.mesh_error.rays

    def launch(self, geometry: Geometry, rule: Refinement) -> Complexes:
        """Return the scattering amplitudes (bounces, 2, 2) [m] of one launch."""
        return reciprocal_scattering(geometry, self.leg, self.out, self.frequency, self.bounces, rule)


@dataclass(frozen=True)
class Value:
    """A cross-section: sigma [m^2], error [dB] (NaN: unknown), rays cast, most bounces that counted, change [dB] by a
    further bounce, scattering matrix (2, 2) [m]."""

    sigma: float
    error_db: float
    rays: int
    bounces: int
    further_db: float
    matrix: Complexes


@dataclass(frozen=True)
class _Launches:
    """What the launches of one case gave: the amplitude by the first and by the last, how far off the last may be, and
    the last's amplitudes by bounces, of the case's polarisation and of all."""

    first: complex
    value: complex
    off: float
    by_bounce: Complexes
    matrix: Complexes


def refined(case: Case) -> Value:
    """Return the cross-section of a case, refined until the last two launches agree or rays run out."""
    geometry = case.geometry
    rays, ring = case.rays, _terminator(case)
    rules = [
        replace(step, max_tubes=_most_tubes(i, case.max_rays), max_rays=case.max_rays)
        for i, step in enumerate(refinements(geometry, case.frequency, max_rays=case.max_rays))
    ]
    found = _launched(case, rules, ring)
    first, value, off = found.first, found.value, found.off

    def other(mesh: Geometry) -> complex:
        return complex(case.launch(mesh, rules[0])[:, case.row, case.col].sum())

    # Errors that refinement does not reduce: what the mesh leaves open, and waves that creep around the body. Launches
    # and normals err at the same specular points, at worst in phase; creeping waves and other surfaces are of unrelated
    # phase and add in squares.
    around, share = creeping(case.mesh_error.rounded or geometry, rules[0].wavenumber)
    sure = value != 0.0 and stated_error(value, off, 1.0) <= LARGEST_DB
    # Where the launches do not agree, other surfaces of the mesh add nothing to know.
    off += case.mesh_error.facets(first, value, other) * abs(value) if sure else 0.0
    error_db = stated_error(value, math.hypot(off, max(around if ring else 0.0, share * abs(value))), 1.0)
    # The difference between two surfaces is a figure, however large.
    folds_db = case.mesh_error.edges_db(first, value, other) if sure else 0.0
    by_bounce = found.by_bounce
    counted = np.flatnonzero(np.abs(by_bounce) > _COUNTS * np.abs(by_bounce).max(initial=0.0))
    # A level of zero has no error in dB.
    known = min(math.hypot(error_db, folds_db), MAX_ERROR_DB) if sure and error_db <= LARGEST_DB else np.nan
    most, further = int(counted.max(initial=-1)) + 1, _further(case, rules[0], by_bounce)
    return Value(4.0 * np.pi * abs(value) ** 2, known, case.rays - rays, most, further, found.matrix)


def _terminator(case: Case) -> float:
    """Return the error [m] due to the terminator of a smooth body, a ring all of which may return in phase; 0 for
    bodies with edges."""
    geometry = case.geometry
    if not geometry.convex_alone or not geometry.curved.any() or geometry.smooth.any():
        return 0.0
    k = 2.0 * np.pi * case.frequency / C0
    area, ends = float(geometry.area.sum()), (case.leg.end, case.out.end)
    return _TERMINATOR / k + (terminator_error(area, *ends, k, case.row, case.col) if case.out != case.leg else 0.0)


def _launched(case: Case, rules: list[Refinement], ring: float) -> _Launches:
    """Launch by finer and finer rules until two launches in a row agree, or rays run out."""
    geometry, max_rays = case.geometry, case.max_rays
    before, first = None, 0j
    rays, off, value, by_bounce = case.rays, np.inf, 0j, np.zeros(case.bounces, complex)
    curved = _CURVED if geometry.curved.any() else 0.0
    cover = _COVER_ALONE if geometry.convex_alone else COVER
    # Long tubes may err alike in two launches.
    cover *= np.sqrt(_stretch(geometry, max_rays))
    for rule in rules:
        coarse, so_far = geometry.uncut, geometry.rays
        s = case.launch(geometry, rule)
        by_bounce = s[:, case.row, case.col]
        value = complex(by_bounce.sum())
        if geometry.uncut > coarse and geometry.rays - so_far > max_rays:
            # Rays ran out before it was known what hides what: the error is unknown.
            off = np.inf
            break
        if before is None:
            first = value
        else:
            change = abs(value - before)
            shared = curved * rule.phase * abs(value) + ring + _off_by_merging(geometry, by_bounce)
            off = cover * (change + shared)
            spent = (case.rays - rays) * _GROWTH > max_rays
            # In a null of this polarisation nothing is left to find.
            null = change < _NULL * np.abs(s.sum(axis=0)).max()
            agreed = stated_error(value, off, 1.0) <= case.tolerance_db or null
            # Tubes that only max_tubes kept from being subdivided may err alike in two launches.
            if spent or (geometry.uncut == coarse and agreed):
                break
        before = value
    return _Launches(first, value, off, by_bounce, s.sum(axis=0))


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
            relative=0.03 * fine,
            max_edge=longest,
            jitter=0.0 if i % 2 == 0 else 0.13,
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


def _further(case: Case, rule: Refinement, by_bounce: Complexes) -> float:
    """Return the change [dB] of the level if one more bounce brought as much as the last of those given.

    Where the last one brings nothing it tells nothing of the next: seen along its axis, a corner of three faces returns
    by three bounces and not by two. There a launch by the given rule, with one more bounce, tells it."""
    if case.geometry.convex_alone:
        return 0.0
    whole, last = abs(by_bounce.sum()), abs(by_bounce[-1])
    if len(by_bounce) == 1 or not whole:
        return np.nan
    if last <= _COUNTS * np.abs(by_bounce).max() and case.bounces < BOUNCES.high:
        last = abs(replace(case, bounces=case.bounces + 1).launch(case.geometry, rule)[-1, case.row, case.col])
    return float(20.0 * np.log10(1.0 + last / whole))


def _most_tubes(step: int, max_rays: int) -> int:
    """Return how many tubes a launch may subdivide: the first two a quarter of what later ones may, so that a body each
    of whose tubes needs many rays does not spend max_rays at once."""
    later = max(1000, max_rays // 4)
    return later if step > 1 else max(later // 4, min(later, _TUBES))
