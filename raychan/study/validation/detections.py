"""Measures of detections: range, speed, SNR and path of targets, and ranges where nothing is detected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure
from raychan.units import db


def of_detection(bench: Bench, run: str, target: str, column: str) -> float | None:
    """Return a column [SI] of a target's detection; None where it is not detected."""
    row = bench.found(run, target)
    return None if row is None else float(getattr(bench.run(run).detections, column)[row])


def _minus(later: float | None, first: float | None) -> float | None:
    return None if later is None or first is None else later - first


def _register(column: str) -> Callable[..., Seen]:
    """Register the measure of a column of the detections [m, m/s, dB] where a target is detected, by its name."""

    def read(bench: Bench, run: str, target: str) -> Seen:
        return of_detection(bench, run, target, column)

    read.__name__ = column
    return measure(read)


for _column in ("range", "rate", "speed", "snr"):
    _register(_column)


@measure
def shift(bench: Bench, run: str, target: str) -> Seen:
    """Return the distance [m] in range from a target's place to its detection."""
    off = _minus(of_detection(bench, run, target, "range"), bench.place(target)[1])
    return None if off is None else abs(off)


@measure
def speed_shift(bench: Bench, run: str, target: str) -> Seen:
    """Return the difference [m/s] of a target's detected speed from its given one along the line of sight."""
    from raychan.study.validation.parameters import ground_speed

    off = _minus(of_detection(bench, run, target, "speed"), float(ground_speed(bench, target) or 0.0))
    return None if off is None else abs(off)


@measure
def label(bench: Bench, run: str, target: str) -> Seen:
    """Return the label of a target's detection."""
    row = bench.found(run, target)
    return None if row is None else bench.run(run).provenance[row].label


@measure
def chain(bench: Bench, run: str, target: str) -> Seen:
    """Return the leading chain of bodies of a target's detection."""
    row = bench.found(run, target)
    return None if row is None else bench.run(run).provenance[row].bodies


@measure
def path_off(bench: Bench, run: str, target: str) -> Seen:
    """Return the difference [m] between the leading path's range and the detected one."""
    row = bench.found(run, target)
    if row is None:
        return None
    why = bench.run(run).provenance[row]
    return abs(why.contributions[0].range - why.range)


@measure
def seen(bench: Bench, run: str, target: str) -> Seen:
    """Return whether a target is detected."""
    return bench.found(run, target) is not None


@measure
def unseen(bench: Bench, run: str, target: str) -> Seen:
    """Return whether no detection's leading chain meets a target."""
    parts = bench.target(target).parts
    return not any(_goes_over(why, parts) for why in bench.run(run).provenance)


@measure
def empty(bench: Bench, run: str, low: float, high: float, speed: float) -> Seen:
    """Return whether nothing is detected between two ranges [m] at a speed [m/s] below `speed`."""
    d = bench.run(run).detections
    return not ((d.range >= low) & (d.range <= high) & (np.abs(d.speed) < speed)).any()


@measure
def empty_over(bench: Bench, run: str, target: str, high: float) -> Seen:
    """Return whether no detection below a range [m] has a target in its leading chain."""
    parts = bench.target(target).parts
    return not any(_goes_over(why, parts) for why in bench.run(run).provenance if why.range < high)


@measure
def count_seen(bench: Bench, run: str, targets: list[str]) -> Seen:
    """Return the number of targets that are detected."""
    return sum(bench.found(run, t) is not None for t in targets)


@measure
def greatest_off(bench: Bench, run: str, at: dict[str, float]) -> Seen:
    """Return the largest difference [m] of detected targets from the ranges [m] given for them."""
    offs = [abs(x) for t, r in at.items() if (x := _minus(of_detection(bench, run, t, "range"), r)) is not None]
    return max(offs, default=None)


@measure
def farthest_clutter(bench: Bench, run: str) -> Seen:
    """Return the range [m] of the farthest detection whose leading chain holds only the ground and the own car."""
    result = bench.run(run)
    own = result.receiver.background
    far = [
        why.range
        for why in result.provenance
        if why.contributions and all(link.strip("()").split(".")[0] in own for link in why.contributions[0].chain)
    ]
    return max(far, default=None)


@measure
def strongest(bench: Bench, run: str, targets: list[str]) -> Seen:
    """Return the title of the target with the highest SNR."""
    best = max(targets, key=lambda t: _or_least(of_detection(bench, run, t, "snr")))
    return bench.target(best).title


@measure
def peaks(bench: Bench, run: str, low: float, high: float) -> Seen:
    """Return the number of peaks of the power-delay profile between two ranges [m]."""
    made = bench.run(run).profile
    at = made.range[made.peaks]
    return int(((at >= low) & (at <= high)).sum())


