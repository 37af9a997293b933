"""Pictures of a sweep: SNR and what hides the body against the varied value, or both as maps over two values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.report.canvas import PALETTE, figure, save, style, verbatim
from raychan.run.result import CLUTTER, DC, DIRECT, IMAGE, INTERFERENCE, MULTIPATH, SIDELOBE
from raychan.study.sweep import Sweep
from raychan.study.visibility import DIFFRACTED, WAYS

Floats = NDArray[np.float64]

_LOOK = {DIRECT: ("o", PALETTE[0]), MULTIPATH: ("^", PALETTE[2]), DIFFRACTED: ("s", PALETTE[5])}
_ELSE = {
    CLUTTER: ("X", PALETTE[7]), SIDELOBE: ("v", PALETTE[3]), DC: ("D", PALETTE[9]), IMAGE: ("P", PALETTE[8]),
    INTERFERENCE: ("*", PALETTE[6]),
}  # fmt: skip
_DEEPEST_DB = 40.0  # levels this far below the threshold are not drawn
_GREY = "#d9d9d9"


def sweep_picture(done: Sweep, path: Path) -> Path:
    """Draw a sweep over no, one or two axes and return the picture's path."""
    return _maps(done, path) if len(done.axes) == 2 else _lines(done, path)


def _title(done: Sweep) -> str:
    return verbatim(f"{done.title}: {done.target}" if done.title else done.target)


def _lines(done: Sweep, path: Path) -> Path:
    x = np.array([s.values[0] for s in done.steps]) if done.axes else np.zeros(1)
    order = np.argsort(x, kind="stable")
    with style():
        made = figure(8.2, 6.0)
        top, bottom = made.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
        _levels(top, done, x, order)
        _hidden(bottom, done, x, order)
        bottom.set_xlabel(verbatim(done.axes[0].label) if done.axes else "the scene as it is")
        if not done.axes:
            bottom.set_xticks([])
        if len(x) == 1:
            bottom.set_xlim(x[0] - 1.0, x[0] + 1.0)
        top.set_title(_title(done))
        for axes in (top, bottom):
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        return save(made, path)


def _levels(axes: Any, done: Sweep, x: Floats, order: NDArray[np.int64]) -> None:
    """Draw the detections with their stated errors over the levels of the three ways."""
    least = done.steps[0].min_snr_db
    lowest = least
    for way in WAYS:
        level = np.full(len(x), np.nan)
        for i, step in enumerate(done.steps):
            found = step.found.levels[way]
            if found is not None and found.margin_db is not None:
                level[i] = found.margin_db + step.min_snr_db
        shown = np.where(level > least - _DEEPEST_DB, level, np.nan)
        if np.isfinite(shown).any():
            lowest = min(lowest, float(np.nanmin(shown)))
            mark, colour = _LOOK[way]
            axes.plot(
                x[order], shown[order], color=colour, lw=1.2, marker=mark, ms=2.5, label=f"{way} return, no noise"
            )
    for label, (mark, colour) in (_LOOK | _ELSE).items():
        rows = [i for i in order if (seen := done.steps[i].seen) is not None and seen.label == label]
        if rows:
            snr = np.array([done.steps[i].seen.snr_db for i in rows])  # type: ignore[union-attr]
            error = np.array([done.steps[i].seen.error_db for i in rows])  # type: ignore[union-attr]
            axes.errorbar(x[rows], snr, error, ls="none", color=colour, lw=4.0, alpha=0.35)
            unknown = np.isnan(error)
            if unknown.any():
                axes.plot(
                    x[rows][unknown], snr[unknown], "_", ms=14, color=colour, ls="none",
                    label=f"{label}: not converged,\nerror unknown",
                )  # fmt: skip
            axes.plot(
                x[rows], snr, mark, ms=7, mfc="white", mec=colour, mew=1.6, ls="none",
                label=f"detected, {label}\n(bar: stated error)",
            )  # fmt: skip
    missed = [i for i in order if done.steps[i].seen is None]
    if missed:
        bottom = np.full(len(missed), 0.03)
        axes.plot(
            x[missed], bottom, "x", ms=6, color="#777777", ls="none", transform=axes.get_xaxis_transform(),
            label="not detected",
        )  # fmt: skip
    axes.axhline(least, color="#aa3333", lw=0.9, ls="--", label="least SNR that is reported")
    axes.set_ylabel("SNR [dB]")
    axes.set_ylim(bottom=lowest - 3.0)
    axes.grid(alpha=0.3, lw=0.5)


