"""How many rays further steps of a refinement take, and how many seconds they and the rest of the run: foreseen by what
steps took so far."""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from raychan.tracing.sources import Sources, launches
from raychan.tracing.stats import Further

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_GROWTH = 4.0
"""Rays of a facet over those of its launch before, half as coarse: as many as its tubes are more."""
_DEARER = 1.2
"""Times the rays foreseen so, at least: of 16 steps of five streets at 0.1 dB seven take more, up to 2.3 times as many.
"""
_AFTER = 1.3
"""Time of a path in all that follows the steps, over that of a ray in a step: 0.7 to 1.2 in five such streets."""
_LOOKS = 4.0
"""Times as long as the first look at the map what follows takes beside that of its paths: samples twice, map and
detections, directions (not measured)."""


class StepRays:
    """How many rays a step takes: by those that each facet took last, by leg in and bounce, and by how many times
    what was foreseen steps took.

    Args: facets how many there are.
    """

    def __init__(self, facets: int) -> None:
        self._facets = facets
        self._step: dict[tuple[int, int], Ints] = {}
        self._rays: dict[tuple[int, int], Floats] = {}
        self._foreseen, self._told, self._cast = 0.0, 0.0, 0

    def of(self, source: Sources, step: Ints) -> float:
        """Return how many rays it takes, about, to trace sources (n,) at steps (n,): the next that is learned."""
        self._foreseen = 0.0
        for k in np.unique(step).tolist():
            for leg, wanted in launches(source[step == k], self._facets):
                if (key := (leg, wanted.depth)) in self._rays:
                    rows = np.flatnonzero(wanted.facets)
                    more = _GROWTH ** np.maximum(k - self._step[key][rows], 0)
                    self._foreseen += float((self._rays[key][rows] * more).sum())
        return max(_DEARER, self._cast / max(self._told, 1.0)) * self._foreseen

    def learn(self, asked: list[tuple[int, Further]]) -> None:
        """Note what launches of a step took, each with its number."""
        if self._foreseen > 0.0:
            self._told, self._cast = self._told + self._foreseen, self._cast + sum(x.stats.rays for _, x in asked)
        for k, one in asked:
            for leg, wanted, rays in one.parts:
                key, rows = (leg, wanted.depth), np.flatnonzero(wanted.facets)
                if key not in self._rays:
                    self._step[key], self._rays[key] = np.zeros(self._facets, np.int64), np.zeros(self._facets)
                self._step[key][rows], self._rays[key][rows] = k, rays / max(len(rows), 1)


class Pace:
    """The seconds that a run may take, and how fast its steps are.

    Args: allowed [s], None where all are; begun when the run began, look how long the first look at the map took [s];
    cast rays and held paths so far.
    """

    def __init__(self, allowed: float | None, begun: float, look: float, cast: int, held: int) -> None:
        self._end = math.inf if allowed is None else begun + allowed - _LOOKS * look
        self._first, self._paths = (time.perf_counter(), cast, held), held
        self._each, self._brought = 0.0, 0.0

    def stepped(self, cast: int, paths: int) -> None:
        """Note that a step has ended, with so many rays cast and paths held in all."""
        begun, before, held = self._first
        rays = max(cast - before, 1)
        self._each, self._brought, self._paths = (time.perf_counter() - begun) / rays, (paths - held) / rays, paths

    def end(self, rays: float) -> float:
        """Return when a step of so many rays must end, for what follows to end in time as well."""
        return self._end - _AFTER * self._each * self.paths(rays)

    def paths(self, rays: float) -> float:
        """Return how many paths are held after a step of so many rays, those replaced among them."""
        return self._paths + self._brought * rays

    @property
    def rays(self) -> float:
        """Rays that further steps may cast, at as many seconds a ray as the steps so far, with what follows."""
        left = max(self.end(0.0) - time.perf_counter(), 0.0)
        return left / max(self._each * (1.0 + _AFTER * self._brought), 1e-12)
