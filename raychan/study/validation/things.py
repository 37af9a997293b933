"""Measures of what was detected: where things show, how fast, how strong, over which path, and where nothing shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure
from raychan.units import db


def _of(bench: Bench, run: str, target: str, column: str) -> float | None:
    row = bench.found(run, target)
    return None if row is None else float(getattr(bench.run(run).detections, column)[row])


def _less(later: float | None, first: float | None) -> float | None:
    return None if later is None or first is None else later - first


def _of_detection(column: str) -> Callable[..., Seen]:
    """Register the measure of a column of the detections [m, m/s, dB] where a target is detected, by its name."""

    def read(bench: Bench, run: str, target: str) -> Seen:
        return _of(bench, run, target, column)

    read.__name__ = column
    return measure(read)


for _column in ("range", "rate", "speed", "snr"):
    _of_detection(_column)


@measure
def shift(bench: Bench, run: str, target: str) -> Seen:
    """Return how far [m] from its place it is detected."""
    off = _less(_of(bench, run, target, "range"), bench.place(target)[1])
    return None if off is None else abs(off)


@measure
def speed_shift(bench: Bench, run: str, target: str) -> Seen:
    """Return by how much [m/s] its speed is off what it was given along the line of sight."""
    from raychan.study.validation.parameters import ground_speed

    off = _less(_of(bench, run, target, "speed"), float(ground_speed(bench, target) or 0.0))
    return None if off is None else abs(off)


@measure
def label(bench: Bench, run: str, target: str) -> Seen:
    """Return the label of its detection."""
    row = bench.found(run, target)
    return None if row is None else bench.run(run).provenance[row].label


@measure
def chain(bench: Bench, run: str, target: str) -> Seen:
    """Return the chain of bodies that leads its detection."""
    row = bench.found(run, target)
    return None if row is None else bench.run(run).provenance[row].bodies


@measure
def path_off(bench: Bench, run: str, target: str) -> Seen:
    """Return how far [m] the length of the leading path is from the range detected."""
    row = bench.found(run, target)
    if row is None:
        return None
    why = bench.run(run).provenance[row]
    return abs(why.contributions[0].range - why.range)


@measure
def seen(bench: Bench, run: str, target: str) -> Seen:
    """Say whether a target is detected."""
    return bench.found(run, target) is not None


@measure
def unseen(bench: Bench, run: str, target: str) -> Seen:
    """Say whether no detection's leading chain goes over a target, directly or not."""
    parts = bench.target(target).parts
    return not any(_goes_over(why, parts) for why in bench.run(run).provenance)


@measure
def empty(bench: Bench, run: str, low: float, high: float, speed: float) -> Seen:
    """Say whether nothing is detected between two ranges [m] at a speed [m/s] below `speed`."""
    d = bench.run(run).detections
    return not ((d.range >= low) & (d.range <= high) & (np.abs(d.speed) < speed)).any()


@measure
def empty_over(bench: Bench, run: str, target: str, high: float) -> Seen:
    """Say whether no detection below a range [m] goes over a target."""
    parts = bench.target(target).parts
    return not any(_goes_over(why, parts) for why in bench.run(run).provenance if why.range < high)


@measure
def count_seen(bench: Bench, run: str, targets: list[str]) -> Seen:
    """Return how many of the targets are detected."""
    return sum(bench.found(run, t) is not None for t in targets)


@measure
def greatest_off(bench: Bench, run: str, at: dict[str, float]) -> Seen:
    """Return the greatest distance [m] of a detected target from the range that stands beside it."""
    offs = [abs(x) for t, r in at.items() if (x := _less(_of(bench, run, t, "range"), r)) is not None]
    return max(offs, default=None)


@measure
def farthest_clutter(bench: Bench, run: str) -> Seen:
    """Return the range [m] of the farthest detection led by the ground and the own car alone."""
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
    best = max(targets, key=lambda t: _or_least(_of(bench, run, t, "snr")))
    return bench.target(best).title


