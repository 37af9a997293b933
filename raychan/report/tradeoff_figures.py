"""Pictures of the trade-off: error against rays and seconds, a figure a case, and one of all with their fronts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from raychan.report.canvas import PALETTE, figure, save, style
from raychan.study.methods import ADAPTIVE, METHODS, MIRRORS, POINT, POINTS, UNIFORM
from raychan.study.tradeoff import Row

_LOOK = {
    ADAPTIVE: ("o", PALETTE[4]),
    UNIFORM: ("s", PALETTE[0]),
    POINT: ("^", PALETTE[2]),
    MIRRORS: ("D", PALETTE[5]),
    POINTS: ("X", PALETTE[6]),
}
_LOW, _HIGH = 0.01, 60.0
_TICKS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30)


def case_picture(rows: Sequence[Row], path: Path) -> Path:
    """Draw one case: error in dB against rays (left) and seconds (right)."""
    with style():
        made = figure(9.0, 4.4)
        left, right = made.subplots(1, 2, sharey=True)
        for axes, key in ((left, "rays"), (right, "seconds")):
            _lines(axes, rows, key)
            axes.set_xlabel("rays, all views" if key == "rays" else "seconds, all views")
        left.set_ylabel("rms error [dB]")
        made.suptitle(f"{rows[0].title}\n", fontsize=11, fontweight="bold")
        left.set_title(f"reference: {rows[0].truth}", fontsize=7, loc="left", fontweight="normal", color="#555555")
        handles, names = left.get_legend_handles_labels()
        made.legend(handles, names, loc="outside lower center", ncols=4)
        return save(made, path, flat=True)


def summary_picture(rows: Sequence[Row], path: Path, earlier: Sequence[Row] = ()) -> Path:
    """Draw all cases, error against seconds, with their Pareto fronts and those of an `earlier` run."""
    cases = list(dict.fromkeys(r.case for r in rows))
    across = min(3 if len(cases) <= 6 else 4, len(cases))
    down = -(-len(cases) // across)
    with style():
        made = figure(3.7 * across + 0.3, 2.9 * down + 0.8)
        grid = np.atleast_1d(made.subplots(down, across, sharey=True, squeeze=False)).ravel()
        for axes, name in zip(grid, cases, strict=False):
            mine = [r for r in rows if r.case == name]
            _front(axes, mine, color="#bbbbbb", lw=5, alpha=0.6, zorder=1, label="front")
            old = [r for r in earlier if r.case == name]
            _front(axes, old, color="#555555", lw=1.2, ls="--", zorder=2, label="front of the earlier run")
            _defaults(axes, old, "seconds", mfc="none", mew=1.2, label="its default setting")
            _lines(axes, mine, "seconds")
            axes.set_xlim(*_span([max(r.seconds, 1e-5) for r in mine + [r for r in old if r.default]]))
            axes.set_title(mine[0].title, fontsize=9)
        for axes in grid[len(cases) :]:
            axes.set_visible(False)
        for i, axes in enumerate(grid[: len(cases)]):
            if i % across == 0:
                axes.set_ylabel("rms error [dB]")
            if i + across >= len(cases):
                axes.set_xlabel("seconds, all views")
        # An earlier run may lack the first case.
        known = {name: handle for axes in grid for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
        made.legend(known.values(), known.keys(), loc="outside lower center", ncols=min(across + 1, 4))
        return save(made, path, flat=True)


def _front(axes: Any, rows: Sequence[Row], **look: Any) -> None:
    """Draw the front of error against seconds as steps."""
    front = sorted((r for r in rows if r.front_seconds), key=lambda r: r.seconds)
    if front:
        x, y = [max(r.seconds, 1e-5) for r in front], [_shown(max(r.error_db, r.truth_db)) for r in front]
        axes.step([*x, 1e3], [*y, y[-1]], where="post", **look)


def _defaults(axes: Any, rows: Sequence[Row], key: str, label: str, **look: Any) -> None:
    """Mark the default settings by stars."""
    for i, r in enumerate(r for r in rows if r.default):
        x, y = max(float(getattr(r, key)), 1e-5), _shown(r.error_db)
        axes.plot(x, y, "*", ms=15, mec="black", ls="none", zorder=5, label=label if i == 0 else None, **look)


def _shown(error: float) -> float:
    return min(max(error, _LOW), _HIGH)


def _lines(axes: Any, rows: Sequence[Row], key: str) -> None:
    """Draw every method as a marked line over its settings; the default as a star; the reference's error, shaded."""
    for method in METHODS:
        mine = sorted((r for r in rows if r.method == method), key=lambda r: float(getattr(r, key)))
        x = [max(float(getattr(r, key)), 1e-5) for r in mine]
        mark, colour = _LOOK[method]
        axes.plot(x, [_shown(r.error_db) for r in mine], marker=mark, color=colour, ms=5, lw=1.2, label=method)
    _defaults(axes, rows, key, mfc="#ffd54a", mew=0.8, label="default setting")
    axes.axhspan(_LOW / 2, rows[0].truth_db, color="#eeeeee", lw=0, zorder=0, label="below the error of the reference")
    axes.set(xscale="log", yscale="log", ylim=(_LOW * 0.8, _HIGH * 1.3))
    axes.set_xlim(*_span([max(float(getattr(r, key)), 1e-5) for r in rows]))
    axes.set_yticks(_TICKS, [f"≤ {t:g}" if t == _LOW else f"{t:g}" for t in _TICKS])
    axes.minorticks_off()
    axes.grid(alpha=0.3, lw=0.5)


def _span(values: Sequence[float]) -> tuple[float, float]:
    return min(values) / 2.0, max(values) * 3.0
