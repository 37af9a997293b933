"""What the refinement of a scene may cost: rays, seconds, memory."""

from __future__ import annotations

import time
from typing import Any

from raychan.tracing.solver import Stats

STEPS = 6
"""Launches, each half as coarse as the one before."""
_RAYS = 2.5  # times the rays of the first launch: what all further launches may cast unless model.max_rays is given
_LOOKS = 4.5  # times the rays of a look that a run may cast unless model.max_rays is given; command not noted
_GROWTH = 2.0  # rays and seconds of a step over those of the one before, about
_BYTES = 400.0  # a path


def within(model: Any, stats: Stats) -> Any:
    """Return the settings of a model chosen by a look: without a budget of rays of its own it has that of the finer
    first launch that a fixed model takes."""
    return model.model_copy(update={"max_rays": round(_LOOKS * stats.rays)}) if model.max_rays == "auto" else model


class Budget:
    """The budgets of a scene's model: `max_rays`, `max_seconds`, `max_memory_mb`, counted from the first launch on."""

    def __init__(self, model: Any, stats: Stats) -> None:
        self._rays = (1.0 + _RAYS) * stats.rays if model.max_rays == "auto" else float(model.max_rays)
        self._seconds, self._memory = model.max_seconds, model.max_memory_mb
        self._cast, self._start = stats.rays, time.perf_counter()
        self._spent = 0.0

    def ended(self, steps: int, stats: Stats, paths: int) -> str:
        """Return what leaves no room for a further step, '' if nothing does; paths held."""
        cast, self._cast = stats.rays - self._cast, stats.rays
        spent, before = time.perf_counter() - self._start, self._spent
        self._spent = spent
        if steps >= STEPS:
            return f"{STEPS} steps"
        if stats.rays + _GROWTH * cast > self._rays:
            return "the budget of rays (model.max_rays)"
        if self._seconds is not None and spent + _GROWTH * (spent - before) > self._seconds:
            return "the budget of time (model.max_seconds)"
        if self._memory is not None and _GROWTH * paths * _BYTES > 1e6 * self._memory:
            return "the budget of memory (model.max_memory_mb)"
        return ""
