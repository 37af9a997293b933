"""What `model.mode = "auto"` saves: CPU of a frame against the fixed model, and whether it finds the same; what of the
fixed model's CPU comes after its first launch, by which mode auto chooses; and what fixed models without a part of it
take."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import raychan as rc
from bench.measure import Row, barred, paired
from raychan.run.refinement.scene_refinement import SceneRefinement

_BAR = 0.7
_MODES = ("auto", "physical")
_LESS: dict[str, Callable[[Any], str]] = {
    "one bounce less": lambda model: f"model.max_bounces={model.max_bounces - 1}",
    "no thin layers": lambda model: "model.max_transmissions=0",
    "one thin layer": lambda model: "model.max_transmissions=1",
}
"""What a fixed model may leave out (none of the scenes has diffraction)."""
_BESIDE = 1.0  # cells along range and rate between two detections that are the same


def auto(scenes: Path, repeats: int, quick: bool) -> Iterator[Row]:
    """CPU of a frame in mode auto against the fixed model, in turn, and how far their detections agree."""
    for name in ("urban", "living_street", "occluded_pedestrian"):
        for tolerance in (1.0,) if quick else (0.5, 1.0):
            yield from _rows(scenes / f"{name}.toml", tolerance, repeats)


def _rows(file: Path, tolerance: float, repeats: int) -> Iterator[Row]:
    """Give the rows of one scene at a tolerance [dB]."""
    made = {mode: rc.Scene.load(file).override([f"model.mode={mode}"]) for mode in _MODES}
    found = {mode: rc.simulate(scene, tolerance_db=tolerance) for mode, scene in made.items()}
    pairs, after = [], []
    for _ in range(repeats):
        took = []
        for mode in _MODES:
            with _first_launches() as first:
                took.append(_cpu(made[mode], tolerance))
        pairs.append((took[0], took[1]))
        after.append((took[1] - first[0], took[1]))
    ours, theirs, name = found["auto"], found["physical"], f"{file.stem}, {tolerance:g} dB"
    row = paired("auto", name, pairs, "fixed model", **agreement(ours, theirs, tolerance))
    yield barred(row, f"<= {_BAR}, none lost", row.ratio is not None and row.ratio <= _BAR and not row.more["lost"])
    # What is refined feeds detections in either mode: a choice that cost nothing would save the first launch at most.
    yield paired("auto", f"{name}: fixed model without its first launch", after, "fixed model")
    # Nor does a choice of mechanisms save more than the best fixed model that leaves one out and keeps what is found.
    whole = made["physical"]
    for less, change in _LESS.items():
        smaller = whole.override([change(whole.model)])
        kept = agreement(rc.simulate(smaller, tolerance_db=tolerance), theirs, tolerance)
        pairs = [(_cpu(smaller, tolerance), _cpu(whole, tolerance)) for _ in range(repeats)]
        yield paired("auto", f"{name}: fixed model, {less}", pairs, "fixed model", **kept)


def _cpu(scene: rc.Scene, tolerance: float) -> float:
    """Return the CPU seconds of a frame at a tolerance [dB]."""
    start = process_time()
    rc.simulate(scene, tolerance_db=tolerance)
    return process_time() - start


@contextmanager
def _first_launches() -> Iterator[list[float]]:
    """Give the CPU seconds that first launches of refined scenes take."""
    spent, real = [0.0], SceneRefinement.first

    def timed(self: SceneRefinement) -> Any:
        start = process_time()
        found = real(self)
        spent[0] += process_time() - start
        return found

    SceneRefinement.first = timed  # type: ignore[method-assign]
    try:
        yield spent
    finally:
        SceneRefinement.first = real  # type: ignore[method-assign]


def agreement(ours: rc.Result, theirs: rc.Result, tolerance: float) -> dict[str, int | float]:
    """Return how the detections of two results agree: how many both find, of these how many differ by more than both
    errors stated, and how many are `lost`: found by the second alone, with a stated error that leaves it detectable."""
    scene, a, b = ours.scene, ours.detections, theirs.detections
    wave, least = scene.radar.channel_waveform, scene.processing.min_snr_db
    both = beyond = lost = 0
    for i in range(len(b.range)):
        off = [np.abs(a.range - b.range[i]) / wave.range_resolution, np.abs(a.rate - b.rate[i]) / wave.rate_resolution]
        near = np.max(off, axis=0) <= _BESIDE
        if near.any():
            j = int(np.argmin(np.where(near, off[0] + off[1], np.inf)))
            both += 1
            # An error that is not stated (NaN) is unknown: nothing lies beyond it.
            beyond += bool(abs(a.snr[j] - b.snr[i]) > a.error_db[j] + b.error_db[i])
        else:
            lost += bool(b.snr[i] - b.error_db[i] > least)
    within = [int((d.error_db <= tolerance).sum()) for d in (a, b)]
    return {"both": both, "beyond": beyond, "lost": lost, "within": within[0], "within, fixed": within[1]}
