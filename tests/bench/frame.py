"""Whole frames: seconds, stages, and the ratio to the bare rays they cast plus the 2-D FFT of their cube."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import scipy.fft

import raychan as rc
from bench.bare import recorded, replay
from bench.measure import Row, barred, paired, seconds
from raychan import parallel
from raychan.compile.jit import Kernel
from raychan.geometry.embree_packet import COMPANIONS

_CORES = 2


def frame(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Measure the urban street, the living street and the occluded pedestrian at 0.5 dB; at 3 dB if quick."""
    for name in ("urban", "living_street", "occluded_pedestrian"):
        yield from whole(rc.Scene.load(scenes / f"{name}.toml"), name, 3.0 if quick else 0.5, repeats)


def _compiled(run: Callable[[], object]) -> float:
    """Return the seconds that a run on one thread spends in kernels called from Python: what would be left of it if
    everything between them took no time."""
    spent, real = [0.0], Kernel.__call__

    def timed(kernel: Kernel, *args: Any) -> Any:
        start = perf_counter()
        try:
            return real(kernel, *args)
        finally:
            spent[0] += perf_counter() - start

    parallel.set_threads(1)
    Kernel.__call__ = timed  # type: ignore[method-assign]
    try:
        run()
    finally:
        Kernel.__call__ = real  # type: ignore[method-assign]
        parallel.set_threads(None)
    return spent[0]


def whole(scene: rc.Scene, name: str, tolerance: float, repeats: int) -> Iterator[Row]:
    """Give the rows of one scene: the frame, its stages, and both without the launch that tells the error."""
    with recorded() as casts:
        rc.simulate(rc.Scene.load(scene.path), tolerance_db=tolerance)
    bare, count = replay(casts)
    result = rc.simulate(scene, tolerance_db=tolerance)
    if count < (1 + COMPANIONS) * result.stats["rays"]:
        raise RuntimeError(f"{count:,} of {result.stats['rays']:,} rays and their companions were recorded")
    samples = result.cube.samples
    bare()
    scipy.fft.fft2(samples, workers=2)
    pairs, stages = [], []
    for _ in range(repeats):
        least = seconds(bare) + seconds(lambda: scipy.fft.fft2(samples, workers=2))
        pairs.append((seconds(lambda: stages.append(rc.simulate(scene, tolerance_db=tolerance).timings)), least))
    more = {"rays": count, "tubes": result.stats["tubes"], "paths": len(result.paths.delay), "tolerance_db": tolerance}
    row = paired("frame", f"{name}, {tolerance:g} dB", pairs, "bare rays + 2-D FFT", **more)
    yield barred(row, "<= 3", row.ratio <= 3.0)
    compiled = _compiled(lambda: rc.simulate(scene, tolerance_db=tolerance))
    least = row.reference_seconds or 0.0
    name_of = f"{name}: compiled code alone, shared by {_CORES} cores without loss"
    yield Row("floor", name_of, compiled / _CORES, "bare rays + 2-D FFT", least, compiled / _CORES / max(least, 1e-9))
    for stage in stages[0]:
        took = [t[stage] for t in stages]
        shares = [t[stage] / sum(t.values()) for t in stages]
        yield Row("stage", f"{name}: {stage}", median(took), "whole frame", row.seconds, median(shares))
