"""What further launches of sources took: how fine each source was cut last, and by how many rays."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from raychan.tracing.shooting import Wanted
from raychan.tracing.sources import EXACT, Sources, by_launch, facet_of, without_out

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_GROWTH = 2.2  # rays of a source over those of its launch before, half as fine (not measured)
# Rays: launches that save fewer are made one with finer ones. Each takes 25 ms besides its rays, as much as 10,000 of
# these (living street at 0.5 dB, 85 launches); at 10,000 urban, living street and occluded pedestrian take 1.0 to 1.4
# times the rays that they take without, at this 0.8 to 1.0 times.
_LAUNCH = 5_000


class SourceRays:
    """The finest `step` at which tubes of each facet were traced, by leg in and bounce, and the rays that this took.

    A launch tells only how many rays it took in all: facets share them as they share its routes.

    Args: facets how many there are.
    """

    def __init__(self, facets: int) -> None:
        self._facets = facets
        self._step: dict[tuple[int, int], Ints] = {}
        self._rays: dict[tuple[int, int], Floats] = {}

    def learn(self, step: int, launched: list[tuple[int, Wanted]], source: Sources, rays: int) -> None:
        """Note what launches brought, the source (w,) of each route, and how many rays they took."""
        routes, own = dict[tuple[int, int], Ints](), source[source != EXACT]
        for key, rows in by_launch(own):
            routes[key] = np.bincount(facet_of(own[rows]), minlength=self._facets)
        found = {}
        for i, wanted in launched:
            facets = np.flatnonzero(wanted.facets)
            # A facet without a route takes rays, too.
            some = routes.get((i, wanted.depth))
            found[i, wanted.depth] = facets, np.ones(len(facets)) if some is None else np.maximum(some[facets], 1.0)
        each = rays / max(sum(float(brought.sum()) for _, brought in found.values()), 1.0)
        for key, (facets, brought) in found.items():
            if key not in self._step:
                self._step[key], self._rays[key] = np.zeros(self._facets, np.int64), np.zeros(self._facets)
            self._step[key][facets], self._rays[key][facets] = step, each * brought

    def step_of(self, source: Sources) -> Ints:
        """Return the step (n,) at which each source was traced last; 0 for those of the first launch."""
        found = np.zeros(len(source), np.int64)
        for key, rows in by_launch(source):
            if key in self._step:
                found[rows] = self._step[key][facet_of(source[rows])]
        return found

    def next_step(self, source: Sources) -> Ints:
        """Return the step (n,) at which to trace each source again: the next one, or one more where others of its leg
        and bounce are at that and a launch of its own takes longer than the rays that it saves."""
        step, rays = self.step_of(source) + 1, _GROWTH * self.of(source)
        for _, rows in by_launch(source):
            for low, high in pairwise(np.unique(step[rows])):
                own = rows[step[rows] == low]
                _, once = np.unique(without_out(source[own]), return_index=True)
                if rays[own[once]].sum() * (_GROWTH ** (high - low) - 1.0) < _LAUNCH:
                    step[own] = high
                    rays[own] *= _GROWTH ** (high - low)
        return step

    def of(self, source: Sources) -> Floats:
        """Return the rays (n,) that the last launch from the facet of each source took; 1 where none is known."""
        found = np.ones(len(source))
        for key, rows in by_launch(source):
            if key in self._rays:
                found[rows] = np.maximum(self._rays[key][facet_of(source[rows])], 1.0)
        return found
