"""One launch: the routes of a scene from a radar and back, over every leg."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain, compress, islice
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import run_pair
from raychan.radar.beam_table import Beam
from raychan.records import DiffractedRoutes, Points, Routes
from raychan.tracing.contributions import Budget, Contributions
from raychan.tracing.exact_routes import direct_routes, foot_points
from raychan.tracing.launch import seeds_of
from raychan.tracing.legs import Leg, legs_over, reachable
from raychan.tracing.lit_legs import lit_legs
from raychan.tracing.point_targets import diffracted_routes, point_routes
from raychan.tracing.settings import PruneRule
from raychan.tracing.shared_work import all_of
from raychan.tracing.shooting import Wanted, numbered_routes
from raychan.tracing.sources import EXACT, Sources, depth_of, legs_of, source_of, sources_of
from raychan.tracing.stats import Further, Stats
from raychan.tracing.tubes import Refinement
from raychan.tracing.ways import Way, turned_round
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Progress = Callable[[str, float], None]
Batch = Routes | DiffractedRoutes
T = TypeVar("T")
Brought = tuple[T, Sources]
_Job = tuple[int, Contributions, Wanted | None]
LegsFrom = Callable[[Geometry, Floats, int, Beam | None], list[Leg]]
"""Gives the legs from an end, the direct one first (see `legs.legs_over`)."""

# A launch beyond these limits cuts no more and says so.
_TUBES = 10_000_000  # cut for phase: a quarter of a minute of one core; urban streets at 0.1 dB take a million
_CUTS, _CUTS_A_FACET = 40_000, 4  # cuts for visibility; urban streets at 0.1 dB take 13,000
_SHARES = 16  # parts of what the direct leg leaves of a budget that each other leg gets; not measured
_GROUP = 64  # legs traced at once at most, and their facets in all: bounds the memory; threads wait for each other
# after each
_HELD = 1 << 21
_HELD_ROUTES = (
    1 << 17
)  # of the direct leg at once; with so many of first surfaces it comes before other legs; not measured
_PART = 4096  # first facets from which tubes are traced again at once; not measured


def launch_routes(
    geometry: Geometry, points: Points, rule: PruneRule, stats: Stats, progress: Progress | None = None
) -> Iterator[Batch]:
    """Yield the routes of a scene from transmitter to receiver, batch by batch.

    Args: geometry, which serves many launches; points the targets given by their RCS; rule what may be left out; stats
    is filled; progress is told ("trace", share done).
    """
    for routes, _ in Launch(geometry, points, rule).whole(stats, lambda routes: routes, progress):
        yield routes


class Launch:
    """The launches over one scene: the `whole`, and further ones of some of its tubes, cut finer.

    Each route has a source (see `tracing.sources`). With `lit` tubes go over the legs only that may carry anything (see
    `tracing.lit_legs`); `every` holds all of both ends.
    """

    def __init__(
        self, geometry: Geometry, points: Points, rule: PruneRule, legs: LegsFrom = legs_over, lit: bool = False
    ) -> None:
        self.geometry, self.points, self.rule = geometry, points, rule
        self.legs = legs(geometry, np.asarray(rule.position, float), rule.bounces - 1, rule.beam)
        self.outs = self.legs
        if rule.rx is not None:
            self.outs = legs(geometry, np.asarray(rule.rx, float), rule.bounces - 1, rule.beam)
        self.every = self.legs, self.outs
        if lit:
            layers = rule.refinement.layers
            self.legs = list(compress(self.legs, lit_legs(geometry, self.legs, layers)))
            self.outs = self.legs
            if rule.rx is not None:
                self.outs = list(compress(self.every[1], lit_legs(geometry, self.every[1], layers)))
        self._ways = Way.between(geometry, self.legs, self.outs, both=rule.rx is not None)
        self._found: dict[int, Contributions] = {}

    def whole(self, stats: Stats, each: Callable[[Batch], T], progress: Progress | None = None) -> Iterator[Brought[T]]:
        """Yield what `each`, called by any thread, makes of all routes, and their sources (n,), batch by batch."""
        before = self.geometry.rays
        for exact in self.exact():
            yield each(exact), np.full(len(exact.kind), EXACT)
        # Every leg is pruned against itself and what the direct leg has found, the first ones against what its first
        # surfaces return: the order of the others does not matter.
        direct = self._found[0] = Contributions(self._limited(self.rule.refinement))
        straight, count = self._over(0, direct, stats, each), sum(len(way.legs) for way in self._ways)
        yield from islice(straight, 1)
        if stats.tubes > _HELD_ROUTES:
            yield from straight
        for group in self._groups(range(1, count)):
            if progress:
                progress("trace", group[0] / count)
            for i in group:
                share = 0.5 if i == len(self.legs) else 1.0 / _SHARES  # the direct leg of the other way
                self._found[i] = direct.forked(self.geometry, share)
            jobs: list[_Job] = [(i, self._found[i], None) for i in group]
            rest, others = self._beside(straight, jobs, [stats] * len(group), each)
            yield from chain(rest, *others)
            for i in group:
                direct.budget.take_back(self._found[i].budget)
        yield from straight
        stats.rays += self.geometry.rays - before
        stats.legs = len(self.every[0])
        stats.count_uncut(direct.budget.uncut)
        if progress:
            progress("trace", 1.0)

    def again(self, asked: list[Further], each: Callable[[Batch], T]) -> list[list[Brought[T]]]:
        """Return, for each of several further launches at once, what `each`, called by any thread, makes of batches of
        routes, and their sources (n,). Their stats are filled.

        What is too weak to be cut is judged by what the whole launch found.
        """
        # Those that take longest first: at the end threads wait for the last one.
        longest = sorted(
            ((k, *one) for k, further in enumerate(asked) for one in further.wanted),
            key=lambda x: (-x[2].depth, -np.count_nonzero(x[2].facets) << asked[x[0]].refinement.least),
        )
        parts = [(k, i, part) for k, i, what in longest for part in what.parts(_PART)]
        found: list[list[Brought[T]]] = [[] for _ in asked]
        for group in self._groups(range(len(parts))):
            own, jobs = [parts[j][0] for j in group], list[_Job]()
            for k, i, what in (parts[j] for j in group):
                budget = Budget(self._limited(asked[k].refinement))
                jobs.append((i, self._found[i].frozen(budget), what))
            costs = [Stats() for _ in jobs]
            brought = self._together(jobs, costs, each)
            for k, (i, job, _), (_, _, what), cost, made in zip(
                own, jobs, (parts[j] for j in group), costs, brought, strict=True
            ):
                found[k] += made
                cost.count_uncut(job.budget.uncut)
                asked[k].stats.add(cost)
                asked[k].parts.append((i, what, cost.rays))
        for further in asked:
            further.stats.legs = len(self.every[0])
        return found

    def turned_round(self, source: Sources, last: NDArray[np.int32]) -> Sources:
        """Return the sources (n,) of the same routes the other way round, which start on facets `last` (n,)."""
        (leg, out), many = legs_of(source), len(self.legs) if len(self._ways) > 1 else 0
        # Legs of the other way are numbered after those of this one.
        back = leg >= many if many else np.zeros(len(leg), bool)
        return source_of(np.where(back, out, many + out), np.where(back, leg - many, leg), depth_of(source), last)

    def _groups(self, jobs: range) -> Iterator[range]:
        """Give numbers of jobs in groups that are done at once: their routes are held."""
        size = max(1, min(_GROUP, _HELD // max(len(self.geometry.facets.body), 1)))
        return (jobs[i : i + size] for i in range(0, len(jobs), size))

    def _beside(
        self, straight: Iterator[Brought[T]], jobs: list[_Job], stats: list[Stats], each: Callable[[Batch], T]
    ) -> tuple[list[Brought[T]], list[list[Brought[T]]]]:
        """Return what is left of the direct leg, done by this thread, as many routes of it as may be held, and what
        each job brings."""

        def others() -> list[list[Brought[T]]]:
            before = self.geometry.rays
            made = self._together(jobs, stats, each)
            # They count in the stats of the jobs.
            self.geometry.count_rays(before - self.geometry.rays)
            return made

        return run_pair(lambda: list(_so_many(straight)), others)

    def _together(self, jobs: list[_Job], stats: list[Stats], each: Callable[[Batch], T]) -> list[list[Brought[T]]]:
        """Return what each job brings; add what it costs to its stats."""
        own = [Stats() for _ in jobs]

        def one(i: int, found: Contributions, wanted: Wanted | None, cost: Stats) -> list[Brought[T]]:
            before = self.geometry.rays
            made = list(self._over(i, found, cost, each, wanted))
            cost.rays = self.geometry.rays - before
            return made

        made = all_of(self.geometry, [partial(one, *job, cost) for job, cost in zip(jobs, own, strict=True)])
        for cost, whole in zip(own, stats, strict=True):
            whole.tubes += cost.tubes
            whole.rays += cost.rays
        return made

    def _over(
        self, i: int, found: Contributions, stats: Stats, each: Callable[[Batch], T], wanted: Wanted | None = None
    ) -> Iterator[Brought[T]]:
        # Legs of the other way are numbered after those of this one.
        way = self._ways[i >= len(self.legs)]
        leg = way.legs[i - way.back * len(self.legs)]
        pieces = reachable(self.geometry, leg)
        if not pieces.any() or not len(seeds_of(self.geometry, leg, pieces)):
            return

        def made(routes: Routes, depth: int, out: int, turned: bool) -> tuple[int, T, Sources]:
            source = sources_of(routes, i, len(leg.mirrors), out, depth)
            if turned:
                return 0, each(turned_round(routes)), source
            return len(routes.kind), each(way.counted(self.geometry, leg, way.outs[out], routes, depth)), source

        for tubes, *one in numbered_routes(
            self.geometry, leg, way.outs, way.images, pieces, self.rule.bounces, found, made, wanted=wanted,
            way=None if way.alone else way, turned=self.rule.rx is None,
        ):  # fmt: skip
            stats.tubes += tubes
            yield one[0], one[1]

    def exact(self) -> Iterator[Batch]:
        """Yield the routes that need no tubes: over points, wedges, the ground's foot points, and the direct ones."""
        geometry, points, rule, refined = self.geometry, self.points, self.rule, self.rule.refinement
        legs, outs = self.every
        found: Batch | None = point_routes(geometry, points, legs, outs, rule.bounces, refined.slots, refined.layers)
        if found is not None:
            yield found
        if rule.diffraction and rule.rx is not None:
            raise ValueError(
                "diffraction is modelled for a receiver beside the transmitter only: model.diffraction = false"
            )
        if rule.diffraction:
            found = diffracted_routes(geometry, points, legs[0].end, refined.wavenumber, refined.slots)
            if found is not None:
                yield found
        # A bounce at the ground is one, although no leg over it leads on to another.
        over = legs if rule.bounces > 1 else legs_over(geometry, legs[0].end, 1)
        if rule.rx is None:
            found = foot_points(geometry, over, refined)
        else:
            found = direct_routes(geometry, over, outs[0].end, refined.slots, refined.layers)
        if found is not None:
            yield found

    def _limited(self, refined: Refinement) -> Refinement:
        cuts = _CUTS + _CUTS_A_FACET * len(self.geometry.facets.vertices)
        return replace(
            refined.for_depth(self.rule.bounces),
            max_tubes=min(refined.max_tubes, _TUBES),
            max_cuts=min(refined.max_cuts, cuts),
        )


def _so_many(brought: Iterator[Brought[T]]) -> Iterator[Brought[T]]:
    """Give what is brought until it is as many routes as may be held; the rest stays."""
    count = 0
    for one in brought:
        yield one
        count += len(one[1])
        if count > _HELD_ROUTES:
            return
