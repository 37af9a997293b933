"""The launch of a preview: each body is seen directly and over the ground, and scatters once.

Seed facets are pruned by their bounds before anything is traced, strong ones are clipped at the shadow edges on them,
weak ones seen or hidden by their centres, and nothing bounces from body to body. What that leaves out is said in
`run.preview`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.patch_cuts import edge_to_cut, halved
from raychan.parallel import run_pair
from raychan.poses import sizes
from raychan.radar.beam_table import Beam
from raychan.radar.radar import Radar
from raychan.records import MIRROR, SCATTERER, Points, Routes
from raychan.run.preview.bounds import NEAR, facet_bounds
from raychan.run.preview.rates import RateClasses
from raychan.tracing.contributions import SHARE, Contributions, amplitudes
from raychan.tracing.culling import seed_facets
from raychan.tracing.launch import across_gain_ends, clip_where_gains_end, write_leg
from raychan.tracing.legs import Leg, View, reachable
from raychan.tracing.mirrors import Mirror
from raychan.tracing.radiation import FACING, Phases, phases_of, radiating
from raychan.tracing.routes import routes_of
from raychan.tracing.settings import PruneRule
from raychan.tracing.solver import Batch, Launch
from raychan.tracing.stats import Stats
from raychan.tracing.subdivide import subdivide
from raychan.tracing.tubes import CENTRE, MOST_BEND, Refinement, Tubes, launch_tubes
from raychan.tracing.visibility import centre_visibility, tube_visibility
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Complexes = NDArray[np.complex128]
Rows = NDArray[np.intp]
S = TypeVar("S")
T = TypeVar("T")

# By how much what is pruned is counted: less traces fewer tubes, more loses less. Levels of direct echoes beside fine
# runs of the living street, and CPU of a frame of the urban street: seeds by 0.6, 0.63 dB (rms) and 0.18 s; by 1, 0.48
# dB and 0.19 s; by 2, 0.44 dB and 0.22 s. Seen ones by 1: a weak echo of the urban street is off by 5 dB, by 2 by 3.3.
# Amplitudes by 1: a lone sphere is off by 0.6 dB, by 3 by 0.2 (all: commands not kept).
_SEEDS = 1.0  # facets, by their bounds, before it is known whether they are seen
_SEEN = 2.0  # tubes that are seen, by their bounds
_SURE = 3.0  # tubes that are seen, by their amplitudes
_CLASSES, _A_CLASS = 64, 4.0  # of sizes below the threshold, and of these to a factor of two; not measured
# Tubes whose bound is stronger than so much of the floor, hidden ones than so much, are clipped where they are seen in
# part, so often at most: with 12 a plate behind 24 slats is 5.8 dB too weak. Of 281 direct echoes of 120 scenes of
# bodies behind racks, benches, rails, posts and ends of walls 2 are beyond what is stated, 1 is missing, 3 are
# invented; with strong ones from 0.1 on 1, 1 and 3, for 25 % more CPU of a frame of the urban street (no commands).
_STRONG, _HIDDEN, _CLIPS = 0.3, 1.0, 60
_CLIPPED = 2000  # tubes that are clipped at once, the strongest: streets have 319 at most, without noise far more
_LEAST = 1e-4  # of the strongest tube: the least floor, for radars without noise; not measured
# Halvings, and those from which on parts that do not count are dropped. Plates of 40 m to 2 km at 20 m, square on or
# aslant, are within 0.4 dB of fine runs and take 0.1 to 0.3 s of CPU (command not kept).
_CUTS, _FEW = 40, 10


def preview_routes(
    geometry: Geometry, points: Points, radar: Radar, rule: PruneRule, stats: Stats, each: Callable[[Batch], T]
) -> list[T]:
    """Return what `each`, called by any thread, makes of the routes of a preview, batch by batch; stats is filled.

    Args: geometry; points the targets given by their RCS; radar, which tells rates apart; rule what may be left out.
    """
    launch, refined = Launch(geometry, points, rule, legs_over_ground), rule.refinement.for_depth(rule.bounces)
    apart = RateClasses.of(geometry, radar, refined.cell)

    def over(legs: list[Leg]) -> list[_Tubes]:
        outs = ([out for out in launch.outs if len(leg.mirrors) + 1 + len(out.mirrors) <= rule.bounces] for leg in legs)
        return [_Tubes.over(geometry, leg, some, refined, apart) for leg, some in zip(legs, outs, strict=True)]

    def first() -> tuple[list[_Tubes], list[T]]:
        direct = over(launch.legs[:1])
        return direct, [each(routes) for routes in launch.exact()]

    def made(tubes: list[_Tubes], found: list[Contributions]) -> list[tuple[int, T]]:
        return [
            (len(routes.kind), each(routes))
            for one, what in zip(tubes, found, strict=True)
            for routes in one.routes(what)
        ]

    ((direct, exact), some), (others, more) = run_pair(
        lambda: _counted(geometry, first), lambda: _counted(geometry, lambda: over(launch.legs[1:]))
    )
    # Every leg is pruned against what the direct leg has found straight back, and itself.
    found = Contributions(refined)
    for tubes in direct:
        tubes.add_to(found)
    copies = [found.frozen(found.budget) for _ in others]
    (near, rays), (far, rays_far) = run_pair(
        lambda: _counted(geometry, lambda: made(direct, [found])),
        lambda: _counted(geometry, lambda: made(others, copies)),
    )
    stats.tubes += sum(count for count, _ in near + far)
    stats.legs = len(launch.legs)
    stats.rays += some + more + rays + rays_far
    return exact + [one for _, one in near + far]


def _counted(geometry: Geometry, what: Callable[[], S]) -> tuple[S, int]:
    """Return what a function returns, and the rays that this thread cast for it."""
    before = geometry.rays
    return what(), geometry.rays - before


def legs_over_ground(geometry: Geometry, end: Floats, bounces: int, beam: Beam | None = None) -> list[Leg]:
    """Return the direct leg from `end` (3,) [m], whose antenna has a `beam`, and one over each plane of the ground."""
    f = geometry.facets
    ground = np.flatnonzero((f.role == MIRROR)[f.body]) if len(f.body) else np.zeros(0, int)
    _, first = np.unique(geometry.plane[ground], return_index=True)
    legs = [Leg(end=end, beam=beam)]
    for facet in ground[first]:
        if bounces > 0 and (end - geometry.first[facet]) @ geometry.normal[facet] > 0.0:
            legs.append(Leg(end=end, mirrors=(Mirror.of(geometry, int(facet), 1.0),), beam=beam))
    return legs


@dataclass(frozen=True)
class _Straight:
    """Tubes (n,) that radiate back over the leg by which they came: their numbers, phases and amplitudes."""

    rows: Rows
    phases: Phases
    each: Complexes


@dataclass(frozen=True)
class _Tubes:
    """Tubes on their first surface that may count, how the end of their leg in sees their centres, and what goes
    straight back, None where that leg is none of the legs out; apart, classes of rate that do not hide each other."""

    geometry: Geometry
    leg: Leg
    outs: list[Leg]
    tubes: Tubes
    view: View
    straight: _Straight | None
    apart: RateClasses

    @staticmethod
    def over(geometry: Geometry, leg: Leg, outs: list[Leg], rule: Refinement, apart: RateClasses) -> _Tubes:
        """Return the tubes over a leg that may count over one of `outs`, cut where facets are large."""
        nothing = Contributions(rule)
        allowed = reachable(geometry, leg) & (geometry.piece_role == SCATTERER)
        allowed[leg.pieces(geometry)] = False
        facet = seed_facets(geometry, leg, allowed)
        # Bounds are those of their middles.
        counts = across_gain_ends(leg, geometry.facets.vertices[facet])
        for bound, length in facet_bounds(geometry, leg, outs, facet, rule.wavenumber):
            counts |= that_count(nothing, _turned(bound, length, rule), length, _SEEDS)
        facet, bary = _cut(geometry, leg, outs, facet[counts], nothing, apart)
        tubes = clip_where_gains_end(geometry, leg, leg, launch_tubes(geometry, leg, facet, bary))
        tubes, view = _seen_parts(geometry, leg, outs, tubes, rule)
        write_leg(geometry, tubes, leg, view.corners, view.passed, rule)
        straight = None
        if leg in outs:
            rows, ph = _radiated(geometry, leg, leg, tubes, nothing, apart)
            straight = _Straight(rows, ph, amplitudes(ph))
        return _Tubes(geometry, leg, outs, tubes, view, straight, apart)

    def add_to(self, found: Contributions) -> None:
        """Add what goes straight back to what a launch has found."""
        if self.straight:
            found.add(self.straight.phases, self.straight.each)

    def routes(self, found: Contributions) -> Iterator[Routes]:
        """Yield the routes over each leg out; what the strongest hide in their range cells is left out."""
        geometry, leg = self.geometry, self.leg
        self.add_to(found)
        for out in sorted(self.outs, key=lambda x: x is not leg):
            if out is leg and self.straight:
                rows, ph, each = self.straight.rows, self.straight.phases, self.straight.each
            else:
                rows, ph = _radiated(geometry, leg, out, self.tubes, found, self.apart)
                each = amplitudes(ph)
            kept = np.flatnonzero(that_count(found, each, ph.length, _SURE))
            rows = rows[kept]
            tubes, view = self.tubes.take(rows), self.view.take(rows)
            if out is not leg:
                view = centre_visibility(geometry, out, tubes, True, found.rule)
                kept, tubes = kept[view.seen], tubes.take(view.seen)
                view = view.take(view.seen)
                found.add(ph.take(kept), each[kept])
            if len(tubes):
                yield routes_of(geometry, leg, out, tubes, True, view.corners, view.passed)


def _radiated(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, found: Contributions, apart: RateClasses
) -> tuple[Rows, Phases]:
    """Return the numbers of the tubes that face the end of a leg out and may count there, and their phases, with
    lengths that tell rates apart."""
    ph = phases_of(geometry, leg, out, tubes, found.rule)
    _, facing = radiating(out, tubes, FACING)
    each = _turned(np.where(facing, ph.bound, 0.0), ph.length, found.rule)
    ph = replace(ph, length=ph.length + apart.lengths(tubes))
    rows = np.flatnonzero(facing & that_count(found, each, ph.length, _SEEN))
    return rows, ph.take(rows)


def that_count(found: Contributions, each: Complexes, length: Floats, weight: float) -> Bools:
    """Return which tubes (n,) to keep: the weakest of each range cell are pruned while their sum, and their sum in
    unrelated phases, both times `weight`, stay under 0.3 of the prune threshold.

    Args: each (n,) [1/m] what a tube scatters; length (n,) [m] of its two-way path.
    """
    share = each / found.prune_threshold(length)
    _, cell = np.unique(np.asarray(length / found.rule.cell, np.int64), return_inverse=True)
    octave = _CLASSES + _A_CLASS * np.log2(np.maximum(np.abs(share), 1e-9))
    octave = np.clip(octave, 0, _CLASSES - 1).astype(np.int64)
    at, classes = cell * _CLASSES + octave, (int(cell.max(initial=0)) + 1) * _CLASSES
    # Sums over the classes of a cell, up to each class: by classes in place of a sort, for speed.
    real, imag, power = (
        np.cumsum(np.bincount(at, x, classes).reshape(-1, _CLASSES), axis=1)
        for x in (share.real, share.imag, np.abs(share) ** 2)
    )
    sums = np.maximum.accumulate(np.maximum(np.hypot(real, imag), np.sqrt(power)), axis=1)
    return np.asarray(weight * sums[cell, octave] > SHARE)


def _turned(bound: Floats, length: Floats, rule: Refinement) -> Complexes:
    """Return bounds (n,) [1/m] with the phases of paths of these lengths (n,) [m]."""
    return np.asarray(bound * np.exp(-1j * rule.wavenumber * length))


def _seen_parts(geometry: Geometry, leg: Leg, outs: list[Leg], tubes: Tubes, rule: Refinement) -> tuple[Tubes, View]:
    """Return the tubes of which a leg sees the centre, and how; before that those that may be strong over one of `outs`
    are clipped at the shadow edges on them, and where only rays tell that they are seen in part, bisected."""
    parts, views, floor = list[Tubes](), list[View](), rule.floor
    for level in range(_CLIPS + 1):
        tubes = tubes.take(tubes.strength > 0.0)
        most = np.zeros(len(tubes))
        for out in outs if level < _CLIPS and not geometry.convex_alone else []:
            most = np.maximum(most, phases_of(geometry, leg, out, tubes, rule).bound)
        floor = max(floor, _LEAST * float(most.max(initial=0.0)))
        # Parts of parts are seen through gaps, too: behind a rack there are many.
        seen = tube_visibility(geometry, leg, tubes, most > _STRONG * floor, True, rule, None)
        split = seen.mixed & (seen.some | (most > _HIDDEN * floor))
        split[np.argsort(np.where(split, -most, 0.0), kind="stable")[_CLIPPED:]] = False
        ready, rows = np.flatnonzero(seen.centre.seen & ~split), np.flatnonzero(split)
        parts.append(tubes.take(ready))
        views.append(seen.centre.take(ready))
        if not len(rows):
            break
        clips, _ = subdivide(geometry, leg, tubes, rows, seen.side, True, 0.0)
        tubes = launch_tubes(geometry, leg, clips.facet, clips.bary)
    return Tubes.join(parts), View.join(views)


def _cut(
    geometry: Geometry, leg: Leg, outs: list[Leg], facet: Ints, nothing: Contributions, apart: RateClasses
) -> tuple[Ints, Floats]:
    """Return facets (n,) and corners (n, 3, 3) of tubes over facets, cut until their phase is quadratic and they have
    one rate; of parts of large facets those that may count over one of `outs`."""
    f, rule, out = geometry.facets, nothing.rule, outs[0]
    shape = f.vertices, f.normals, geometry.edge_curvature
    limits = rule.wavenumber, rule.phase, rule.turn, rule.max_edge, MOST_BEND, rule.widest, True, 0.0, rule.near
    done: list[tuple[Ints, Floats]] = []
    bary = np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy()
    for level in range(_CUTS + 1):
        edge = edge_to_cut(facet, bary, *shape, leg.image, leg.far, out.image, out.far, *limits)
        edge = np.where(edge < 0, apart.edge_to_cut(facet, bary), edge)
        more = (edge >= 0) & (level < _CUTS)
        done.append((facet[~more], bary[~more]))
        if not more.any():
            break
        facet, bary = halved(facet, bary, edge, np.flatnonzero(more), 0.0, level)
        if level >= _FEW:
            rows = _may_count(geometry, leg, outs, launch_tubes(geometry, leg, facet, bary), nothing)
            facet, bary = facet[rows], bary[rows]
    return np.concatenate([x for x, _ in done]), np.concatenate([x for _, x in done])


def _may_count(geometry: Geometry, leg: Leg, outs: list[Leg], tubes: Tubes, nothing: Contributions) -> Rows:
    """Return the numbers (m,) of the tubes that may count over one of `outs`, with those too near to be bounded."""
    corners, middle = tubes.points[:, :CENTRE], tubes.points[:, CENTRE]
    counts = sizes(corners - np.roll(corners, -1, axis=1)).max(axis=1) > NEAR * sizes(middle - leg.image)
    counts |= across_gain_ends(leg, corners)
    for out in outs:
        ph = phases_of(geometry, leg, out, tubes, nothing.rule)
        counts |= that_count(nothing, _turned(ph.bound, ph.length, nothing.rule), ph.length, _SEEDS)
    return np.flatnonzero(counts)