@measure
def split(bench: Bench, run: str, at: list[float]) -> Seen:
    """Return whether the profile has a peak within a third of the least gap, and within a cell, of each range [m]."""
    made = bench.run(run).profile
    tops = made.range[made.peaks]
    # A peak farther off than a range cell belongs to another target.
    near = min(float(np.diff(sorted(at)).min()) / 3.0, bench.scene(run).radar.waveform.range_resolution)
    return all(np.abs(tops - x).min(initial=np.inf) < near for x in at)


@measure
def range_apart(bench: Bench, run: str, one: str, other: str) -> Seen:
    """Return the distance [m] in range between the detections of two targets."""
    apart = _minus(of_detection(bench, run, one, "range"), of_detection(bench, run, other, "range"))
    return None if apart is None else abs(apart)


@measure
def speed_apart(bench: Bench, run: str, one: str, other: str) -> Seen:
    """Return the difference [m/s] between the detected speeds of two targets."""
    apart = _minus(of_detection(bench, run, one, "speed"), of_detection(bench, run, other, "speed"))
    return None if apart is None else abs(apart)


@measure
def snr_change(bench: Bench, first: str, later: str, target: str) -> Seen:
    """Return the rise [dB] of a target's SNR from one run to another."""
    return _minus(of_detection(bench, later, target, "snr"), of_detection(bench, first, target, "snr"))


@measure
def level_change(bench: Bench, first: str, later: str, target: str) -> Seen:
    """Return the same rise, with the level without noise in a run that does not detect the target."""
    return _minus(bench.strength(later, target), bench.strength(first, target))


@measure
def range_change(bench: Bench, first: str, later: str, target: str) -> Seen:
    """Return the change [m] of a target's range from one run to another."""
    return _minus(of_detection(bench, later, target, "range"), of_detection(bench, first, target, "range"))


@measure
def near_change(bench: Bench, first: str, later: str, limit: float) -> Seen:
    """Return the change [dB] of the profile's strongest return below a range [m], taken as no weaker than the noise."""
    tops = []
    for run in (first, later):
        made = bench.run(run).profile
        tops.append(max(float(made.power[made.range < limit].max()), made.noise))
    return float(db(tops[1] / tops[0]))


def _changes(bench: Bench, first: str, later: str, targets: Any, change: Callable[..., Seen]) -> dict[str, float]:
    found = {t: change(bench, first, later, t) for t in targets}
    return {t: float(x) for t, x in found.items() if x is not None}


@measure
def mean_change(bench: Bench, first: str, later: str, targets: list[str]) -> Seen:
    """Return the mean change of SNR [dB] of the targets detected in both runs."""
    got = _changes(bench, first, later, targets, snr_change)
    return float(np.mean(list(got.values()))) if got else None


@measure
def greatest_change(bench: Bench, first: str, later: str, targets: list[str]) -> Seen:
    """Return the largest change of SNR [dB] of the targets detected in both runs."""
    return max(_changes(bench, first, later, targets, snr_change).values(), default=None)


@measure
def order_of_gain(bench: Bench, first: str, later: str, targets: list[str]) -> Seen:
    """Return the targets in the order of their rise in level, the largest first: 'car 3 > car 2'."""
    got = _changes(bench, first, later, targets, level_change)
    return " > ".join(bench.target(t).title for t in sorted(got, key=lambda t: -got[t]))


@measure
def rank(bench: Bench, run: str, printed: dict[str, float]) -> Seen:
    """Return Spearman's rank correlation of levels with printed ones."""
    return _spearman({t: bench.strength(run, t) for t in printed}, printed)


@measure
def rank_change(bench: Bench, first: str, later: str, printed: dict[str, float]) -> Seen:
    """Return Spearman's rank correlation of changes of level with printed ones."""
    return _spearman(dict(_changes(bench, first, later, printed, level_change)), printed)


@measure
def greatest_sum(bench: Bench, one: list[float], other: list[float]) -> Seen:
    """Return the largest magnitude of the sums of two printed columns."""
    return float(np.abs(np.add(one, other)).max())


def _spearman(simulated: Any, printed: dict[str, float]) -> float | None:
    both = [(simulated[t], printed[t]) for t in printed if simulated.get(t) is not None]
    return float(spearmanr(*zip(*both, strict=True)).statistic) if len(both) > 2 else None


def _goes_over(why: Any, parts: tuple[str, ...]) -> bool:
    chain = why.contributions[0].chain if why.contributions else ()
    return any(link.strip("()").split(".")[0] in parts for link in chain)


def _or_least(value: float | None) -> float:
    return -np.inf if value is None else value
