"""Figures of the validation report: ranges and speeds, levels, ghost, link budget of pedestrians, array gain."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from raychan.report.canvas import PALETTE, Placer, figure, outlined, save, style
from raychan.report.reflector_figures import reflector_pictures
from raychan.study.validation.data import POINT
from raychan.study.validation.formulas import both_ways
from raychan.study.validation.judge import DIFFERS, UNTESTABLE, Check
from raychan.study.validation.sections import ArrayGain, Budget
from raychan.study.validation.validate import Validation
from raychan.units import db

_FACES = {"agrees": PALETTE[0], DIFFERS: PALETTE[7], UNTESTABLE: "#aaaaaa"}
_GHOST_RUNS = ("occluded", "no_car", "no_truck", "two_interactions")


def pictures(done: Validation, budgets: list[Budget], gains: list[ArrayGain], folder: Path) -> dict[str, Path]:
    """Draw the report's figures into a folder; return them by name."""
    return {
        "offs": _offs(done, folder / "report-offs.png"),
        "levels": _levels(done, folder / "report-levels.png"),
        "ghost": _ghost(done, folder / "report-ghost.png"),
        "pedestrians": _pedestrians(done, budgets, folder / "report-pedestrians.png"),
        "array": _array(done, gains, folder / "report-array.png"),
        **reflector_pictures(done.bench, folder),
    }


def _offs(done: Validation, path: Path) -> Path:
    """Draw simulated less printed ranges and speeds, in tolerances."""
    with style():
        made = figure(7.6, 3.4)
        for axes, (measure, title) in zip(
            made.subplots(1, 2, sharey=True), (("range", "Ranges"), ("speed", "Speeds")), strict=True
        ):
            tables: list[str] = []
            for item in done.items:
                rows = [c for c in done.checks if c.key.startswith(f"{item.id}/") and _is(c, measure)]
                if rows and item.id.startswith("T"):
                    _strip(axes, len(tables), rows)
                    tables.append(item.id.replace("T", "table "))
            axes.axvspan(-1.0, 1.0, color="#4477aa", alpha=0.1, lw=0)
            axes.axvline(0.0, color="#666666", lw=0.7)
            axes.set_yticks(np.arange(len(tables)), tables)
            axes.set(xlabel="simulated less printed, in tolerances", title=title, xlim=(-2.2, 2.2))
            axes.grid(axis="x", alpha=0.25, lw=0.5)
        axes.invert_yaxis()
        return save(made, path, flat=True)


def _strip(axes: Any, row: int, checks: list[Check]) -> None:
    spread = np.linspace(-0.28, 0.28, len(checks)) if len(checks) > 1 else np.zeros(1)
    for y, c in zip(spread, checks, strict=True):
        colour = _FACES[c.verdict]
        if c.difference is None:
            axes.plot(2.1, row + y, "x", color=colour, ms=4, mew=1.2)
        else:
            axes.plot(np.clip(c.difference / (c.figure.within or 1.0), -2.1, 2.1), row + y, "o", color=colour, ms=3.5)


def _is(check: Check, measure: str) -> bool:
    names = (measure, "rate") if measure == "speed" else (measure,)
    return check.figure.measure[0] in names and check.figure.within is not None


def _levels(done: Validation, path: Path) -> Path:
    """Draw simulated SNR over the printed one: pedestrians of given RCS, and bodies whose shape is not printed."""
    kinds = {
        "pedestrians and ghost: RCS printed": (True, "o", PALETTE[0]),
        "bodies: shape not printed": (False, "s", PALETTE[2]),
    }
    with style():
        made = figure(4.6, 4.2)
        axes = made.add_subplot()
        low, high = 0.0, 60.0
        axes.plot([low, high], [low, high], color="#666666", lw=0.8)
        for name, (given, mark, colour) in kinds.items():
            pairs = [(c.figure.printed, *_simulated(done, c)) for c in done.checks if _level_of(done, c) == given]
            for seen in (True, False):
                xy = np.array([(t, o) for t, o, s in pairs if s is seen and o is not None]).reshape(-1, 2)
                label = name if seen else None
                axes.plot(*xy.T, mark, color=colour, ms=4.5, mfc=colour if seen else "none", ls="none", label=label)
        _threshold(axes, done, "street")
        axes.set(
            xlabel="printed SNR, patch [dB]", ylabel="simulated SNR [dB]   (hollow: not detected, no noise)",
            xlim=(low, high), ylim=(low, high), title="Levels, tables 10, 13 and 14",
        )  # fmt: skip
        axes.legend(loc="upper left")
        axes.grid(alpha=0.25, lw=0.5)
        return save(made, path, flat=True)


