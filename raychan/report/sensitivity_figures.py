"""Picture of a sensitivity study: the spread of each level beside the error that it states."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from raychan.report.canvas import PALETTE, figure, save, style, verbatim
from raychan.study.detection_tracks import NOISE
from raychan.study.sensitivity import ERROR, INTERMITTENT, SPECKLE, STEADY, VERDICTS, Moves, Sensitivity

_COLOUR = {
    STEADY: PALETTE[1], SPECKLE: PALETTE[4], ERROR: PALETTE[2], INTERMITTENT: PALETTE[6], NOISE: "#bbbbbb",
}  # fmt: skip
_MOST = 40  # detections that a picture shows, the strongest: more labels cannot be read
_LONGEST = 46  # letters of a label
_STATED = "#444444"


def sensitivity_picture(done: Sensitivity, path: Path) -> Path:
    """Draw two bars a detection, spread and stated error, and return the picture's path."""
    shown = done.moves[:_MOST]
    y = np.arange(len(shown))
    verdicts = [m.verdict(done.tolerance_db) for m in shown]
    with style():
        made = figure(8.6, 1.9 + 0.34 * max(len(shown), 3))
        axes = made.subplots()
        spreads = [0.0 if math.isnan(m.spread()) else m.spread() for m in shown]
        for verdict in VERDICTS:
            rows = [i for i, v in enumerate(verdicts) if v == verdict]
            if rows:
                bars = [spreads[i] for i in rows]
                axes.barh(y[rows] - 0.19, bars, 0.38, color=_COLOUR[verdict], label=f"spread (rms): {verdict}")
        known = [i for i, m in enumerate(shown) if math.isfinite(m.stated_db)]
        errors = [shown[i].stated_db for i in known]
        axes.barh(
            y[known] + 0.19, errors, 0.38, color="white", edgecolor=_STATED, hatch="////", label="stated error (median)"
        )
        longest = max([done.tolerance_db, *spreads, *errors])
        for i in sorted(set(range(len(shown))) - set(known)):
            axes.text(0.01 * longest, i + 0.19, "error unknown", fontsize=6, va="center", color=_STATED)
        for i, m in enumerate(shown):
            if m.count < m.draws:
                text = f"seen in {m.count} of {m.draws} draws"
                axes.text(spreads[i] + 0.01 * longest, i - 0.19, text, fontsize=6, va="center", color=_STATED)
        line = f"tolerance, {done.tolerance_db:g} dB"
        axes.axvline(done.tolerance_db, color="#aa3333", lw=0.9, ls="--", label=line)
        axes.set_yticks(y, [_name(i, m) for i, m in enumerate(shown)], fontsize=7)
        axes.set(
            xlabel="spread and stated error of the level [dB]",
            xlim=(0.0, 1.25 * longest),
            ylim=(max(len(shown), 1) - 0.5, -0.5),
        )
        axes.grid(axis="x", alpha=0.3, lw=0.5)
        rest = f"; the strongest {_MOST} of {len(done.moves)}" if len(done.moves) > _MOST else ""
        g = done.given
        tolerances = f"turns of {g.turn_deg:g} deg, shifts of {g.shift_mm:g} mm (rms), {g.draws} draws{rest}"
        axes.set_title(f"{verbatim(done.title)}\n{tolerances}" if done.title else tolerances, fontsize=9)
        made.legend(loc="outside lower center", ncols=3)
        return save(made, path, flat=True)


def _name(row: int, m: Moves) -> str:
    first = m.track.first
    bodies = first.bodies if len(first.bodies) <= _LONGEST else f"{first.bodies[: _LONGEST - 3]}..."
    return f"{verbatim(bodies)}  {first.range:.1f} m  {first.rate:+.1f} m/s  #{row + 1}"
