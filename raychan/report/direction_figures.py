"""Pictures of directions: the range-azimuth map, beams over single cells, and the pair that beams do not resolve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.range_azimuth import RangeAzimuth, beams_of
from raychan.report.canvas import PALETTE, figure, outlined, save, style
from raychan.run.explanation.directions import angles_in
from raychan.run.receiver import aperture_of
from raychan.run.result import Result
from raychan.study.close_pair import PairSweep
from raychan.units import dbm, watt

Floats = NDArray[np.float64]

_DYNAMIC_DB = 60.0  # most that is drawn below the peak
_BEAM_DB = 45.0  # the same of beams
_CELLS = 5  # cells of which beams are drawn


def direction_pictures(result: Result, folder: Path) -> list[Path]:
    """Draw range_azimuth.png and beams.png of a result into a folder; nothing where its array measures no azimuth."""
    angles = angles_in(result)
    if angles is None:
        return []
    made = [range_azimuth_picture(angles, folder / "range_azimuth.png", result)]
    return made + ([beams_picture(result, folder / "beams.png")] if len(result.detections.range) else [])


def range_azimuth_picture(angles: RangeAzimuth, path: str | Path, result: Result | None = None) -> Path:
    """Draw a range-azimuth map [dBm] as seen from above, with the detections of a result."""
    with style():
        made = figure(7.2, 4.2)
        axes = made.add_subplot()
        draw_range_azimuth(angles, axes, result)
        return save(made, path)


def draw_range_azimuth(angles: RangeAzimuth, axes: Any, result: Result | None = None) -> None:
    """Draw a range-azimuth map into axes: y to the left, x ahead, as the antenna sees them."""
    far = angles.range[-1]
    if result is not None and len(result.detections.range):
        far = min(far, max(5.0, 1.2 * float(result.detections.range.max())))
    keep = angles.range <= far
    power = dbm(np.maximum(angles.power[:, keep], watt(-300.0)))
    top = float(np.ceil(power.max() / 5.0) * 5.0)
    low = max(top - _DYNAMIC_DB, float(dbm(angles.noise)) - 3.0 if angles.noise > 0.0 else -np.inf)
    r, az = angles.range[keep], angles.azimuth
    x, y = r[None, :] * np.cos(az)[:, None], r[None, :] * np.sin(az)[:, None]
    image = axes.pcolormesh(
        y, x, power, vmin=low, vmax=max(top, low + 15.0), cmap="viridis", shading="gouraud", rasterized=True
    )
    axes.set(xlabel="y to the left [m]", ylabel="x ahead [m]", title="Range-azimuth map", aspect="equal")
    axes.set_xlim(float(y.max()), float(y.min()))
    # Of the height of the map, which equal scales make lower than its place in the figure.
    beside = axes.inset_axes((1.02, 0.0, 0.03, 1.0))
    axes.figure.colorbar(image, cax=beside, label="received power, strongest range rate [dBm]")
    if result is not None:
        d = result.detections
        seen = np.isfinite(d.azimuth)
        x, y = (d.range * np.cos(d.azimuth))[seen], (d.range * np.sin(d.azimuth))[seen]
        axes.plot(
            y, x, "o", ms=7, mfc="none", mec="white", mew=1.2, ls="none", path_effects=outlined(2.4),
            label=f"detections ({int(seen.sum())})",
        )  # fmt: skip
        if seen.any():
            axes.legend(loc="upper right", labelcolor="white", frameon=True, facecolor="#222222", framealpha=0.7)


def beams_picture(result: Result, path: str | Path) -> Path:
    """Draw the beams over the cells of the strongest detections, and their directions.

    Of a line each cell is a curve over azimuth; of an array that measures elevation too, the strongest cell is a map.
    """
    radar = result.require_scene().radar
    aperture, d = aperture_of(radar), result.detections
    with style():
        both = all(aperture.scans)
        made = figure(5.6 if both else 7.2, 4.6 if both else 4.2)
        axes = made.add_subplot()
        axes.invert_xaxis()  # left is left
        if both:
            _beam_map(result, aperture, axes)
            return save(made, path)
        cells = list(dict.fromkeys(map(tuple, d.cell.tolist())))[:_CELLS]
        peak = -np.inf
        for cell, colour in zip(cells, PALETTE, strict=False):
            u, _, power = beams_of(result.rdmap, cell, aperture)
            level = dbm(np.maximum(power[:, 0], watt(-300.0)))
            peak = max(peak, float(level.max()))
            mine = (d.cell == cell).all(axis=1)
            # By the detections' rates, which the receiver may have unfolded.
            place = f"{d.range[mine][0]:.1f} m, {round(d.rate[mine][0], 1) + 0.0:+.1f} m/s"
            axes.plot(np.degrees(np.arcsin(np.clip(u, -1.0, 1.0))), level, color=colour, lw=1.2, label=place)
            axes.plot(np.degrees(d.azimuth[mine]), dbm(d.power[mine]), "o", color=colour, ms=6, mec="black", mew=0.6)
        axes.set(xlabel="azimuth [deg]", ylabel="received power [dBm]", title="Beams over cells")
        axes.set_ylim(peak - _BEAM_DB, peak + 6.0)
        axes.grid(alpha=0.25, lw=0.5)
        axes.figure.legend(loc="outside right upper", title="cell; dots are detections")
        return save(made, path)


def _beam_map(result: Result, aperture: Any, axes: Any) -> None:
    d = result.detections
    u, w, power = beams_of(result.rdmap, d.cell[0], aperture)
    level = dbm(np.maximum(power, watt(-300.0)))
    top = float(np.nanmax(level))
    image = axes.pcolormesh(u, w, level.T, vmin=top - _BEAM_DB, vmax=top, cmap="viridis", shading="nearest")
    axes.figure.colorbar(image, ax=axes, label="received power [dBm]", pad=0.01, aspect=30)
    mine = (d.cell == d.cell[0]).all(axis=1)
    up, side = np.sin(d.elevation[mine]), np.cos(d.elevation[mine]) * np.sin(d.azimuth[mine])
    axes.plot(side, up, "o", ms=8, mfc="none", mec="white", mew=1.2, path_effects=outlined(2.4))
    axes.set(
        xlabel="cos(elevation) sin(azimuth)", ylabel="sin(elevation)", aspect="equal",
        title=f"Beams over the cell at {d.range[0]:.1f} m, {d.rate[0]:+.1f} m/s",
    )  # fmt: skip


def pair_picture(sweep: PairSweep, path: str | Path) -> Path:
    """Draw over which relative phases beams and MUSIC resolve a pair, and the directions that each shows."""
    with style():
        made = figure(7.2, 6.0)
        panels = made.subplots(2, 1, sharex=True, sharey=True)
        for axes, (name, found, share) in zip(panels, sweep.methods(), strict=True):
            for phase, angles in zip(np.degrees(sweep.phase), found, strict=True):
                two = len(angles) == 2
                colour = PALETTE[0] if two else PALETTE[2]
                axes.plot(np.full(len(angles), phase), np.degrees(angles), "o", ms=3.0, color=colour)
            for truth in np.degrees(sweep.azimuth):
                axes.axhline(truth, color="black", lw=0.7, ls="--")
            axes.set(ylabel="azimuth [deg]", title=f"{name}: two directions over {100.0 * share:.0f} % of phases")
            axes.grid(alpha=0.25, lw=0.5)
        panels[-1].set(xlabel="relative phase of the two echoes at the array's centre [deg]")
        return save(made, path, flat=True)