def _threshold(axes: Any, done: Validation, run: str, label: bool = True) -> None:
    """Draw the least SNR that a run's receiver reports."""
    least = done.bench.scene(run).processing.min_snr_db
    axes.axhline(least, color="#aa3333", lw=0.8, ls="--")
    if label:
        where = axes.get_yaxis_transform()
        axes.annotate(
            "least SNR of a detection", (0.01, least), xycoords=where, color="#aa3333", fontsize=7.5, va="bottom"
        )


def _level_of(done: Validation, check: Check) -> bool | None:
    """Return whether a check is a patch SNR of a target of given RCS (True) or of a body (False); None for others."""
    item, _, rest = check.key.partition("/")
    target = rest.split("/")[0]
    if item not in ("T10", "T13", "T14") or check.figure.measure[0] != "snr" or check.key.endswith("snr_1"):
        return None
    return done.study.targets[target].reference == POINT


def _simulated(done: Validation, check: Check) -> tuple[float | None, bool]:
    if check.simulated is not None:
        return float(check.simulated), True
    _, run, target = check.figure.measure
    return done.bench.level(run, target), False


def _ghost(done: Validation, path: Path) -> Path:
    """Draw the map's strongest cell at each range, for the printed scene and without parts that make the ghost."""
    marks = [(done.bench.expected_range(t), name) for t, name in _MARKS.items()]
    near, far = min(at for at, _ in marks) - 2.5, max(at for at, _ in marks) + 3.5
    with style():
        made = figure(7.6, 5.2)
        panels = made.subplots(len(_GHOST_RUNS), 1, sharex=True, sharey=True)
        for axes, run in zip(panels, _GHOST_RUNS, strict=True):
            result = done.bench.run(run)
            m = result.rdmap
            keep = (m.range > near) & (m.range < far)
            axes.plot(m.range[keep], db(m.power[:, keep].max(axis=0) / m.noise), lw=0.9, color="#225588")
            _threshold(axes, done, run, label=axes is panels[0])
            for at, _ in marks:
                axes.axvline(at, color="#999999", lw=0.7, ls=":")
            d = result.detections
            for i, why in enumerate(result.provenance):
                if why.contributions and any(link.startswith("pedestrian") for link in why.contributions[0].chain):
                    inside = PALETTE[7] if why.converged else "none"
                    axes.plot(d.range[i], d.snr[i], "v", mec=PALETTE[7], mfc=inside, ms=6)
            title = "as printed" if run == _GHOST_RUNS[0] else done.study.runs[run].title
            axes.annotate(title, (0.995, 0.93), xycoords="axes fraction", ha="right", va="top", fontsize=9)
            axes.set(ylim=(0.0, 45.0), xlim=(near, far))
            axes.grid(alpha=0.2, lw=0.5)
        for at, name in marks:
            panels[0].annotate(
                name, (at, 1.02), xycoords=("data", "axes fraction"), ha="center", va="bottom", fontsize=8
            )
        panels[-1].set(xlabel="range [m]   (red: detections over the pedestrian, hollow where not converged)")
        made.supylabel("SNR of the strongest cell [dB]", fontsize=9)
        return save(made, path, flat=True)


_MARKS = {"pedestrian": "pedestrian", "one_sided": "one way over the truck", "ghost": "both ways over the truck"}