def _hidden(axes: Any, done: Sweep, x: Floats, order: NDArray[np.int64]) -> None:
    """Draw which bodies block which share of the outline, stacked, and the share seen through layers."""
    shares: dict[str, Floats] = {}
    for i, step in enumerate(done.steps):
        for name, part in step.found.occlusion.by:
            shares.setdefault(name, np.zeros(len(x)))[i] = 100.0 * part
    names = sorted(shares, key=lambda n: -float(shares[n].sum()))
    stack = [shares[n] for n in names]
    labels = [verbatim(f"behind {n}") for n in names]
    colours = [PALETTE[(4 + i) % len(PALETTE)] for i in range(len(names))]
    layers = np.array([100.0 * (s.found.occlusion.behind_layers or 0.0) for s in done.steps])
    if layers.any():
        stack, labels, colours = [*stack, layers], [*labels, "behind glass or\nthin layers only"], [*colours, "#9fc5d8"]
    base = np.zeros(len(x))
    for share, label, colour in zip(stack, labels, colours, strict=True):
        if len(x) == 1:
            axes.bar(x, share, bottom=base, width=0.2, color=colour, alpha=0.75, label=label)
        else:
            axes.fill_between(x[order], base[order], (base + share)[order], color=colour, alpha=0.75, lw=0, label=label)
        base = base + share
    total = "all of these" if stack else "nothing hides it"
    axes.plot(x[order], base[order], color="#333333", lw=0.8, marker=".", ms=3, label=total)
    axes.set(ylim=(0.0, 103.0), ylabel="share of outline [%]")
    axes.grid(alpha=0.3, lw=0.5)


def _maps(done: Sweep, path: Path) -> Path:
    down, across = (len(a.values) for a in done.axes)
    snr = np.array([np.nan if s.seen is None else s.seen.snr_db for s in done.steps]).reshape(down, across)
    shares = [s.found.occlusion.blocked for s in done.steps]
    blocked = np.array([np.nan if b is None else 100.0 * b for b in shares]).reshape(down, across)
    with style():
        made = figure(9.6, 4.4)
        left, right = made.subplots(1, 2)
        _map(made, left, done, snr, "SNR of the detection [dB]", "viridis", (None, None))
        _map(made, right, done, blocked, "blocked share of outline [%]", "magma_r", (0.0, 100.0))
        left.set_title("Detected (grey: not)")
        right.set_title("Blocked")
        _marks(left, done)
        made.suptitle(_title(done), fontsize=11, fontweight="bold")
        return save(made, path)


def _map(made: Any, axes: Any, done: Sweep, values: Floats, label: str, colours: str, limits: Any) -> None:
    y, x = (np.array(a.values) for a in done.axes)
    axes.set_facecolor(_GREY)
    image = axes.pcolormesh(_edges(x), _edges(y), values, cmap=colours, vmin=limits[0], vmax=limits[1])
    if np.isfinite(values).any():
        made.colorbar(image, ax=axes, label=label, pad=0.02, aspect=30)
    axes.set(xlabel=verbatim(done.axes[1].label), ylabel=verbatim(done.axes[0].label))


def _marks(axes: Any, done: Sweep) -> None:
    """Mark the label of each detection."""
    for label, (mark, _) in (_LOOK | _ELSE).items():
        at = np.array([s.values for s in done.steps if s.seen is not None and s.seen.label == label])
        if len(at):
            y, x = at.T
            axes.plot(x, y, mark, ms=4, mfc="white", mec="black", mew=0.7, ls="none", label=label)
    if any(s.seen is not None for s in done.steps):
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.14), ncols=3, borderaxespad=0.0)


def _edges(values: Floats) -> Floats:
    """Return the borders of cells about values that may rise or fall; a lone value gets a cell of its own."""
    if len(values) == 1:
        return values[0] + np.array([-0.5, 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2.0 * values[0] - middle[0]], middle, [2.0 * values[-1] - middle[-1]]])
