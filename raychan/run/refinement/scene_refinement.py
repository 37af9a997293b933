"""A launch that converges: coarse first, then finer where detections need it.

The first launch cuts tubes for phases of half a radian, and deep tubes, those that bounced, only where one alone may
make a detection. The map of its paths tells which cells may become detections, and the sources of tubes that feed
these. They are traced again, each time half as coarse, until the last change of a cell's level is within the tolerance,
or a budget ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import COVER
from raychan.channel.paths import join, nothing, of_trajectories, paths_of
from raychan.parallel import run_pair
from raychan.radar.dual_paths import scaled
from raychan.radar.radar import Radar
from raychan.records import Cube, Paths, Points
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.ledger_entry import ModelChoice
from raychan.run.mechanisms import QUIET, choose, needed
from raychan.run.path_stream import MOST, Launched
from raychan.run.receiver import detections_in, least_in, map_of, noise_amplitude, seen_in_map, shoulders_in
from raychan.run.refinement.budget import SECONDS, STEPS, Budget
from raychan.run.refinement.feeding import each, feeding
from raychan.run.refinement.map_cells import ALONG, MapCells
from raychan.run.refinement.other_ways import Facets, OtherWays, last_facets
from raychan.run.refinement.plan import next_step
from raychan.run.refinement.probes import probes_of
from raychan.run.refinement.seconds import StepRays
from raychan.run.refinement.sourced_paths import SourcedPaths, changes, raised
from raychan.run.refinement.speckle import loosened
from raychan.run.refinement.unreached import Remains, Unreached, unreached_of
from raychan.run.rules import first_rule, step_rule
from raychan.run.streams import Stage, stream
from raychan.signal.baseband import noisy, synthesize
from raychan.tracing.routes import counting
from raychan.tracing.solver import Batch, Launch
from raychan.tracing.source_rays import SourceRays
from raychan.tracing.sources import EXACT, Rings, Sources
from raychan.tracing.stats import Further, Stats
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating]
Bools = NDArray[np.bool_]

_MARGIN_DB = 9.0  # below the least SNR of a detection: what refinement may bring above it (see `rules._FAN`)
_UNEXPLAINED = 0.1  # of a cell's power: cells whose paths bring less are noise
_COARSEST_DB = 1.0
"""Tolerance from which on first launches bring as many paths: of boxes and balls 69, 42, 32 and 32 thousand at 0.05,
0.2, 1 and 3 dB."""
_TOLD = 2  # steps after which `model.speckle` asks which levels still open displaced bodies move; others not measured
_LEVEL = 1e-4  # of the sum of all amplitudes: error of samples that only tell levels


class _Late(Exception):
    """Raised where a step takes too long for the run to end in time: nothing of it counts."""


@dataclass(frozen=True)
class Converged:
    """What the launches brought: the paths of the newest; `others`, the same without the last change of each cell and
    without deep tubes that were not traced again: what they differ by is what may be wrong."""

    launched: Launched
    others: Launched
    model: Any
    chosen: ModelChoice | None
    remains: Remains


@dataclass(frozen=True)
class First:
    """The first launch: its paths, the source of each of their trajectories, the mechanisms chosen by them, and the
    paths of those that were left out."""

    launch: Launch
    paths: Paths
    source: Sources
    chosen: ModelChoice | None = None
    left: Paths | None = None


@dataclass
class SceneRefinement:
    """The launches over one scene, for a radar and the settings of its processing."""

    geometry: Geometry
    points: Points
    radar: Radar
    settings: Any
    model: Any
    tell: Callable[[str, float], None]
    stats: Stats
    launches: list[list[Batch]] | None = None
    """Where given, the routes of all launches are kept here."""
    coarser: int = 0
    """Steps by which the first launch was made coarser, half as fine each, for too many paths."""
    begun: float = field(default_factory=perf_counter)
    """When the run began, by `time.perf_counter`."""

    def __post_init__(self) -> None:
        self._noise = noise_amplitude(self.radar, self.settings)
        self._probes = probes_of(self.radar)
        self._asked, self._end = self.launches is not None, math.inf
        self._speckled, self._exceeded = list[tuple[float, float]](), list[str]()
        if self.model.speckle and not self._asked:
            self.launches = []

    def first(self) -> First | None:
        """Return the first launch; None where it brings more paths than can be held."""
        auto = self.model.mode == "auto"
        # Diffraction is modelled for a receiver beside the transmitter only.
        over = self.radar.rx_position is None or self.model.diffraction
        asked = self.model.model_copy(update={"diffraction": over}) if auto else self.model
        while True:
            rule = first_rule(self.radar, self.settings, asked, -self.coarser)
            launch = Launch(self.geometry, self.points, rule, lit=auto)
            self._ways = OtherWays(launch)
            batches = launch.whole(self.stats, self._carried, lambda _, share: self.tell("trace", 0.5 * share))
            found = self._paths(batches, MOST)
            if found is not None:
                break
            if asked.tolerance_db * 2.0**self.coarser >= _COARSEST_DB:
                return None
            self.coarser += 2
        paths, source = found
        if not auto:
            return First(launch, paths, source)
        # The first launch, with all mechanisms, tells which of them are needed.
        chosen = choose(paths, self.radar, self.settings, self.model.tolerance_db)
        chosen = chosen.over(len(launch.legs), len(launch.every[0]))
        self.model = chosen.applied_to(self.model)
        keep = needed(paths, chosen)
        if self.launches is not None:
            self.launches[0] = counting(self.launches[0], keep)
        return First(launch, of_trajectories(paths, keep), source[keep], chosen, of_trajectories(paths, ~keep))

    def _carried(self, batch: Batch) -> tuple[Batch | None, Facets, Paths]:
        """Return a batch of routes, where they are kept, the facets that they scatter on, and their paths."""
        if perf_counter() > self._end:
            raise _Late
        paths = paths_of(batch, self.geometry.facets, self.radar, self.radar.waveform.carrier, self._noise)
        return (None if self.launches is None else batch), last_facets(batch), paths

    def _paths(
        self,
        batches: Iterable[tuple[tuple[Batch | None, Facets, Paths], Sources]],
        most: float = math.inf,
    ) -> tuple[Paths, Sources] | None:
        """Return the paths of a launch, and the source of each trajectory; None where there are too many."""
        parts, sources, count = [nothing(self.geometry.facets, self.radar)], [np.zeros(0, np.int64)], 0
        kept: list[Batch] = []
        for (batch, last, paths), source in batches:
            self._ways.add(source, last, paths)
            count += len(source)
            if count > most:
                return None
            if batch is not None:
                kept.append(batch)
            parts.append(paths)
            sources.append(source)
        if self.launches is not None:
            self.launches.append(kept)
        return join(parts), np.concatenate(sources)

    def converged(self, first: First) -> Converged:
        """Return the paths of a scene, refined where cells of its map need it."""
        radar, window = replace(self.radar, noise=False), self.settings.range_window
        held = SourcedPaths(first.paths, first.source, self._probes)
        response = PointSpread(radar.channel_waveform, window, self.settings.rate_window)
        since = perf_counter()
        cells = self._cells(radar, response, first.paths)
        look, steps = perf_counter() - since, 0
        unreached, ended = tuple[Unreached, ...](), ""
        if len(cells.place):
            steps, unreached, ended = self._refined(first.launch, held, response, cells, look)
        if self._asked and self.launches is not None:
            self.launches[:] = [counting(*x) for x in zip(self.launches, held.counts, strict=True)]

        def doubted() -> Paths:
            doubt = cells.doubt[: len(cells.place)] / COVER
            found = raised(response, scaled(held.doubtful, ALONG), cells.place, doubt)
            # What a level lacks is known: it needs no factor that covers what is not.
            return found if first.left is None else join([found, scaled(first.left, 1.0 / COVER)])

        now, doubtful = run_pair(lambda: held.now if steps else first.paths, doubted)
        # One after the other: both at once take the memory of both.
        quiet, off = synthesize(now, radar), synthesize(doubtful, radar, tolerance=_LEVEL)
        launched = Launched(now, len(now.length), radar, window, known=quiet)
        others = replace(launched, known=Cube(samples=quiet.samples - off.samples, noise_power=0.0))
        if self._asked:  # who carries routes on tells the error of what they meet by paths
            others = replace(others, paths=join([now, scaled(doubtful, -1.0)]))
        told = tuple(self._speckled), tuple(cells.settled), tuple(self._exceeded)
        remains = Remains(unreached, steps, ended, self.model.tolerance_db, *told)
        return Converged(launched, others, self.model, first.chosen, remains)

    def _cells(self, quiet: Radar, response: PointSpread, paths: Paths) -> MapCells:
        """Return the cells of the map that are detections, or would be a little stronger, also beside stronger ones;
        none where all paths are exact. Args: quiet, the radar without noise."""
        if not self.stats.tubes:
            return MapCells(np.zeros((0, 3)), np.zeros(0, complex), self.model.tolerance_db)
        radar, settings = self.radar, self.settings
        rough = synthesize(paths, quiet, tolerance=_LEVEL)
        lower = replace(settings, pfa=math.sqrt(settings.pfa), min_snr_db=settings.min_snr_db - _MARGIN_DB)
        rdmap = map_of(noisy(rough, radar, stream(0, Stage.NOISE)), radar, settings)
        seen = seen_in_map(rdmap, radar, settings)
        at = np.unique(detections_in(rdmap, radar, lower, seen).cell, axis=0).astype(np.int64)
        # Where the first launch finds too little of an echo, another one's slope hides it.
        more, least = shoulders_in(rdmap, at, radar, lower, seen)
        least = np.sqrt(np.append(np.zeros(len(at)), least) / radar.power)
        at = np.concatenate([at, more])
        place = np.stack([rdmap.range[at[:, 1]], rdmap.rate[at[:, 0]], np.zeros(len(at))], axis=1)
        power = rdmap.power[at[:, 0], at[:, 1]] / radar.power
        place[:, 2] = np.sqrt(power)
        alike = np.full(len(paths.trajectories.kind), EXACT)
        level = changes(response, paths, alike, place).sum(axis=1)
        fed = np.abs(level) ** 2 > _UNEXPLAINED * power
        place, level = place[fed], level[fed]
        place[:, 2] = np.abs(level)
        others = (changes(response, p.seen(paths), alike, place).sum(axis=1) for p in self._probes)
        cells = MapCells(place, np.stack([level, *others]), self.model.tolerance_db)
        lacking = QUIET * np.sqrt(least_in(rdmap, at[fed], radar, settings, seen) / radar.power)
        cells.spare(np.maximum(lacking, least[fed]))
        return cells

    def _refined(
        self, launch: Launch, held: SourcedPaths, response: PointSpread, cells: MapCells, look: float
    ) -> tuple[int, tuple[Unreached, ...], str]:
        """Refine the sources that feed cells; return how many steps that took, the cells not reached, and why. Args:
        look, how long the first look at the map took [s]."""
        count = len(self.geometry.facets.body)
        wanted, rays, cost = feeding(held, response, cells), SourceRays(count), StepRays(count)
        budget = Budget(self.model, self.stats, len(held), self.begun, look)
        rings, steps, ended = Rings(self.geometry), 0, ""
        while len(wanted) and not ended:
            self.tell("trace", 0.5 + 0.5 * steps / STEPS)
            try:
                changed = self._again(launch, held, wanted, self._ways.missing(wanted), rays, rings, cost)
            except _Late:
                ended = SECONDS
                break
            own, sums = held.sums_of(*changed, response, cells.place)
            each(sums, lambda i, change, own=own: cells.changed(i, own, change))  # type: ignore[misc]
            if not steps:
                cells.traced(own)
            steps += 1
            cells.stepped()
            if steps == _TOLD and self.model.speckle and self.launches is not None:
                about = self.geometry, self.radar, response, self._noise
                self._speckled = loosened(cells, held, self.launches, *about)
                self.launches = self.launches if self._asked else None
            budget.pace.stepped(self.stats.rays, len(held))
            wanted, self._end, ended = next_step(cells, rays, cost, budget, self.stats, STEPS - steps)
        self._end, self._exceeded = math.inf, budget.exceeded(self.model, self.stats, len(held))
        reached = cells.over <= 1.0
        for i in range(len(cells)):
            source, factor, share = cells.slowness(i)
            # Cells not reached are raised to what they may be wrong by: their factors need not count elsewhere.
            held.doubt(source, factor, share * reached[i])
        return steps, tuple(unreached_of(cells, self.geometry.facets)), ended

    def _again(
        self,
        launch: Launch,
        held: SourcedPaths,
        wanted: Sources,
        alone: Sources,
        rays: SourceRays,
        rings: Rings,
        cost: StepRays,
    ) -> tuple[Paths, Sources]:
        """Trace sources again, each half as coarse as before, and others `alone` as a first step does; return what that
        changes, as `SourcedPaths.replace`."""
        step, asked = rays.next_step(wanted), list[Further]()
        steps = np.unique(np.append(step, np.ones(min(len(alone), 1), np.int64))).tolist()
        for k in steps:
            by = list(rings.with_those_beside(wanted[step == k], alone if k == 1 else alone[:0]))
            rule = step_rule(self.radar, self.settings, self.model, k - self.coarser).refinement
            asked.append(Further(replace(rule, least=k), by))
        changed = list[tuple[Paths, Sources]]()
        again = launch.again(asked, self._carried)
        cost.learn(list(zip(steps, asked, strict=True)))
        for k, one, brought in zip(steps, asked, again, strict=True):
            new = self._paths(brought)
            assert new is not None
            self.stats.add(one.stats)
            rays.learn(k, one.wanted, new[1], one.stats.rays)
            changed.append(held.replace(*new, one.wanted))
        paths, sources = zip(*changed, strict=True)
        return join(list(paths)), np.concatenate(sources)
