"""The trade-off study: error against effort of every method at several settings on every case, with Pareto fronts."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from raychan.run.files.output import csv_bytes, write_whole
from raychan.study import cases, methods, street
from raychan.study.cases import TARGETS, Street, Target

Progress = Callable[[str, float], None]

WORST_DB = 60.0
"""Larger errors [dB] count as this."""
_PATIENCE = 0.5  # s: longer runs are not repeated for timing


@dataclass(frozen=True)
class Row:
    """One setting of one method on one case; `front_*`: on the Pareto front of error against rays or seconds."""

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

    Args: names of cases, all if none; progress is called with (case, share done). Raises: ValueError for an unknown
    case."""
    unknown = [n for n in names if n not in TARGETS]
    if unknown:
        raise ValueError(f"case '{unknown[0]}' is not known: must be one of {', '.join(TARGETS)}")
    tell = progress or (lambda stage, share: None)
    _warm()
    rows: list[Row] = []
    for name in dict.fromkeys(names or TARGETS):
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
    """Return each setting that ran on every target, with its worst error and its total cost: which setting a target
    needs is not known beforehand. The scene has other settings and is left out; empty for fewer than two targets."""
    mine = [r for r in rows if r.case != "urban"]
    count = len({r.case for r in mine})
    which = "all" if count == len(TARGETS) - 1 else str(count)
    groups: dict[tuple[str, str], list[Row]] = {}
    for r in mine:
        groups.setdefault((r.method, r.setting), []).append(r)
    made = []
    for (method, setting), g in groups.items():
        if count > 1 and len(g) == count:
            made.append(
                Row(
                    "all",
                    f"{which} targets, one setting",
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


def comparable(rows: Sequence[Row], earlier: Sequence[Row]) -> tuple[list[Row], list[str]]:
    """Return the rows of an earlier run that stand beside rows: of the same cases, those of all targets made anew of
    these; and a line if it lacks cases, or has others."""
    mine, theirs = ([c for c in dict.fromkeys(r.case for r in x) if c != "all"] for x in (rows, earlier))
    same = [r for r in earlier if r.case in mine and r.case != "all"]
    lacking, more = ([c for c in x if c not in y] for x, y in ((mine, theirs), (theirs, mine)))
    made = [] if set(lacking) - {"urban"} else overall(same)
    said = []
    if lacking:
        said.append(
            f"the earlier run lacks {', '.join(lacking)}: its front is not drawn there, nor that of all targets"
        )
    if more:
        said.append(f"the earlier run has {', '.join(more)} as well, left out of the picture")
    return same + made, said


def _target(case: Target, quick: bool, tell: Progress) -> list[Row]:
    settings = methods.efforts(quick, case.heavy, case.hard)
    runs = []
    for i, e in enumerate(settings):
        runs.append(_timed(e, case))
        tell(case.name, (i + 1) / len(settings))
    # Settings that do the same work have the same cost; their seconds differ by chance only.
    work = [(e.method, run.rays, run.value.tobytes()) for e, run in zip(settings, runs, strict=True)]
    rows = []
    for e, run, key in zip(settings, runs, work, strict=True):
        seconds = min(r.seconds for r, k in zip(runs, work, strict=True) if k == key)
        low = 10.0 ** (-WORST_DB / 10.0)
        errors = 10.0 * np.log10(np.clip(run.value / case.truth, low, 1.0 / low))
        rows.append(_row(case, e, replace(run, seconds=seconds), float(np.sqrt(np.mean(errors**2)))))
    return marked(rows)


def _timed(e: Any, case: Target) -> methods.Run:
    """Return a run, the quickest of up to three within a second: times of short runs vary by chance."""
    since = perf_counter()
    run: methods.Run = e.run(case)
    for _ in range(2):
        if perf_counter() - since > _PATIENCE:
            break
        run = min(run, e.run(case), key=lambda r: r.seconds)
    return run


def _street(case: Street, quick: bool, tell: Progress) -> list[Row]:
    road = street.Road(case)
    settings = street.efforts(road.tolerance_db, quick)
    before, truth = (street.converged(road, t * case.tolerance_db) for t in (2.5, 1.0))
    known = street.error_db(before, truth)
    source = f"{case.source}; moved by {known:.2f} dB rms in its last refinement"
    case = replace(case, truth_db=known, source=source)
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
    """Return the rows of one case marked by fronts; errors below that of the reference count as equal to it."""
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
    heads = [f.name for f in fields(Row)]
    lines = [[f"{v:.6g}" if isinstance(v, float) else v for v in astuple(row)] for row in rows]
    return write_whole(path, csv_bytes([heads, *lines]))


def read_csv(path: Path) -> list[Row]:
    """Return the rows that `write_csv` wrote. Raises: ValueError for a file that is none of its own."""
    kinds: dict[str, Callable[[str], Any]] = {"str": str, "float": float, "bool": {"True": True, "False": False}.get}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            table = csv.DictReader(file)
            lines, given = list(table), table.fieldnames or ()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {getattr(error, 'strerror', None) or 'not a text file'}") from None
    if missing := [f.name for f in fields(Row) if f.name not in given]:
        raise ValueError(f"{path}: column '{missing[0]}' is missing: must be a tradeoff.csv of this command")
    rows = []
    for number, line in enumerate(lines, 2):
        try:
            values = {f.name: kinds[str(f.type)](line[f.name]) for f in fields(Row)}
        except (TypeError, ValueError):
            values = {"": None}
        numbers = [x for x in values.values() if isinstance(x, float)]
        if None in values.values() or not all(math.isfinite(x) and x >= 0.0 for x in numbers):
            raise ValueError(f"{path}: line {number} is not one of a trade-off")
        rows.append(Row(**values))
    if not rows:
        raise ValueError(f"{path}: no rows: must be a tradeoff.csv of this command")
    return rows


def _warm() -> None:
    """Compile and load everything once, so that it is in no method's time."""
    case = cases.dihedral()
    for e in methods.efforts(quick=True):
        e.run(case)


__all__ = ["Row", "beaten_by", "marked", "read_csv", "tradeoff", "write_csv"]
