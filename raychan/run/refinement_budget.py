"""What the refinement of a scene may cost: rays, seconds, memory."""

from __future__ import annotations

import time
from typing import Any

from raychan.tracing.solver import Stats

STEPS = 8
"""Launches, each half as coarse as the one before. Rays against cells reached: of the detections at 0.5 dB of nine
scenes hard to converge (`bench.detections`, seeds 18 to 128) six bring 58 % within it, eight 73 % for 1.6 times the
rays."""
_RAYS = 0.5  # times the rays of the first launch: what all further launches may cast unless model.max_rays is given
_LEAST = 1_000_000
"""Rays that further launches may cast however few the first one did. With 1,500,000, or as many as the first launch,
urban, living street and occluded pedestrian take 2.1, 1.7 and 2.3 million rays in place of 1.9, 1.2 and 1.6, and bring
25 of 30 detections within 0.5 dB in place of 24."""
_GROWTH = 2.0  # paths of a step over those of the one before, about
RAYS = "the budget of rays (model.max_rays)"
_BYTES = 400.0  # a path


class Budget:
    """The budgets of a scene's model: `max_rays`, `max_seconds`, `max_memory_mb`, counted from the first launch on."""

    def __init__(self, model: Any, stats: Stats) -> None:
        further = max(_RAYS * stats.rays, _LEAST)
        self._rays = stats.rays + further if model.max_rays == "auto" else float(model.max_rays)
        self._seconds, self._memory = model.max_seconds, model.max_memory_mb
        self._cast, self._start = stats.rays, time.perf_counter()
        self._spent = 0.0

    def left(self, stats: Stats) -> float:
        """Return the rays that further steps may cast."""
        return self._rays - stats.rays

    def ended(self, stats: Stats, paths: int, rays: float) -> str:
        """Return what leaves no room for a further step, '' if nothing does.

        Args: paths held; rays that the step takes, about.
        """
        cast, self._cast = stats.rays - self._cast, stats.rays
        spent, before = time.perf_counter() - self._start, self._spent
        self._spent = spent
        if rays > self.left(stats):
            return RAYS
        if self._seconds is not None and spent + rays / max(cast, 1) * (spent - before) > self._seconds:
            return "the budget of time (model.max_seconds)"
        if self._memory is not None and _GROWTH * paths * _BYTES > 1e6 * self._memory:
            return "the budget of memory (model.max_memory_mb)"
        return ""
