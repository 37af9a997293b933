"""What the refinement of a scene may cost: rays, seconds, memory."""

from __future__ import annotations

import time
from typing import Any

from raychan.run.refinement.seconds import Pace
from raychan.run.rules import allowed_memory
from raychan.tracing.stats import Stats

STEPS = 8
"""Launches, each half as coarse as the one before. Rays against cells reached: of the detections at 0.5 dB of nine
scenes hard to converge (`bench.detections`, seeds 18 to 128) six bring 58 % within it, eight 73 % for 1.6 times the
rays."""
_RAYS = 0.5  # times the rays of the first launch: what all further launches may cast unless model.max_rays is given
_LEAST = 1_000_000
"""Rays that further launches may cast however few the first one did."""
_FINEST = 1.0
"""Tolerance [dB] from which down both grow as it shrinks: doubts shrink by 0.65 a step of 1.6 times the rays of the one
before (`map_cells`, `plan`), so rays grow at least so. At 0.5 dB urban, living street and occluded
pedestrian take 3.0, 2.2 and 2.8 million rays in place of 2.0, 1.0 and 1.6, 1.5 times the CPU, and bring 27 of 31
detections within it in place of 22 of 30. At 2 dB half of the rays lose one of 30, at 1 dB twice as many bring none."""
_BYTES = 900.0  # a path, at the peak of a run (of 1.5 and 5.4 million 890 and 910)
RAYS, SECONDS, MEMORY = (
    f"the budget of {what} (model.{key})"
    for what, key in (("rays", "max_rays"), ("seconds", "max_seconds"), ("memory", "max_memory_mb"))
)
MACHINE = "half of this machine's memory (model.max_memory_mb asks for more or less)"
FORESEEN = ", foreseen not to suffice for what is left"


class Budget:
    """The budgets of a scene's model: `max_rays`, `max_seconds`, `max_memory_mb`; of memory half of the machine's where
    none is given.

    Args: paths held so far; begun when the run began, now if None; look how long the first look at the map took [s].
    """

    def __init__(self, model: Any, stats: Stats, paths: int = 0, begun: float | None = None, look: float = 0.0) -> None:
        further = max(_RAYS * stats.rays, _LEAST) / min(model.tolerance_db / _FINEST, 1.0)
        self._rays = stats.rays + further if model.max_rays == "auto" else float(model.max_rays)
        own = model.max_memory_mb
        self._memory, self._which = allowed_memory(), MACHINE
        if own is not None:
            self._memory, self._which = 1e6 * own, MEMORY
        begun = time.perf_counter() if begun is None else begun
        self.pace = Pace(model.max_seconds, begun, look, stats.rays, paths)

    def left(self, stats: Stats) -> tuple[float, str]:
        """Return the rays that further steps may cast, and which budget does not allow more: seconds count as the rays
        that steps cast in them, as fast as so far."""
        rays, within = self._rays - stats.rays, self.pace.rays
        return (within, SECONDS) if within < rays else (rays, RAYS)

    def ended(self, stats: Stats, rays: float) -> str:
        """Return what leaves no room for a further step, '' if nothing does.

        Args: rays that the step takes, about.
        """
        left, which = self.left(stats)
        if rays > left:
            return which + (FORESEEN if left > 0.0 else "")
        return self._which if self.pace.paths(rays) * _BYTES > self._memory else ""

    def exceeded(self, model: Any, stats: Stats, paths: int) -> list[str]:
        """Return a line each if more rays were cast or more memory is taken than a scene's model allows."""
        said, always = [], "the first launch and one step always end"
        if model.max_rays != "auto" and stats.rays > model.max_rays:
            said.append(
                f"{stats.rays:,} rays were cast, more than the {model.max_rays:,} allowed (model.max_rays): {always}, "
                "and a later one may take some percent more than foreseen"
            )
        taken = 1e-6 * paths * _BYTES
        if model.max_memory_mb is not None and taken > model.max_memory_mb:
            said.append(
                f"paths took about {taken:,.0f} MB, more than the {model.max_memory_mb:,g} allowed "
                f"(model.max_memory_mb): {always}; a larger tolerance (model.tolerance_db) or fewer bounces take less"
            )
        return said
