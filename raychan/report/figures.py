"""Pictures of a result: the range-Doppler map and the power-delay profile."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import RangeDoppler
from raychan.report.canvas import MARKS, Placer, on, outlined, save, style
from raychan.run.explanation.labels import chains, explain_cell, response_of
from raychan.run.result import LINE_OF_SIGHT, Explanation, Result
from raychan.units import dbm, watt

Floats = NDArray[np.float64]

_DYNAMIC_DB = 90.0  # largest span drawn below the peak
_LABELS, _NUMBERS = 12, 40  # most detections that are named, and that are numbered
_PEAKS = 10  # most peaks of the profile that are named


def rdmap_picture(result: Result, path: str | Path | None = None, axes: Any = None) -> Path | None:
    """Draw the range-Doppler map in dBm with its detections marked by label and named by their bodies.

    Args: path of the picture, or None; axes to draw into, or None for a figure of its own.
    """
    m, d = result.rdmap, result.detections
    far = _reach(result)
    keep = m.range <= far
    power = dbm(np.maximum(m.power[:, keep], watt(-300.0)))
    low, top = levels(m, power)
    with style():
        made, axes = on(axes, 8.2, 4.6)
        r, v = m.range[keep], m.rate
        if len(v) == 1:  # one chirp: its row fills the map
            v, power = v + 0.5 * _half_row(m) * np.array([-1.0, 1.0]), np.repeat(power, 2, axis=0)
        image = axes.pcolormesh(r, v, power, vmin=low, vmax=top, cmap="viridis", shading="nearest", rasterized=True)
        axes.set(xlabel="range [m]", ylabel="range rate [m/s]   (receding is positive)", title="Range-Doppler map")
        axes.set_xlim(r[0], r[-1])
        axes.set_ylim(*_rates(result, _in_map(result)[1]))
        made.colorbar(image, ax=axes, label="received power [dBm]", pad=0.01, aspect=30)
        _mark_detections(result, axes)
        if len(d.range):
            legend = axes.legend(
                loc="upper right", labelcolor="white", frameon=True, facecolor="#222222", framealpha=0.7
            )
            legend.set_zorder(6)
        if result.receiver.ego_speed and m.rate[0] < -result.receiver.ego_speed < m.rate[-1]:
            axes.axhline(-result.receiver.ego_speed, color="white", lw=0.7, ls=(0, (4, 4)), alpha=0.6)
            axes.annotate(
                "at rest", (1.0, -result.receiver.ego_speed), xycoords=("axes fraction", "data"), xytext=(-4, 3),
                textcoords="offset points", ha="right", color="white", fontsize=7, alpha=0.9,
            )  # fmt: skip
        _name_detections(result, axes)
        return None if path is None else save(made, path)


def levels(m: RangeDoppler, power: Floats) -> tuple[float, float]:
    """Return the span [dBm] of a map's colour scale: from the noise, or 90 dB below the peak, to the peak."""
    floor = dbm(m.noise) - 3.0 if m.noise > 0.0 else -np.inf
    top = np.ceil(power.max() / 5.0) * 5.0
    low = np.floor(max(floor, top - _DYNAMIC_DB) / 5.0) * 5.0
    return float(low), float(max(top, low + 15.0))


def profile_picture(result: Result, path: str | Path | None = None, axes: Any = None) -> Path | None:
    """Draw the power-delay profile in dBm against range, its peaks named by the bodies that make them.

    Args as for `rdmap_picture`.
    """
    p = result.profile
    far = _reach(result)
    keep = p.range <= far
    power = dbm(np.maximum(p.power, watt(-300.0)))
    top = power[keep].max(initial=-100.0)
    noise = dbm(p.noise) if p.noise > 0.0 else -np.inf
    low = max(noise - 12.0, top - 110.0)
    with style():
        made, axes = on(axes, 8.2, 3.6)
        axes.plot(p.range[keep], np.maximum(power[keep], low), lw=1.1, color="#225588")
        axes.fill_between(p.range[keep], low, np.maximum(power[keep], low), color="#225588", alpha=0.12, lw=0)
        if p.noise > 0.0:
            axes.axhline(noise, color="#aa3333", lw=0.8, ls="--")
            axes.annotate(
                "thermal noise", (1.0, noise), xycoords=("axes fraction", "data"), xytext=(-4, 3),
                textcoords="offset points", ha="right", color="#aa3333", fontsize=8,
                bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1.0},
            )  # fmt: skip
        axes.set(xlabel="range [m]", ylabel="received power [dBm]", title="Power-delay profile")
        axes.set_xlim(p.range[0], far)
        axes.set_ylim(low, top + 0.18 * (top - low))
        axes.grid(alpha=0.25, lw=0.5)
        _name_peaks(result, axes, power, far)
        return None if path is None else save(made, path)


def _reach(result: Result) -> float:
    """Return the range [m] up to which a picture is drawn."""
    found = result.detections.range
    end = float(result.rdmap.range[-1])
    return min(end, max(10.0, 1.2 * float(found.max()))) if len(found) else end


def _in_map(result: Result) -> tuple[Floats, Floats]:
    """Return the ranges [m] and range rates [m/s] at which the map shows detections: those whose rate the receiver
    unfolded stand at their cells."""
    m, d = result.rdmap, result.detections
    rows, columns = d.cell.T
    away = np.abs(d.rate - m.rate[rows]) > m.unambiguous_rate
    return np.where(away, m.range[columns], d.range), np.where(away, m.rate[rows], d.rate)


