"""Whole frames: seconds, stages, and the ratio to the bare rays they cast plus the 2-D FFT of their cube."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from statistics import median

import scipy.fft

import raychan as rc
from bench.bare import recorded, replay
from bench.measure import Row, barred, paired, seconds


def frame(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """Measure the urban street at its own tolerance, the living street at the default one; coarse ones if quick."""
    for name, tolerance in (("urban", None), ("living_street", 0.5)):
        yield from whole(rc.Scene.load(scenes / f"{name}.toml"), name, 3.0 if quick else tolerance, repeats)


def whole(scene: rc.Scene, name: str, tolerance: float | None, repeats: int) -> Iterator[Row]:
    """Give the rows of one scene: the frame, its stages, and both without the launch that tells the error."""
    with recorded() as casts:
        result = rc.simulate(scene, tolerance_db=tolerance)
    bare, count = replay(casts)
    samples = result.cube.samples
    bare()
    scipy.fft.fft2(samples, workers=2)
    pairs, stages = [], []
    for _ in range(repeats):
        least = seconds(bare) + seconds(lambda: scipy.fft.fft2(samples, workers=2))
        pairs.append((seconds(lambda: stages.append(rc.simulate(scene, tolerance_db=tolerance).timings)), least))
    tolerance = result.stats["tolerance_db"]
    more = {"rays": count, "tubes": result.stats["tubes"], "paths": len(result.paths.delay), "tolerance_db": tolerance}
    row = paired("frame", f"{name}, {tolerance:g} dB", pairs, "bare rays + 2-D FFT", **more)
    yield barred(row, "<= 3", row.ratio <= 3.0)
    for stage in stages[0]:
        took = [t[stage] for t in stages]
        shares = [t[stage] / sum(t.values()) for t in stages]
        yield Row("stage", f"{name}: {stage}", median(took), "whole frame", row.seconds, median(shares))
