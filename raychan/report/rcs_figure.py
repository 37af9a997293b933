"""Picture of radar cross-sections against angle, with the stated error as a band."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.report.canvas import PALETTE, drawn_as, figure, style, verbatim

Floats = NDArray[np.float64]

_ROUNDING_DB = 20.0 * np.log10(np.finfo(float).eps)  # relative to the peak: lower values are rounding errors
MOST_CUTS = 8
"""Most cuts that are drawn as lines; more are drawn as a map."""


def rcs_picture(
    azimuth: Floats,
    elevation: Floats,
    dbsm: Floats,
    error_db: Floats,
    title: str,
    suffix: str = ".png",
    polar: bool = False,
) -> memoryview:
    """Draw RCS against angle and return the file's bytes; many elevations and azimuths at once become a map.

    Args: azimuth (a,) and elevation (e,) [deg], dbsm and error_db (e, a) [dBsm, dB]; title a line; suffix of the file;
    polar: in polar coordinates, at most MOST_CUTS cuts. A single angle is written as a number.
    """
    dbsm = np.where(dbsm > dbsm.max() + _ROUNDING_DB, dbsm, -np.inf)
    with style():
        made = figure(6.4, 6.0) if polar and dbsm.size > 1 else figure(7.6, 4.2)
        if dbsm.size == 1:
            _figure(made, azimuth[0], elevation[0], dbsm.item(), error_db.item(), title)
        elif len(azimuth) > 1 and len(elevation) > MOST_CUTS and not polar:
            _map(made, azimuth, elevation, dbsm, error_db, title)
        else:
            _cuts(made, azimuth, elevation, dbsm, error_db, title, polar)
        return drawn_as(made, suffix)


def _figure(made: Any, azimuth: float, elevation: float, dbsm: float, error: float, title: str) -> None:
    """Write the cross-section at one angle."""
    axes = made.add_subplot()
    axes.set_axis_off()
    axes.set_title(verbatim(title))
    error_text = "error unknown" if np.isnan(error) else f"± {error:.2g} dB"
    large = f"{dbsm:.2f} dBsm" if np.isfinite(dbsm) else "no return"
    small = f"{error_text}\n{10.0 ** (0.1 * dbsm):.4g} m²\nazimuth {azimuth:g} deg, elevation {elevation:g} deg"
    axes.text(0.5, 0.62, large, ha="center", va="center", fontsize=34, transform=axes.transAxes)
    axes.text(0.5, 0.28, small, ha="center", va="center", fontsize=12, linespacing=1.6, transform=axes.transAxes)


def _cuts(made: Any, azimuth: Floats, elevation: Floats, dbsm: Floats, error: Floats, title: str, polar: bool) -> None:
    """Draw a line for each elevation against azimuth, or, of one azimuth, a line against elevation."""
    angle, other, names = azimuth, elevation, ("azimuth", "elevation")
    if len(azimuth) == 1:
        angle, other, names, dbsm, error = elevation, azimuth, names[::-1], dbsm.T, error.T
    if polar and len(angle) > 2 and np.isclose(abs(2.0 * angle[-1] - angle[-2] - angle[0]), 360.0):
        angle, dbsm, error = (np.concatenate([x, x[..., :1]], axis=-1) for x in (angle, dbsm, error))  # a full turn
    axes = made.add_subplot(projection="polar" if polar else None)
    axes.set_title(verbatim(title))
    low, high = _limits(dbsm, error)
    for i, fixed in enumerate(other):
        label = f"{names[1]} {fixed:g} deg" if len(other) > 1 else "RCS"
        _line(axes, np.radians(angle) if polar else angle, dbsm[i], error[i], PALETTE[i % len(PALETTE)], label)
    axes.set_ylim(low, high)
    axes.grid(alpha=0.25, lw=0.5)
    if polar:
        axes.set_theta_zero_location("N" if names[0] == "azimuth" else "E")
        axes.set_rlabel_position(112.5)
        axes.set_xlabel(f"{names[0]} [deg], RCS [dBsm]")
    else:
        axes.set(xlabel=f"{names[0]} [deg]", ylabel="RCS [dBsm]", xlim=(angle.min(), angle.max()))
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.1)} if polar else {"loc": "best"}
    axes.legend(ncols=2 if len(other) > 4 else 1, title=_note(dbsm, error), title_fontsize=8, alignment="left", **place)


def _note(dbsm: Floats, error: Floats) -> str:
    """Return the legend's title: the stated errors, and the counts of angles without one."""
    known = error[np.isfinite(error)]
    parts = []
    if known.size:
        least, most = f"{known.min():.2g}", f"{known.max():.2g}"
        parts.append("band: stated error, " + (f"{least} to {most} dB" if least != most else f"{most} dB"))
    if unsure := error.size - known.size:
        parts.append(f"x: error unknown ({unsure} of {error.size} angles)")
    if silent := int((~np.isfinite(dbsm)).sum()):
        parts.append(f"gap: no return ({silent} of {dbsm.size} angles)")
    return "\n".join(parts)


def _limits(dbsm: Floats, error: Floats) -> tuple[float, float]:
    """Return the span [dBsm] of all values with their error bands."""
    real = np.isfinite(dbsm)
    if not real.any():
        return -100.0, -90.0
    band = np.where(np.isfinite(error), error, 0.0)[real]
    low, high = float((dbsm[real] - band).min()), float((dbsm[real] + band).max())
    room = max(1.0, 0.05 * (high - low))
    return low - room, high + room


def _line(axes: Any, angle: Floats, dbsm: Floats, error: Floats, colour: str, label: str) -> None:
    """Draw one cut over its error band; crosses where the error is unknown."""
    dbsm = np.where(np.isfinite(dbsm), dbsm, np.nan)
    axes.fill_between(angle, dbsm - error, dbsm + error, color=colour, alpha=0.3, lw=0)
    axes.plot(angle, dbsm, color=colour, lw=1.1, label=label)
    alone = np.isfinite(dbsm) & ~np.isfinite(np.r_[np.nan, dbsm[:-1]]) & ~np.isfinite(np.r_[dbsm[1:], np.nan])
    axes.plot(angle[alone], dbsm[alone], ".", ms=4, color=colour)
    unsure = np.isnan(error)
    axes.plot(angle[unsure], dbsm[unsure], "x", ms=5, mew=1.0, color=colour)


def _map(made: Any, azimuth: Floats, elevation: Floats, dbsm: Floats, error: Floats, title: str) -> None:
    """Draw RCS over both angles, with contours of a stated error of 1 dB; angles without a return stay white."""
    axes = made.add_subplot()
    axes.set_title(verbatim(title))
    shown = np.where(np.isfinite(dbsm), dbsm, np.nan)
    image = axes.pcolormesh(azimuth, elevation, shown, cmap="viridis", shading="nearest", rasterized=True)
    made.colorbar(image, ax=axes, label="RCS [dBsm]", pad=0.01, aspect=30)
    wide = np.where(np.isnan(error), np.inf, error)
    if wide.min() < 1.0 < wide.max():
        axes.contour(azimuth, elevation, wide, levels=[1.0], colors="white", linewidths=0.8)
        axes.annotate("white line: stated error 1 dB", (0.0, -0.16), xycoords="axes fraction", fontsize=8)
    axes.set(xlabel="azimuth [deg]", ylabel="elevation [deg]")