def _rates(result: Result, rates: Floats) -> tuple[float, float]:
    """Return the range rates [m/s] to draw: all detections and standing bodies, with a margin, within the map."""
    m = result.rdmap
    seen = np.concatenate([rates, [0.0, -result.receiver.ego_speed]])
    room = max(3.0, 0.35 * float(np.ptp(seen)), 10.0 * m.rate_resolution)
    low, high = float(m.rate[0]) - _half_row(m), float(m.rate[-1]) + _half_row(m)
    return max(low, float(seen.min()) - room), min(high, float(seen.max()) + room)


def _half_row(m: RangeDoppler) -> float:
    """Return half the height [m/s] of a map's row."""
    return 0.5 * float(m.rate[1] - m.rate[0]) if len(m.rate) > 1 else m.unambiguous_rate


def _mark_detections(result: Result, axes: Any) -> None:
    """Mark detections by their labels: filled, hollow where not converged, with a square around folded ones."""
    d, (ranges, rates) = result.detections, _in_map(result)
    for label, (mark, colour) in MARKS.items():
        mine = np.array([why.label == label for why in result.provenance], bool)
        for rows, inside, words in ((mine & d.converged, colour, ""), (mine & ~d.converged, "none", ", not converged")):
            if rows.any():
                edge = "black" if inside == colour else colour
                axes.plot(
                    ranges[rows], rates[rows], mark, ms=7, mfc=inside, mec=edge, mew=0.8 if edge == "black" else 1.4,
                    ls="none", label=f"{label}{words} ({int(rows.sum())})",
                    path_effects=None if edge == "black" else outlined(2.6),
                )  # fmt: skip
    if d.folded.any():
        axes.plot(
            ranges[d.folded], rates[d.folded], "s", ms=13, mfc="none", mec="white", mew=1.2, ls="none",
            label=f"folded, true place elsewhere ({int(d.folded.sum())})", path_effects=outlined(2.4),
        )  # fmt: skip


def _name_detections(result: Result, axes: Any) -> None:
    """Label detections by number, body, range and SNR; those near another one of their name, and the weakest of many,
    by their number alone."""
    d, (ranges, rates) = result.detections, _in_map(result)
    placer = Placer(axes)
    placer.prepare()
    placer.avoid(ranges, rates, 9.0)
    placer.avoid(ranges[d.folded], rates[d.folded], 15.0)
    if (legend := axes.get_legend()) is not None:
        placer.spare(legend)
    named: list[tuple[str, float, float]] = []
    for i, why in enumerate(result.provenance[:_NUMBERS]):
        name = _short(why)
        near = any(n == name and abs(r - ranges[i]) < 3.0 and abs(v - rates[i]) < 1.0 for n, r, v in named)
        unfolded = "" if rates[i] == d.rate[i] else f"\nunfolded to {d.rate[i]:+.1f} m/s"
        text = f"{i + 1}: {name}\n{d.range[i]:.2f} m, {d.snr[i]:.0f} dB{unfolded}{_true_place(why)}"
        if near or len(named) >= _LABELS:
            text = f"{i + 1}"
        else:
            named.append((name, float(ranges[i]), float(rates[i])))
        look: dict[str, Any] = {
            "color": MARKS[why.label][1],
            "fontsize": 7,
            "path_effects": outlined(1.8),
            "linespacing": 1.1,
        }
        placer.label(float(ranges[i]), float(rates[i]), text, **look)


def _name_peaks(result: Result, axes: Any, power: Floats, far: float) -> None:
    p = result.profile
    known, response = chains(result.paths, result.receiver.background), response_of(result.receiver)
    placer = Placer(axes)
    placer.prepare()
    end = int(np.searchsorted(p.range, far))
    dense = np.linspace(p.range[0], p.range[max(end - 1, 0)], 8 * max(end, 1))
    placer.avoid(dense, np.interp(dense, p.range, power), 2.0)
    named: set[str] = set()
    for peak in p.peaks:
        at, height = float(p.range[peak]), float(power[peak])
        if at > far or len(named) >= _PEAKS:
            continue
        why = explain_cell(result.paths, known, response, result.receiver, at, None, float(p.power[peak]))
        name = _short(why)
        if not why.contributions or name in named:
            continue
        named.add(name)
        axes.plot(at, height, "o", ms=3.5, color="#225588")
        placer.label(at, height, f"{name}\n{at:.2f} m{_true_place(why)}", fontsize=7, color="#222222", above=True)


def _true_place(why: Explanation) -> str:
    """Return the true place of a folded echo, as a further line of its label."""
    if not why.folded:
        return ""
    rate = "" if math.isnan(why.true_rate) else f", {why.true_rate:+.1f} m/s"
    return f"\nfolded from {why.true_range:.1f} m{rate}"


def _short(why: Explanation) -> str:
    """Return the bodies of the leading chain without their parts and without repeats."""
    if not why.contributions:
        return why.bodies
    bodies = [link.split(".")[0] for link in why.contributions[0].chain if not link.startswith("(")]
    return " > ".join(b for i, b in enumerate(bodies) if i == 0 or b != bodies[i - 1]) or LINE_OF_SIGHT
