"""Conclusions of the trade-off study: whether default settings are on the Pareto front, and their saving over point
samples."""

from __future__ import annotations

from collections.abc import Sequence

from raychan.study.methods import POINT
from raychan.study.tradeoff import Row, beaten_by

EQUAL_DB = {"sphere": 0.5, "car": 1.0}
"""Errors at which the default and point samples are compared [dB]."""
_NAMED = 3  # most settings that are named as better than the default


def verdicts(rows: Sequence[Row]) -> list[str]:
    """Return lines for people: the default of each case on both fronts, and its gain over point samples."""
    lines = []
    for row in (r for r in rows if r.default):
        lines.append(f"default on {row.title if row.case == 'all' else row.case}: {_cost(row)}")
        lines += [f"  {key}: {_place(rows, row, key)}" for key in ("rays", "seconds")]
    return lines + [_gain(rows, case, level) for case, level in EQUAL_DB.items() if any(r.case == case for r in rows)]


def _cost(r: Row) -> str:
    return f"{r.error_db:.2f} dB, {r.rays:,.0f} rays, {r.seconds:.3g} s"


def _place(rows: Sequence[Row], row: Row, key: str) -> str:
    better = sorted(beaten_by(rows, row, key), key=lambda r: (r.error_db, getattr(r, key)))
    # A single launch is half of the default: it gives the value, but no error.
    halves = [r for r in better if r.method == row.method and "launch" in r.setting]
    others = [r for r in better if r not in halves]
    if others:
        named = "; ".join(_named(rows, r) for r in others[:_NAMED])
        return f"beaten by {named}" + (f"; and {len(others) - _NAMED} more" if len(others) > _NAMED else "")
    if halves:
        return f"on the front but for single launches of its own, which state no error ({_cost(halves[0])})"
    return "on the front"


def _named(rows: Sequence[Row], r: Row) -> str:
    """Return a setting in words, with its cost and the case on which it fails."""
    same = [o for o in rows if (o.method, o.setting) == (r.method, r.setting) and o.case not in (r.case, "all")]
    worst = max(same, key=lambda o: o.error_db, default=None)
    fails = f", but {worst.error_db:.2f} dB off on {worst.case}" if worst and worst.error_db > 2.0 * r.error_db else ""
    return f"{r.method}, {r.setting} ({_cost(r)}{fails})"


def _gain(rows: Sequence[Row], case: str, level: float) -> str:
    """Return in words the rays and seconds, relative to the default, that point samples need to stay within `level`."""
    ours = next(r for r in rows if r.case == case and r.default)
    points = sorted((r for r in rows if r.case == case and r.method == POINT), key=lambda r: r.rays)
    kept = next((i for i in range(len(points)) if all(r.error_db <= level for r in points[i:])), None)
    at = points[-1] if kept is None else points[kept]
    found = f"never, {at.error_db:.2f} dB at {at.rays:,.0f} rays" if kept is None else f"from {at.rays:,.0f} rays on"
    rays, seconds = (f"{x:.0f}" if x >= 10.0 else f"{x:.1f}" for x in (at.rays / ours.rays, at.seconds / ours.seconds))
    times = f"{rays} times the rays and {seconds} times the time"
    reach = "" if ours.error_db <= level else ", which does not reach it either"
    return f"point samples within {level:g} dB on {case}: {found}: {times} of the default ({_cost(ours)}){reach}"