@measure
def peaks(bench: Bench, run: str, low: float, high: float) -> Seen:
    """Return how many peaks the power-delay profile has between two ranges [m]."""
    made = bench.run(run).profile
    at = made.range[made.peaks]
    return int(((at >= low) & (at <= high)).sum())


@measure
def split(bench: Bench, run: str, at: list[float]) -> Seen:
    """Say whether the profile has a peak within a third of the least gap, and within a cell, of each range [m]."""
    made = bench.run(run).profile
    tops = made.range[made.peaks]
    # What lies further off than a cell is the peak of something else.
    near = min(float(np.diff(sorted(at)).min()) / 3.0, bench.scene(run).radar.waveform.range_resolution)
    return all(np.abs(tops - x).min(initial=np.inf) < near for x in at)


@measure
def range_apart(bench: Bench, run: str, one: str, other: str) -> Seen:
    """Return how far [m] apart in range two targets are detected."""
    apart = _less(_of(bench, run, one, "range"), _of(bench, run, other, "range"))
    return None if apart is None else abs(apart)


@measure
def speed_apart(bench: Bench, run: str, one: str, other: str) -> Seen:
    """Return how far [m/s] apart in speed two targets are detected."""
    apart = _less(_of(bench, run, one, "speed"), _of(bench, run, other, "speed"))
    return None if apart is None else abs(apart)


@measure
def snr_change(bench: Bench, first: str, later: str, target: str) -> Seen:
    """Return by how much [dB] a target's SNR rises from one run to another."""
    return _less(_of(bench, later, target, "snr"), _of(bench, first, target, "snr"))


@measure
def level_change(bench: Bench, first: str, later: str, target: str) -> Seen:
    """Return the same of its level without noise where it is not detected."""
    return _less(bench.strength(later, target), bench.strength(first, target))


@measure
def range_change(bench: Bench, first: str, later: str, target: str) -> Seen:
    """Return by how much [m] its range changes."""
    return _less(_of(bench, later, target, "range"), _of(bench, first, target, "range"))


@measure
def near_change(bench: Bench, first: str, later: str, limit: float) -> Seen:
    """Return by how much [dB] the strongest return of the profile below a range [m] changes; noise counts as least."""
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
    """Return the greatest change of SNR [dB] among them."""
    return max(_changes(bench, first, later, targets, snr_change).values(), default=None)


@measure
def order_of_gain(bench: Bench, first: str, later: str, targets: list[str]) -> Seen:
    """Return the targets by how much their levels gain, the most first: 'car 3 > car 2'."""
    got = _changes(bench, first, later, targets, level_change)
    return " > ".join(bench.target(t).title for t in sorted(got, key=lambda t: -got[t]))


@measure
def rank(bench: Bench, run: str, theirs: dict[str, float]) -> Seen:
    """Return Spearman's rank correlation of levels with printed ones."""
    return _spearman({t: bench.strength(run, t) for t in theirs}, theirs)


@measure
def rank_change(bench: Bench, first: str, later: str, theirs: dict[str, float]) -> Seen:
    """Return Spearman's rank correlation of changes of level with printed ones."""
    return _spearman(dict(_changes(bench, first, later, theirs, level_change)), theirs)


@measure
def greatest_sum(bench: Bench, one: list[float], other: list[float]) -> Seen:
    """Return the greatest size of the sums of two printed columns."""
    return float(np.abs(np.add(one, other)).max())


def _spearman(ours: Any, theirs: dict[str, float]) -> float | None:
    both = [(ours[t], theirs[t]) for t in theirs if ours.get(t) is not None]
    return float(spearmanr(*zip(*both, strict=True)).statistic) if len(both) > 2 else None


def _goes_over(why: Any, parts: tuple[str, ...]) -> bool:
    chain = why.contributions[0].chain if why.contributions else ()
    return any(link.strip("()").split(".")[0] in parts for link in chain)


def _or_least(value: float | None) -> float:
    return -np.inf if value is None else value
