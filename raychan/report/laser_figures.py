"""Pictures of the laser scanner study: range errors against sensor errors, late records, detection on a moving deck."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from raychan.report.canvas import PALETTE, figure, save, style
from raychan.study.laser_detection import AMPLITUDES, BEARINGS, GRID, Detection, abeam_in_closed_form
from raychan.study.laser_errors import ALL, BODIES, SOURCES, TYPICAL, UNITS, Effect, skew

FIGURES = ("laser_errors.png", "laser_typical.png", "laser_skew.png", "laser_detection.png")
_GROUPS = (("roll", "pitch", "yaw"), ("x", "y", "z"), ("delay",))
_RATES = (1.0, 2.0, 5.0, 10.0)  # deg/s
_DELAYS = np.linspace(0.0, 0.2, 21)
_FINE = np.linspace(0.0, AMPLITUDES[-1], 401)


def laser_pictures(made: Sequence[Effect], found: Sequence[Detection], folder: Path) -> list[Path]:
    """Draw the study's figures into a folder; return their paths."""
    paths = [folder / name for name in FIGURES]
    with style():
        return [_errors(made, paths[0]), _typical(made, paths[1]), _skew(paths[2]), _detection(found, paths[3])]


def _errors(made: Sequence[Effect], path: Path) -> Path:
    """Draw the deviation of the range over that of each source: lines are first order, marks Monte Carlo."""
    drawn = figure(9.0, 5.4)
    for row, (body, plots) in enumerate(zip(BODIES, drawn.subplots(2, 3), strict=True)):
        for axes, group in zip(plots, _GROUPS, strict=True):
            for source in group:
                _curve(axes, [e for e in made if e.body == body and e.source == source], source)
            axes.set(xscale="log", yscale="log")
            axes.grid(alpha=0.25, lw=0.5)
            axes.legend(title=f"ranges of the {body}", title_fontsize=8)
            if row == 1:
                axes.set_xlabel(f"standard deviation [{UNITS[group[0]]}]")
        plots[0].set_ylabel("standard deviation of the range [m]")
    drawn.suptitle(
        "Range error by sensor errors: first order (lines), Monte Carlo (marks)", fontweight="bold", fontsize=10
    )
    return save(drawn, path, flat=True)


def _curve(axes: Any, effects: Sequence[Effect], source: str) -> None:
    some = [e for e in effects if e.first_order > 0.0]
    if some:
        colour, sigma = PALETTE[SOURCES.index(source)], [e.sigma for e in some]
        axes.plot(sigma, [e.first_order for e in some], "-", lw=1.0, color=colour, label=source)
        axes.plot(sigma, [e.monte_carlo for e in some], "o", ms=4, mfc="none", color=colour)


def _typical(made: Sequence[Effect], path: Path) -> Path:
    """Draw first order and Monte Carlo beside each other at typical errors of each source, and of all."""
    drawn = figure(8.4, 3.4)
    names = [*(f"{s}\n{TYPICAL[s]:g} {UNITS[s]}" for s in SOURCES), "all"]
    for axes, body in zip(drawn.subplots(1, 2), BODIES, strict=True):
        some = [_at_typical(made, body, source) for source in (*SOURCES, ALL)]
        for k, (label, colour) in enumerate((("first order", PALETTE[0]), ("Monte Carlo", PALETTE[2]))):
            axes.bar(np.arange(len(some)) + 0.4 * k - 0.2, [s[k] for s in some], 0.38, color=colour, label=label)
        axes.set_xticks(range(len(names)), names, fontsize=7)
        axes.set(ylabel="standard deviation of the range [m]", title=f"Ranges of the {body}")
        axes.grid(axis="y", alpha=0.25, lw=0.5)
        axes.legend()
    return save(drawn, path, flat=True)


def _at_typical(made: Sequence[Effect], body: str, source: str) -> tuple[float, float]:
    """Return first order and Monte Carlo [m] at the typical error, interpolated between the charted ones."""
    some = [e for e in made if e.body == body and e.source == source]
    if source == ALL:
        return some[0].first_order, some[0].monte_carlo
    sigma = [e.sigma for e in some]
    first, other = (
        float(np.interp(TYPICAL[source], sigma, [getattr(e, f) for e in some])) for f in ("first_order", "monte_carlo")
    )
    return first, other


def _skew(path: Path) -> Path:
    """Draw the range error of a late roll over its delay."""
    drawn = figure(5.6, 3.4)
    axes = drawn.add_subplot()
    for rate, colour in zip(_RATES, PALETTE, strict=False):
        seen, first = skew(rate, _DELAYS)
        axes.plot(1e3 * _DELAYS, first, "-", lw=1.0, color=colour, label=f"{rate:g} deg/s")
        axes.plot(1e3 * _DELAYS, seen, "o", ms=3.5, mfc="none", color=colour)
    axes.set(xlabel="delay of the recorded roll [ms]", ylabel="range error of the sea abeam [m]")
    axes.set_title("Late records: rate times delay (lines), simulated (marks)")
    axes.grid(alpha=0.25, lw=0.5)
    axes.legend(title="roll rate", title_fontsize=8)
    return save(drawn, path, flat=True)


def _detection(found: Sequence[Detection], path: Path) -> Path:
    """Draw the detection probability over the amplitude of roll, of pitch, and of both."""
    drawn = figure(10.2, 3.4)
    *plots, chart = drawn.subplots(1, 3)
    for axes, along, across in zip(plots, ("roll", "pitch"), ("pitch", "roll"), strict=True):
        for bearing, colour in zip(BEARINGS, PALETTE, strict=False):
            some = [d for d in found if d.bearing == bearing and getattr(d, across) == 0.0]
            some.sort(key=lambda d: float(getattr(d, along)))
            axes.plot(
                [getattr(d, along) for d in some], [d.probability for d in some], "o", ms=3.5, mfc="none", color=colour,
                label=f"target at {bearing:g} deg",
            )  # fmt: skip
        axes.plot(_FINE, abeam_in_closed_form(_FINE), "-", lw=0.8, color="#444444", label="2/π asin(e/A)")
        axes.set(xlabel=f"amplitude of {along} [deg]", ylabel="detection probability", ylim=(0.0, 1.05))
        axes.grid(alpha=0.25, lw=0.5)
        axes.legend(loc="lower left")
    both = {(d.roll, d.pitch): d.probability for d in found if d.bearing == BEARINGS[1]}
    image = chart.pcolormesh(
        GRID, GRID, [[both[float(r), float(p)] for r in GRID] for p in GRID], vmin=0.0, vmax=1.0, shading="nearest"
    )
    chart.set(
        xlabel="amplitude of roll [deg]", ylabel="amplitude of pitch [deg]", title=f"target at {BEARINGS[1]:g} deg"
    )
    drawn.colorbar(image, ax=chart, label="detection probability", pad=0.02, aspect=25)
    return save(drawn, path)
