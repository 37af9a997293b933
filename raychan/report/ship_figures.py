"""Pictures of a ship's voyage: scans over time, track with what beams met, heading and roll."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.report.canvas import PALETTE, Placer, figure, save, style, verbatim
from raychan.run.ship.files import COLUMNS, ShipLog
from raychan.run.ship.scene import ShipScene
from raychan.sensors.laser import NO_BODY, SEA

Floats = NDArray[np.float64]

SEA_COLOUR = "#c3dbe8"
_GREY = "#f2f2f2"
_NAMED = 12  # bodies that a legend lists
_LETTERS = 24  # of a name in a legend
_SMALL = 0.01  # of a track's picture: a body below is marked
_ARROWS = 8  # arrows of the heading along a track


def colours(names: list[str]) -> dict[int, str]:
    """Return the colour of each body by its number, and that of the sea."""
    return {i: PALETTE[i % len(PALETTE)] for i in range(len(names))} | {SEA: SEA_COLOUR}


def _column(log: ShipLog, name: str) -> Floats:
    return log.row[:, COLUMNS.index(name)]


def scan_picture(scene: ShipScene, log: ShipLog, path: str | Path) -> Path:
    """Draw the scans of a voyage against time: range, what was met, and below them heading and roll."""
    angles, time = np.degrees(scene.scanner.angles), _column(log, "t_s")
    extent = (time[0], time[-1] + scene.scanner.duration, angles[0], angles[-1])
    with style():
        made = figure(9.0, 7.6)
        ranges, met, motion = made.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [3, 2.2, 1.3]})
        seen = np.ma.masked_invalid(np.where(np.isfinite(log.range), log.range, np.nan)).T
        top = scene.scanner.max_range
        image = ranges.imshow(
            seen, origin="lower", aspect="auto", extent=extent, cmap="viridis_r", vmin=0.0, vmax=top,
            interpolation="nearest",
        )  # fmt: skip
        ranges.set_facecolor(_GREY)
        made.colorbar(image, ax=ranges, label="range [m]", pad=0.01, aspect=18)
        every = "" if log.stride == 1 else f": one scan of {log.stride} shown"
        ranges.set(ylabel="beam [deg]\nstarboard < 0 < port", title=verbatim(f"{scene.title or 'Scans'}{every}"))
        _what(scene, log, met, extent)
        _motion(log, motion)
        motion.set_xlim(extent[:2])
        return save(made, path)


def _what(scene: ShipScene, log: ShipLog, axes: Any, extent: Any) -> None:
    """Draw which body each beam met, with a legend of those that any did."""
    shades, names = colours(scene.names), dict(enumerate(scene.names)) | {SEA: "sea"}
    image = np.empty((*log.body.shape, 3))
    image[:] = _rgb(_GREY)
    found = [int(b) for b in np.unique(log.body) if b != NO_BODY]
    for b in found:
        image[log.body == b] = _rgb(shades[b])
    axes.imshow(image.swapaxes(0, 1), origin="lower", aspect="auto", extent=extent, interpolation="nearest")
    axes.set(ylabel="beam [deg]")
    for b in found[:_NAMED]:
        axes.plot([], [], "s", ms=8, color=shades[b], label=verbatim(_short(names[b])))
    if found:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _short(name: str) -> str:
    """Return a body's name as a legend has room for it."""
    return name if len(name) <= _LETTERS else f"{name[: _LETTERS - 3]}..."


def _rgb(colour: str) -> Floats:
    """Return the red, green and blue (3,), 0 to 1, of a colour '#rrggbb'."""
    return np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


def _motion(log: ShipLog, axes: Any) -> None:
    """Draw heading and roll against time on two scales."""
    time = _column(log, "t_s")
    axes.plot(time, _unbroken(log.wanted), color="#aaaaaa", lw=1.0, ls="--", label="heading wanted")
    axes.plot(time, _unbroken(_column(log, "heading_deg")), color=PALETTE[0], lw=1.4, label="heading")
    axes.set(xlabel="time [s]", ylabel="heading [deg]")
    roll = axes.twinx()
    roll.plot(time, _column(log, "roll_deg"), color=PALETTE[2], lw=0.9, label="roll")
    roll.set_ylabel("roll [deg]", color=PALETTE[2])
    roll.spines["right"].set_visible(True)
    lines = [*axes.get_lines(), *roll.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)


def _unbroken(heading: Floats) -> Floats:
    """Return headings [deg] without jumps from 360 to 0."""
    return np.asarray(np.unwrap(heading, period=360.0))


