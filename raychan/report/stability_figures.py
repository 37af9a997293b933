"""Pictures of the stability study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from raychan.report.canvas import PALETTE, figure, save, style
from raychan.study.stability import Tried

_GOOD, _BAD = "#228833", "#cc3311"
_MOST = 1e4  # error over tolerance beyond which a failure is drawn at the edge

_OVERVIEW = "overview.png"
_FILES = {
    "grazing": "grazing.png",
    "facet_sizes": "facet-sizes.png",
    "leaks": "leaks.png",
    "parallel": "parallel-mirrors.png",
    "layers": "layers.png",
    "paths": "path-count.png",
    "dynamic": "dynamic-range.png",
    "near_array": "near-array.png",
}
FIGURES = (_OVERVIEW, *_FILES.values())


def pictures(done: Sequence[Tried], folder: Path) -> list[Path]:
    """Draw the figures of the regimes that were run, and return the files."""
    curves = {t.regime.key: t.outcome.curves for t in done if t.outcome.curves}
    draw: dict[str, Callable[[dict[str, Any], Path], Path]] = {
        "grazing": _grazing,
        "facet_sizes": _sizes,
        "leaks": _leaks,
        "parallel": _bounces,
        "layers": _layers,
        "paths": _paths,
        "dynamic": _dynamic,
        "near_array": _array,
    }
    made = [_overview(done, folder / _OVERVIEW)]
    with style():
        return made + [make(curves[key], folder / _FILES[key]) for key, make in draw.items() if key in curves]


def _overview(done: Sequence[Tried], path: Path) -> Path:
    """Draw every check as a mark at its error over its tolerance."""
    with style():
        made = figure(8.2, 0.6 + 0.27 * len(done))
        axes = made.add_subplot()
        rng = np.random.default_rng(0)
        for i, t in enumerate(done):
            for r in t.outcome.rows:
                x = float(np.clip(r.share, 1e-6, _MOST))
                look: dict[str, Any] = {"marker": "o", "color": _GOOD, "ms": 3.5, "alpha": 0.6}
                if not r.passed:
                    look = {"marker": "X", "color": _BAD, "ms": 6.0}
                axes.plot(x, i + 0.22 * rng.uniform(-1, 1), ls="none", mew=0, **look)
        axes.axvline(1.0, color="#444444", lw=0.9)
        axes.set_xscale("log")
        axes.set_xlim(6e-7, 2 * _MOST)
        axes.set_ylim(len(done) - 0.5, -0.5)
        names = [f"{t.regime.title}   {len(t.outcome.rows) - len(t.failed)}/{len(t.outcome.rows)}" for t in done]
        axes.set_yticks(range(len(done)), names, fontsize=8)
        for label, t in zip(axes.get_yticklabels(), done, strict=True):
            label.set_color(_BAD if t.failed else "#222222")
        axes.grid(axis="x", alpha=0.25, lw=0.5)
        axes.set_xlabel("error over tolerance (at the edges: less than 1e-6, more than 1e4)")
        axes.set_title("Every check: passed left of the line, failed (X) right of it")
        return save(made, path, flat=True)


def _grazing(c: dict[str, Any], path: Path) -> Path:
    made = figure(6.4, 3.4)
    axes = made.add_subplot()
    off = 90.0 - c["angle"]
    for (name, mark), colour in zip((("side lobe", "o"), ("mirror direction", "s")), PALETTE, strict=False):
        axes.plot(off, np.maximum(np.abs(c[name]), 1e-16), mark, ls="-", lw=0.8, ms=4, color=colour, label=name)
    axes.axhline(0.05, color=_BAD, lw=0.9, ls="--", label="tolerance")
    axes.set(xscale="log", yscale="log", ylim=(1e-16, 1.0))
    axes.invert_xaxis()
    axes.set(
        xlabel="degrees above the plate (90 is broadside)", ylabel="error [dB]", title="Error against grazing angle"
    )
    axes.legend()
    axes.grid(alpha=0.25, lw=0.5)
    return save(made, path, flat=True)


def _sizes(c: dict[str, Any], path: Path) -> Path:
    made = figure(6.4, 3.4)
    axes = made.add_subplot()
    for name, mark, colour in (("plate", "o", PALETTE[0]), ("dihedral", "s", PALETTE[2])):
        off = np.abs(np.asarray(c[name], float))
        known = np.isfinite(off)
        label = "plate" if name == "plate" else "dihedral, two bounces"
        axes.plot(
            c["size"][known], np.maximum(off[known], 1e-16), mark, ls="-", lw=0.8, ms=4, color=colour, label=label
        )
        if (~known).any():
            axes.plot(
                c["size"][~known], np.full((~known).sum(), 30.0), "X", ms=7, color=_BAD, label=f"{name}: nothing found"
            )
    axes.axhline(0.05, color=_BAD, lw=0.9, ls="--", label="tolerance of the plate (dihedral: 0.1)")
    axes.axvline(0.0039, color="#888888", lw=0.8, ls=":")
    axes.annotate("wavelength", (0.0039, 1e-9), xytext=(4, 0), textcoords="offset points", fontsize=7, color="#666666")
    axes.set(xscale="log", yscale="log", ylim=(1e-16, 1e3), xlabel="edge of the target [m]", ylabel="error [dB]")
    axes.set_title("Error against facet size")
    axes.legend(loc="center right")
    axes.grid(alpha=0.25, lw=0.5)
    return save(made, path, flat=True)


def _leaks(c: dict[str, Any], path: Path) -> Path:
    made = figure(7.2, 4.4)
    axes = made.add_subplot()
    names, leaks, rays = c["shape"], c["leaks"], c["rays"]
    colours = (PALETTE[0], _BAD, PALETTE[5])
    for i, target in enumerate(c["target"]):
        y = np.arange(len(names)) + 0.22 * (i - 1)
        some = (rays[:, i] > 0) & (leaks[:, i] > 0)
        none = (rays[:, i] > 0) & (leaks[:, i] == 0)
        axes.plot(1e6 * leaks[some, i] / rays[some, i], y[some], "X", ms=6, color=colours[i], mew=0)
        # Without a single leak in n rays the rate is under 3 / n at 95 %.
        bound = 3e6 / rays[none, i]
        axes.plot(bound, y[none], "<", ms=5, mfc="none", color=colours[i])
        axes.plot([], [], "s", color=colours[i], label=f"{target}: {leaks[:, i].sum()} in {rays[:, i].sum():,} rays")
    axes.set_xscale("log")
    low, high = np.log10(axes.get_xlim())
    axes.set_xlim(10.0 ** np.floor(low), 10.0 ** np.ceil(high))
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(alpha=0.25, lw=0.5)
    axes.set_xlabel("leaks per million rays   (X: seen; <: none seen, 95 % bound)")
    made.suptitle("Rays that pass between faces", fontweight="bold", fontsize=10)
    made.legend(loc="outside lower center", ncols=3)
    return save(made, path, flat=True)


def _bounces(c: dict[str, Any], path: Path) -> Path:
    made = figure(6.4, 3.4)
    axes = made.add_subplot()
    for (name, series), colour in zip(c.items(), PALETTE, strict=False):
        order, seen, exact = series
        axes.plot(order, exact, "-", lw=1.0, color=colour, label=f"{name}: images in closed form")
        axes.plot(order, seen, "o", ms=5, mfc="none", color=colour, label=f"{name}: seen")
    axes.set(yscale="log", xlabel="bounces", ylabel="sum of |gain| of that order", title="Between parallel mirrors")
    axes.legend()
    axes.grid(alpha=0.25, lw=0.5)
    return save(made, path, flat=True)


def _layers(c: dict[str, Any], path: Path) -> Path:
    made = figure(6.4, 3.4)
    axes = made.add_subplot()
    seen, film = np.array(c["seen"]), np.abs(np.array(c["film"]))
    for i, name in enumerate(("R_s", "R_p")):
        axes.plot(c["thickness"], seen[:, i], "o", ms=4, mfc="none", color=PALETTE[i], label=f"|{name}| seen")
        low = film[:, i] < 1.0
        axes.plot(c["thickness"][low], film[low, i], "-", lw=0.9, color=PALETTE[i], label=f"|{name}| film, first order")
    axes.set(xscale="log", yscale="log", ylim=(1e-14, 3.0), xlabel="thickness [m]", ylabel="reflection")
    axes.set_title("A glass layer from 1e-15 m to 1 km")
    axes.legend(ncols=2)
    axes.grid(alpha=0.25, lw=0.5)
    return save(made, path, flat=True)


def _paths(c: dict[str, Any], path: Path) -> Path:
    made = figure(7.2, 3.2)
    some = c["count"] > 0
    for i, (key, label) in enumerate((("seconds", "time [s]"), ("gigabytes", "largest memory [GB]"))):
        axes = made.add_subplot(1, 2, i + 1)
        axes.plot(c["count"][some], c[key][some], "o-", ms=4, lw=0.9, color=PALETTE[i])
        axes.set(xscale="log", yscale="log", xlabel="paths", ylabel=label)
        axes.grid(alpha=0.25, lw=0.5)
    made.suptitle("Cube of 128 chirps by 512 samples against path count", fontweight="bold", fontsize=10)
    return save(made, path, flat=True)


def _dynamic(c: dict[str, Any], path: Path) -> Path:
    made = figure(8.2, 3.8)
    label = next(name for name in c if name != "direct")
    m = c[label]
    level = 10 * np.log10(np.maximum(m.power, 1e-20))
    axes = made.add_subplot(1, 2, 1)
    image = axes.pcolormesh(
        m.range, m.rate, level, vmin=-160, vmax=0, cmap="viridis", shading="nearest", rasterized=True
    )
    axes.set(xlabel="range [m]", ylabel="range rate [m/s]", title=f"Map, {label}")
    made.colorbar(image, ax=axes, label="dB of the strongest", pad=0.01, aspect=30)
    axes = made.add_subplot(1, 2, 2)
    for (name, each), colour in zip(c.items(), PALETTE, strict=False):
        most = 10 * np.log10(np.maximum(each.power.max(axis=0), 1e-20))
        axes.plot(each.range, most, lw=0.9, color=colour, label=name)
    axes.axhline(-120, color=_BAD, lw=0.8, ls="--")
    axes.set(
        xlabel="range [m]",
        ylabel="strongest over all rates [dB]",
        ylim=(-170, 5),
        title="Echoes at 0, -60, -90, -120 dB",
    )
    axes.legend(loc="upper right")
    axes.grid(alpha=0.25, lw=0.5)
    return save(made, path)


def _array(c: dict[str, Any], path: Path) -> Path:
    made = figure(5.6, 3.2)
    axes = made.add_subplot()
    axes.plot(c["distance"], c["phase"], "o-", ms=4, lw=0.9, color=PALETTE[0])
    axes.axhline(np.pi / 8, color=_BAD, lw=0.8, ls="--", label="pi/8, the usual far-field limit")
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="distance over 2 D² / wavelength",
        ylabel="greatest phase error [rad]",
    )
    axes.set_title("A target in the near field of a receiving array")
    axes.legend()
    axes.grid(alpha=0.25, lw=0.5)
    return save(made, path, flat=True)
