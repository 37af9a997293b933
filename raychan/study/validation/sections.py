"""The report's sections beyond tables and claims: ablations, ghosts, link budget, array gain by azimuth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from raychan.run.receiver import noise_of_cell
from raychan.run.result import MULTIPATH
from raychan.study.validation.bench import Bench, over
from raychan.study.validation.data import POINT, Item
from raychan.study.validation.formulas import ARRAY, PATCH, both_ways, link_snr
from raychan.units import db

ECHOES = ("ghost", "pedestrian", "one_sided")
"""The echoes that ablations follow: the ghost over the truck both ways, the direct return, the ghost one way only."""
_BASE = "occluded"


@dataclass(frozen=True)
class Echo:
    """One echo in one run: its detection, or its level without noise."""

    range: float | None
    """Detected [m]; None if not."""
    snr: float | None
    """Of the detection, or of the paths alone without noise where it is not detected [dB]; None without a path."""
    error: float | None
    """Stated error of the detection [dB]; NaN where not converged."""

    def text(self) -> str:
        """Return '22.49 m, 21.2 dB ± 0.1', 'not detected, 13.0 dB', or 'no path'."""
        if self.snr is None:
            return "no path"
        if self.range is None:
            return f"not detected, {self.snr:.1f} dB"
        error = "?" if self.error is None or math.isnan(self.error) else f"{self.error:.1f}"
        return f"{self.range:.2f} m, {self.snr:.1f} dB ± {error}"


@dataclass(frozen=True)
class Ablation:
    """The pedestrian's echoes after one change of the scene."""

    run: str
    title: str
    echoes: dict[str, Echo]
    detections: int


def ablations(bench: Bench) -> list[Ablation]:
    """Return the unchanged scene and each of its ablations."""
    names = [_BASE, *(n for n, r in bench.study.runs.items() if r.ablation)]
    made = []
    for name in names:
        title = "as printed" if name == _BASE else bench.study.runs[name].title
        echoes = {e: _echo(bench, name, e) for e in ECHOES}
        made.append(Ablation(name, title, echoes, len(bench.run(name).detections.range)))
    return made


def _echo(bench: Bench, run: str, target: str) -> Echo:
    row = bench.found(run, target)
    if row is None:
        return Echo(None, bench.level(run, target), None)
    result = bench.run(run)
    d = result.detections
    return Echo(float(d.range[row]), float(d.snr[row]), result.provenance[row].error_db)


@dataclass(frozen=True)
class Ghost:
    """A multipath detection and the path that explains it."""

    run: str
    range: float
    path: float
    cell: float
    """Range bin c/2B of the run's waveform [m]."""
    snr: float
    text: str
    converged: bool
    """Whether an error of its level is known: else it may not be there."""

    @property
    def explained(self) -> bool:
        """Whether path and detection have the same range, to one range bin."""
        return abs(self.range - self.path) <= self.cell


def ghosts(bench: Bench) -> list[Ghost]:
    """Return the multipath detections of all runs, with the leading path of each."""
    made = []
    for run, result in bench.results.items():
        cell = result.receiver.waveform.range_resolution
        for why, snr in zip(result.provenance, result.detections.snr, strict=True):
            if why.label == MULTIPATH:
                first = why.contributions[0]
                known = bool(np.isfinite(why.error_db))
                made.append(Ghost(run, why.range, first.range, cell, float(snr), first.text(), known))
    return made


@dataclass(frozen=True)
class Budget:
    """A pedestrian's SNR by the link budget, over its direct path alone, over all paths, and as printed; dB."""

    target: str
    title: str
    link: dict[str, float]
    direct: float | None
    whole: float | None
    detected: bool
    printed: dict[str, float]
    """SNR as printed, by table column."""


def budgets(bench: Bench, run: str) -> list[Budget]:
    """Return the pedestrians of the living street, nearest first, with the run's antenna and bandwidth."""
    printed = _printed(bench.study.items, "T14")
    people = [t for t, g in bench.study.targets.items() if g.reference == POINT and g.scene == "living_street"]
    made = []
    for target in people:
        result = bench.run(run)
        given = bench.study.targets[target]
        body = result.paths.body_names.index(given.parts[0])
        met = result.paths.kind > 0
        alone = over(result, given.parts) & (met.sum(axis=1) == 1) & (result.paths.body[:, 0] == body)
        power = abs(result.paths.amplitude[alone].sum()) ** 2 * result.receiver.power
        scene = result.require_scene()
        direct = float(db(power / noise_of_cell(scene.radar, scene.processing))) if alone.any() else None
        made.append(
            Budget(
                target,
                given.title,
                link_snr(bench, run, target),
                direct,
                bench.strength(run, target),
                bench.found(run, target) is not None,
                printed.get(target, {}),
            )
        )
    return sorted(made, key=lambda b: b.link["range"])


@dataclass(frozen=True)
class ArrayGain:
    """A target's change of SNR [dB] from patch to array: by the patterns at its azimuth [deg], simulated, printed."""

    target: str
    title: str
    azimuth: float
    pattern: float
    simulated: float | None
    detected: bool
    printed: float
    needs: float | None
    """Least azimuth [deg] at which the patterns give the printed change; None if they give it nowhere."""


def array_gains(bench: Bench, first: str = PATCH, later: str = ARRAY) -> list[ArrayGain]:
    """Return the targets of table 16 by azimuth, the farthest off boresight first."""
    made = []
    for target, row in _printed(bench.study.items, "T16").items():
        at, _ = bench.place(target)
        azimuth = float(np.degrees(np.arctan2(at[1], at[0])))
        before, after = bench.strength(first, target), bench.strength(later, target)
        change = None if before is None or after is None else after - before
        made.append(
            ArrayGain(
                target,
                bench.study.targets[target].title,
                azimuth,
                float(both_ways(bench, np.array([azimuth]), first, later)[0]),
                change,
                bench.found(first, target) is not None and bench.found(later, target) is not None,
                row["change"],
                beam_angle(bench, row["change"], first, later),
            )
        )
    return sorted(made, key=lambda t: -abs(t.azimuth))


def beam_angle(bench: Bench, change_db: float, first: str = PATCH, later: str = ARRAY) -> float | None:
    """Return the least azimuth [deg] at which the array gains `change_db` over the patch, both ways."""
    angles = np.arange(0.0, 90.0, 0.01)
    below = np.flatnonzero(both_ways(bench, angles, first, later) <= change_db)
    return float(angles[below[0]]) if len(below) else None


def _printed(items: tuple[Item, ...], table: str) -> dict[str, dict[str, float]]:
    """Return the numbers of a table by target and column."""
    rows: dict[str, dict[str, float]] = {}
    for figure in next(i for i in items if i.id == table).figure:
        _, target, column = figure.key.split("/")
        if isinstance(figure.printed, int | float) and not isinstance(figure.printed, bool):
            rows.setdefault(target, {})[column] = float(figure.printed)
    return rows