def motion_picture(scene: ShipScene, log: ShipLog, path: str | Path) -> Path:
    """Draw heading, roll, rudder and speed against time."""
    time, series = _column(log, "t_s"), ("heading_deg", "roll_deg", "rudder_deg", "speed_mps")
    labels = ("heading [deg]", "roll [deg]\nstarboard down > 0", "rudder [deg]", "speed [m/s]")
    with style():
        made = figure(8.2, 6.4)
        for k, (axes, name, label) in enumerate(zip(made.subplots(4, 1, sharex=True), series, labels, strict=True)):
            values = _column(log, name)
            if name == "heading_deg":
                values = _unbroken(values)
                axes.plot(time, _unbroken(log.wanted), color="#aaaaaa", ls="--", lw=1.0, label="wanted")
                axes.legend(["wanted"], loc="lower right", bbox_to_anchor=(1.0, 1.0))
            axes.plot(time, values, color=PALETTE[k], lw=1.2)
            axes.set_ylabel(label)
            axes.grid(alpha=0.3)
            axes.margins(x=0.0)
        made.axes[0].set_title(verbatim(scene.title or "Voyage"))
        made.axes[-1].set_xlabel("time [s]")
        return save(made, path, flat=True)


def track_picture(scene: ShipScene, log: ShipLog, path: str | Path) -> Path:
    """Draw the track from above, north up and east to the right, with the points that beams met and the bodies."""
    names, shades = dict(enumerate(scene.names)) | {SEA: "sea"}, colours(scene.names)
    east, north = -_column(log, "y_m"), _column(log, "x_m")
    with style():
        made = figure(7.6, 7.2)
        axes = made.add_subplot()
        facets = scene.bodies.facets()
        for b in range(len(scene.names)):
            # The outline of a body from above: its triangles, filled.
            corners = facets.vertices[facets.body == b]
            for corner in corners if len(corners) < 4000 else corners[:: len(corners) // 2000]:
                axes.fill(-corner[:, 1], corner[:, 0], color="#c8c4ba", lw=0.0, zorder=1)
        found = sorted({int(b) for b in log.hit_body}, key=lambda b: b != SEA)
        for b in found:
            mine = log.hits[log.hit_body == b]
            size, layer = (1.2, 2) if b == SEA else (4.0, 3)
            label = verbatim(_short(names[b])) if len(found) <= _NAMED else None
            axes.plot(
                -mine[:, 1], mine[:, 0], ".", ms=size, color=shades[b], rasterized=True, zorder=layer, label=label
            )
        axes.plot(east, north, color="black", lw=1.2, zorder=4, label="track")
        _arrows(axes, log, east, north)
        axes.annotate("start", (east[0], north[0]), xytext=(6, -3), textcoords="offset points", fontsize=8)
        axes.set(xlabel="east [m]", ylabel="north [m]", title=verbatim(scene.title or "Track"), aspect="equal")
        axes.grid(alpha=0.3)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), markerscale=3.0)
        _mark_small(axes, scene, east, north)
        return save(made, path)


def _arrows(axes: Any, log: ShipLog, east: Floats, north: Floats) -> None:
    """Draw the heading at some places of the track."""
    span = max(float(np.ptp(east)), float(np.ptp(north)), 1.0)
    at = np.linspace(0, len(east) - 1, _ARROWS + 1).astype(int)[1:]
    for k in at:
        heading = np.radians(_column(log, "heading_deg")[k])
        tip = 0.05 * span * np.array([np.sin(heading), np.cos(heading)])
        axes.annotate(
            "", (east[k] + tip[0], north[k] + tip[1]), (east[k], north[k]), zorder=5,
            arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 1.2, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip


def _mark_small(axes: Any, scene: ShipScene, east: Floats, north: Floats) -> None:
    """Mark the bodies that are too small to be seen from above, and name them where they are few."""
    span = max(abs(high - low) for low, high in (axes.get_xlim(), axes.get_ylim()))
    facets, small = scene.bodies.facets(), dict[str, Floats]()
    for b, name in enumerate(scene.names):
        corners = facets.vertices[facets.body == b].reshape(-1, 3)
        if np.ptp(corners[:, :2], axis=0).max() < _SMALL * span:
            # The limbs of a walker are marked once.
            small.setdefault(name.split(".")[0], 0.5 * (corners.min(axis=0) + corners.max(axis=0)))
    place = Placer(axes)
    place.prepare()
    place.avoid(east, north, 2.0)
    for name, (x, y, _) in small.items():
        axes.plot([-y], [x], "o", ms=9, mfc="none", mec="black", mew=0.8, zorder=6)
        if len(small) <= _NAMED:
            place.label(-y, x, _short(name), fontsize=7, zorder=6)
