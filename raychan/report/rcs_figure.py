"""Picture of radar cross-sections against angle, with the stated error as a band."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.report.canvas import PALETTE, figure, save, style

Floats = NDArray[np.float64]

_RANGE_DB = 80.0
_LINES = 8


def rcs_picture(
    azimuth: Floats, elevation: Floats, dbsm: Floats, error_db: Floats, title: str, path: str | Path
) -> Path:
    """Draw RCS against angle; many elevations and azimuths at once become a map.

    Args: azimuth (a,) and elevation (e,) [deg], dbsm and error_db (e, a) [dBsm, dB]; title a line; path of the picture.
    """
    low, high = _limits(dbsm, error_db)
    with style():
        made = figure(7.6, 4.2)
        axes = made.add_subplot()
        axes.set_title(title)
        if len(azimuth) > 1 and len(elevation) > _LINES:
            _map(made, axes, azimuth, elevation, np.clip(dbsm, low, high), error_db)
        else:
            across = len(azimuth) > 1 or len(elevation) == 1
            angle, other, names = azimuth, elevation, ("azimuth", "elevation")
            if not across:
                angle, other, names, dbsm, error_db = elevation, azimuth, names[::-1], dbsm.T, error_db.T
            for i, fixed in enumerate(other):
                label = f"{names[1]} {fixed:g} deg" if len(other) > 1 else "RCS"
                _line(axes, angle, np.clip(dbsm[i], low, high), error_db[i], PALETTE[i % len(PALETTE)], label)
            if len(angle) > 1:
                axes.set_xlim(angle.min(), angle.max())
            axes.set(xlabel=f"{names[0]} [deg]", ylabel="RCS [dBsm]")
            axes.set_ylim(low, high)
            axes.grid(alpha=0.25, lw=0.5)
            mark = "band" if len(angle) > 1 else "bar"
            known = error_db[np.isfinite(error_db)]
            least, most = (f"{x:.2g}" for x in (known.min(initial=np.inf), known.max(initial=0.0)))
            note = (
                f"{mark}: stated error, {least} to {most} dB" if least != most else f"{mark}: stated error, {most} dB"
            )
            if not known.size:
                note = "no stated error"
            if known.size < error_db.size:
                axes.plot([], [], "o", mfc="none", color="black", label="error unknown")
            axes.legend(loc="best", ncols=2 if len(other) > 4 else 1, title=note, title_fontsize=8, alignment="left")
        return save(made, path)


def _limits(dbsm: Floats, error_db: Floats) -> tuple[float, float]:
    """Return the span of RCS worth drawing [dBsm]."""
    real = np.isfinite(dbsm)
    if not real.any():
        return -100.0, -90.0
    top, least = float(dbsm[real].max()), float(dbsm[real].min())
    room = max(3.0, min(6.0, float(np.nan_to_num(error_db[real & (dbsm == top)]).max(initial=0.0))))
    return max(least, top - _RANGE_DB) - room, top + room


def _line(axes: Any, angle: Floats, dbsm: Floats, error: Floats, colour: str, label: str) -> None:
    """Draw one cut: a line, or a point where there is one angle, over its band of error."""
    known = np.isfinite(error)
    if len(angle) == 1:
        filled = {} if known.all() else {"mfc": "none"}
        axes.errorbar(angle, dbsm, yerr=np.nan_to_num(error), fmt="o", color=colour, capsize=4, label=label, **filled)
        return
    axes.plot(angle[~known], dbsm[~known], "o", ms=4, mfc="none", color=colour)
    axes.fill_between(angle, dbsm - error, dbsm + error, color=colour, alpha=0.3, lw=0)
    axes.plot(angle, np.where(known, dbsm, np.nan), color=colour, lw=1.1, label=label)


def _map(made: Any, axes: Any, azimuth: Floats, elevation: Floats, dbsm: Floats, error: Floats) -> None:
    """Draw RCS over both angles, and contours where the stated error passes 1 dB."""
    image = axes.pcolormesh(azimuth, elevation, dbsm, cmap="viridis", shading="nearest", rasterized=True)
    made.colorbar(image, ax=axes, label="RCS [dBsm]", pad=0.01, aspect=30)
    # What is not known is above any error.
    error = np.where(np.isfinite(error), error, np.inf)
    if error.min() < 1.0 < error.max():
        axes.contour(azimuth, elevation, error, levels=[1.0], colors="white", linewidths=0.8)
        axes.annotate("white: stated error 1 dB", (0.0, -0.16), xycoords="axes fraction", fontsize=8)
    axes.set(xlabel="azimuth [deg]", ylabel="elevation [deg]")
