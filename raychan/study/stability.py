"""The stability study: all regimes in which ray methods fail, with tables as Markdown and CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from raychan.run.files.output import csv_bytes, write_whole
from raychan.study import (
    regimes_angle,
    regimes_bistatic,
    regimes_inside,
    regimes_leaks,
    regimes_material,
    regimes_mesh,
    regimes_rays,
    regimes_signal,
    regimes_worlds,
)
from raychan.study.regimes_base import Outcome, Regime, Row

Progress = Callable[[str, float], None]

REGIMES: tuple[Regime, ...] = (
    *regimes_angle.REGIMES,
    *regimes_bistatic.REGIMES,
    *regimes_leaks.REGIMES,
    *regimes_rays.REGIMES,
    *regimes_mesh.REGIMES,
    *regimes_inside.REGIMES,
    *regimes_material.REGIMES,
    *regimes_signal.REGIMES,
    *regimes_worlds.REGIMES,
)
HEADS = ("regime", "case", "expected", "seen", "tolerance", "unit", "passed", "truth", "note")


@dataclass(frozen=True)
class Tried:
    """The outcome of a regime, and the time it took [s]."""

    regime: Regime
    outcome: Outcome
    seconds: float

    @property
    def failed(self) -> list[Row]:
        """The rows that failed."""
        return [r for r in self.outcome.rows if not r.passed]


def stability(quick: bool = False, only: Sequence[str] = (), progress: Progress | None = None) -> list[Tried]:
    """Run all regimes, or those whose keys are in `only`; one that raises an error counts as a failing row.

    Args: quick leaves out the largest cases; progress is called with (title, share done).
    Raises: ValueError on unknown keys.
    """
    known = [r.key for r in REGIMES]
    unknown = [key for key in only if key not in known]
    if unknown:
        raise ValueError(f"unknown regime '{unknown[0]}': must be one of {', '.join(known)}")
    chosen = [r for r in REGIMES if not only or r.key in only]
    done = []
    for i, regime in enumerate(chosen):
        if progress:
            progress("regimes", i / len(chosen))
        since = perf_counter()
        try:
            outcome = regime.run(quick)
        except Exception as error:  # errors are findings of the study
            note = f"{type(error).__name__}: {error}"
            outcome = Outcome([Row("runs to its end", 1.0, 0.0, 0.0, "", "no exception", note)])
        done.append(Tried(regime, outcome, perf_counter() - since))
    if progress:
        progress("regimes", 1.0)
    return done


def cells(tried: Tried, row: Row) -> tuple[str, ...]:
    """Return a row as text, in the order of HEADS."""
    expected = f"<= {row.expected:.4g}" if row.bound else f"{row.expected:.6g}"
    passed = "pass" if row.passed else "FAIL"
    seen, tolerance = f"{row.seen:.6g}", "" if row.bound and not row.tolerance else f"{row.tolerance:.3g}"
    return tried.regime.title, row.name, expected, seen, tolerance, row.unit, passed, row.truth, row.note


def summary(done: Iterable[Tried]) -> list[tuple[str, ...]]:
    """Return a row of text a regime: title, checks, failures, worst case in tolerances, seconds."""
    out: list[tuple[str, ...]] = []
    for t in done:
        rows = t.outcome.rows
        share = f"{max((r.share for r in rows), default=0.0):.2g}"
        out.append((t.regime.title, str(len(rows)), str(len(t.failed)), share, f"{t.seconds:.1f}"))
    return out


def write_csv(done: Sequence[Tried], path: Path) -> Path:
    """Write all rows as CSV and return the path."""
    return write_whole(path, csv_bytes([HEADS, *(cells(t, r) for t in done for r in t.outcome.rows)]))


def write_markdown(done: Sequence[Tried], path: Path, figures: Sequence[str] = ()) -> Path:
    """Write the study as Markdown: summary, failures with their causes, figures, all rows; return the path."""
    rows = [(t, r) for t in done for r in t.outcome.rows]
    failed = [(t, r) for t, r in rows if not r.passed]
    text = [
        "# Stability where ray methods fail", "",
        f"{len(rows)} checks in {len(done)} regimes: {len(rows) - len(failed)} pass, {len(failed)} fail. "
        f"{sum(t.seconds for t in done):.0f} s.", "",
        *_table(("regime", "checks", "failures", "worst, in tolerances", "seconds"), summary(done)),
    ]  # fmt: skip
    if failed:
        text += ["", "## Failures", "", *_table(HEADS, [cells(t, r) for t, r in failed])]
    text += ["", *[f"![{name}]({name})" for name in figures]]
    for t in done:
        text += ["", f"## {t.regime.title}", "", (t.regime.run.__doc__ or "").strip(), ""]
        text += _table(HEADS[1:], [cells(t, r)[1:] for r in t.outcome.rows])
    return write_whole(path, ("\n".join(text) + "\n").encode())


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(heads) + " |", "|" + " --- |" * len(heads)]
    return lines + ["| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in rows]