def _pedestrians(done: Validation, budgets: list[Budget], path: Path) -> Path:
    """Draw SNR over range: link budget, all paths, printed at both bandwidths."""
    r = np.array([b.link["range"] for b in budgets])
    with style():
        made = figure(7.0, 3.8)
        axes = made.add_subplot()
        first = budgets[0].link
        fine = np.linspace(r.min() - 1.0, r.max() + 1.0, 100)
        axes.plot(
            fine, first["snr_db"] - 40.0 * np.log10(fine / first["range"]), color="#999999", lw=1.0,
            label="R$^{-4}$ from the nearest one's link budget",
        )  # fmt: skip
        axes.plot(r, [b.link["snr_db"] for b in budgets], "_", color="black", ms=10, mew=1.5, label="link budget")
        for seen, face in ((True, PALETTE[0]), (False, "none")):
            rows = [b for b in budgets if b.whole is not None and b.detected is seen]
            label = "simulated" if seen else "simulated, not detected (without noise)"
            axes.plot(
                [b.link["range"] for b in rows], [b.whole for b in rows], "o", mec=PALETTE[0], mfc=face, ms=5,
                ls="none", label=label,
            )  # fmt: skip
        for column, mark, name in (("snr_1", "^", "1 GHz"), ("snr_4", "v", "4 GHz")):
            rows = [b for b in budgets if column in b.printed]
            axes.plot(
                [b.link["range"] for b in rows], [b.printed[column] for b in rows], mark, color=PALETTE[2], ms=5,
                mfc="none", ls="none", label=f"printed, {name}",
            )  # fmt: skip
        _threshold(axes, done, "street")
        axes.set(xlabel="range [m]", ylabel="SNR [dB]", title="Pedestrians of the living street, patch, 4 GHz")
        axes.set_ylim(0.0, 42.0)
        axes.legend(loc="lower left", ncols=2)
        axes.grid(alpha=0.25, lw=0.5)
        return save(made, path, flat=True)


def _array(done: Validation, gains: list[ArrayGain], path: Path) -> Path:
    """Draw the gain of array over patch against azimuth: by the patterns, simulated, printed."""
    angle = np.arange(0.0, 72.0, 0.02)
    with style():
        made = figure(7.6, 4.4)
        axes = made.add_subplot()
        axes.plot(angle, both_ways(done.bench, angle), color="#999999", lw=0.8, label="patterns of table 7, both ways")
        at = np.array([abs(t.azimuth) for t in gains])
        for t, x in zip(gains, at, strict=True):
            if t.simulated is not None:
                axes.plot([x, x], [t.printed, t.simulated], color="#cccccc", lw=0.8, zorder=1)
        for seen, face in ((True, PALETTE[0]), (False, "none")):
            rows = [t for t in gains if t.detected is seen and t.simulated is not None]
            label = "simulated" if seen else "simulated, not detected with both (levels without noise)"
            axes.plot(
                [abs(t.azimuth) for t in rows], [t.simulated for t in rows], "o", mec=PALETTE[0], mfc=face, ms=5,
                ls="none", label=label,
            )  # fmt: skip
        axes.plot(at, [t.printed for t in gains], "D", color=PALETTE[2], ms=4.5, ls="none", label="printed, table 16")
        axes.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0.0)), np.square))
        axes.set_xticks([0, 1, 2, 3, 4, 5, 7, 10, 15, 20, 30, 40, 50, 60, 70])
        axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        axes.minorticks_off()
        axes.set(xlabel="azimuth off boresight, inferred [deg]", ylabel="array less patch [dB]", ylim=(-45.0, 48.0))
        axes.set_xlim(0.0, 72.0)
        axes.set_title("Gain of the array over the patch")
        axes.legend(loc="upper center", frameon=True, edgecolor="none", framealpha=0.9)
        axes.grid(alpha=0.25, lw=0.5)
        placer = Placer(axes)
        placer.prepare()
        placer.avoid(at, np.array([t.printed for t in gains]), 6.0)
        placer.avoid(at, np.array([t.printed if t.simulated is None else t.simulated for t in gains]), 6.0)
        for t, x in zip(gains, at, strict=True):
            placer.label(
                x, t.printed, t.title.replace("pedestrian", "ped."), fontsize=7.5, color="#333333",
                path_effects=outlined(2.0, "white"),
            )  # fmt: skip
        return save(made, path, flat=True)
