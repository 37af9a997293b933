"""Error against effort: every method at several settings on every case, with the front of those that none beats."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from raychan.study import cases, methods, street
from raychan.study.cases import TARGETS, Street, Target

Progress = Callable[[str, float], None]

WORST_DB = 60.0
"""Errors beyond count as this."""


@dataclass(frozen=True)
class Row:
    """One setting of one method on one case; `front_*`: no other is at once as cheap and better, or as good and
    cheaper."""

    case: str
    title: str
    truth: str
    truth_db: float
    method: str
    setting: str
    default: bool
    rays: float
    seconds: float
    error_db: float
    front_rays: bool = False
    front_seconds: bool = False


def tradeoff(names: Sequence[str] = (), quick: bool = False, progress: Progress | None = None) -> list[Row]:
    """Run the study and return its rows, case by case.

    Args: names of cases, all if none; progress is told (case, share done). Raises: ValueError for an unknown case.
    """
    unknown = [n for n in names if n not in TARGETS]
    if unknown:
        raise ValueError(f"case '{unknown[0]}' is not known: must be one of {', '.join(TARGETS)}")
    tell = progress or (lambda stage, share: None)
    _warm()
    rows: list[Row] = []
    for name in names or tuple(TARGETS):
        tell(name, 0.0)
        make: Callable[..., Target | Street] = TARGETS[name]
        case = make(quick=quick) if name in ("car", "urban") else make()
        if isinstance(case, Street):
            rows += _street(case, quick, tell)
        else:
            rows += _target(case, quick, tell)
        tell(name, 1.0)
    return rows + overall(rows)


def overall(rows: Sequence[Row]) -> list[Row]:
    """Return each setting that ran on every target, with its worst error and its whole cost: nobody knows beforehand
    which setting a target needs. The scene, whose settings are its own, is left out; none for fewer than two targets.
    """
    mine = [r for r in rows if r.case != "urban"]
    count = len({r.case for r in mine})
    groups: dict[tuple[str, str], list[Row]] = {}
    for r in mine:
        groups.setdefault((r.method, r.setting), []).append(r)
    made = []
    for (method, setting), g in groups.items():
        if count > 1 and len(g) == count:
            made.append(
                Row(
                    "all",
                    "all targets, one setting",
                    "worst of the targets",
                    max(r.truth_db for r in g),
                    method,
                    setting,
                    g[0].default,
                    sum(r.rays for r in g),
                    sum(r.seconds for r in g),
                    max(r.error_db for r in g),
                )
            )
    return marked(made)


def _target(case: Target, quick: bool, tell: Progress) -> list[Row]:
    settings = methods.efforts(quick, case.heavy)
    rows = []
    for i, e in enumerate(settings):
        run = e.run(case)
        low = 10.0 ** (-WORST_DB / 10.0)
        errors = 10.0 * np.log10(np.clip(run.value / case.truth, low, 1.0 / low))
        rows.append(_row(case, e, run, float(np.sqrt(np.mean(errors**2)))))
        tell(case.name, (i + 1) / len(settings))
    return marked(rows)


def _street(case: Street, quick: bool, tell: Progress) -> list[Row]:
    road = street.Road(case)
    settings = street.efforts(road.tolerance_db, quick)
    truth = street.tubes(road, case.tolerance_db, jitter=0.2, checked=False).value
    rows = []
    for i, e in enumerate(settings):
        tell(case.name, (i + 1) / (len(settings) + 1))
        run = e.run(road)
        rows.append(_row(case, e, run, street.error_db(run.value, truth)))
    return marked(rows)


def _row(case: Target | Street, e: Any, run: methods.Run, error: float) -> Row:
    return Row(
        case.name, case.title, case.source, case.truth_db, e.method, e.label, e.default, run.rays, run.seconds,
        min(error, WORST_DB),
    )  # fmt: skip


def marked(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of one case with their places on the fronts; errors below the truth's own count as that."""
    error = np.array([max(r.error_db, r.truth_db) for r in rows])
    out = list(rows)
    for key in ("rays", "seconds"):
        cost = np.array([getattr(r, key) for r in rows])
        for i, row in enumerate(out):
            as_good = (error <= error[i]) & (cost <= cost[i]) & ((error < error[i]) | (cost < cost[i]))
            values = {f.name: getattr(row, f.name) for f in fields(Row)}
            out[i] = Row(**(values | {f"front_{key}": not as_good.any()}))
    return out


def beaten_by(rows: Sequence[Row], row: Row, key: str = "seconds") -> list[Row]:
    """Return the settings of the same case that are at most as costly (`key` seconds or rays) and at least as good."""
    error = max(row.error_db, row.truth_db)
    return [
        r
        for r in rows
        if r.case == row.case
        and r is not row
        and max(r.error_db, r.truth_db) <= error
        and getattr(r, key) <= getattr(row, key)
        and (max(r.error_db, r.truth_db), getattr(r, key)) != (error, getattr(row, key))
    ]


def write_csv(rows: Sequence[Row], path: Path) -> Path:
    """Write the rows as CSV (rays, seconds [s], error_db [dB] rms over views or cells) and return the path."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(f.name for f in fields(Row))
        for row in rows:
            out.writerow(f"{v:.6g}" if isinstance(v, float) else v for v in astuple(row))
    return path


def _warm() -> None:
    """Compile and load everything once, so that no method pays for it."""
    case = cases.dihedral()
    for e in methods.efforts(quick=True):
        e.run(case)


__all__ = ["Row", "beaten_by", "marked", "tradeoff", "write_csv"]
