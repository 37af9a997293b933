"""Figures of the three reflectors, as a published FMCW model draws them: a ramp, the map, its cuts, beams."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from raychan.report.canvas import PALETTE, figure, save, style
from raychan.report.direction_figures import pair_picture
from raychan.run.result import Result
from raychan.study.validation.bench import Bench
from raychan.study.validation.reflectors import BEAMS, beam_powers, close_pair
from raychan.units import db, dbm, watt

RUN, CENTRED = "reflectors", "reflectors_centred"
_DYNAMIC_DB = 65.0  # drawn below a peak: noise, one dark colour, takes no room in the file
_BEAM_DB = 30.0  # the same of beams
_FINE = 1501  # beams of a curve


def reflector_pictures(bench: Bench, folder: Path) -> dict[str, Path]:
    """Draw the figures of the three reflectors into a folder; return them by name."""
    return {
        "ramp": _ramp(bench.run(RUN), folder / "report-ramp.png"),
        "map": _map(bench.run(RUN), folder / "report-map.png"),
        "cuts": _cuts(bench.run(RUN), folder / "report-cuts.png"),
        "beams": _beams(bench, folder / "report-beams.png"),
        "pair": pair_picture(close_pair(), folder / "report-pair.png"),
    }


def reflector_section(figures: dict[str, str]) -> list[str]:
    """Return the lines of the report about the figures, by their file names."""
    said = {
        "ramp": "Figure 14: real part of the first ramp at the first receiver. Two beat tones, of 20 and of 32 m, and "
        "noise 6 dB below each reflector at 32 m.",
        "map": "Figure 15: power over range and range rate, mean of the receivers. Two peaks: reflector 1 at 20 m, "
        "reflectors 2 and 3 in one cell at 32 m. The crosses are side lobes of rectangular windows.",
        "cuts": "Figure 16: the map's greatest power over range, and over range rate.",
        "beams": "Figure 17: beams over the cells of both peaks; dots are the printed 32 beams over 30 deg. In phase "
        "at the first receiver, reflectors 2 and 3 show two peaks farther apart than they are; in phase at the "
        "array's centre, one.",
        "pair": "Over all relative phases: what beams show, and what MUSIC finds.",
    }
    lines = [
        "## Three reflectors", "",
        "The example of a published FMCW model at 24 GHz (claims C059 to C074), simulated from "
        "`scenes/three_reflectors.toml`; figures are numbered as there.", "",
    ]  # fmt: skip
    for name, text in said.items():
        lines += [f"![{text.partition(':')[0]}]({figures[name]})", "", text, ""]
    return lines


def _ramp(result: Result, path: Path) -> Path:
    wave = result.require_scene().radar.waveform
    samples = result.cube.samples[0, 0].real * 1e6
    with style():
        made = figure(5.6, 2.4)
        axes = made.add_subplot()
        axes.plot(np.arange(len(samples)) / wave.sample_rate * 1e6, samples, color=PALETTE[0], lw=0.6)
        axes.set(
            xlabel="time in the ramp [us]", ylabel="I [10$^{-6}$ W$^{1/2}$]", title="First ramp at the first receiver"
        )
        axes.set_xlim(0.0, wave.chirp_duration * 1e6)
        axes.grid(alpha=0.25, lw=0.5)
        return save(made, path, flat=True)


def _level(result: Result) -> Any:
    return dbm(np.maximum(result.rdmap.power, watt(-300.0)))


def _map(result: Result, path: Path) -> Path:
    level, made_map = _level(result), result.rdmap
    top = float(np.ceil(level.max() / 5.0) * 5.0)
    with style():
        made = figure(7.2, 4.0)
        axes = made.add_subplot()
        keep = made_map.range <= 60.0
        image = axes.pcolormesh(
            made_map.range[keep], made_map.rate, level[:, keep], vmin=top - _DYNAMIC_DB, vmax=top, cmap="viridis",
            shading="nearest", rasterized=True,
        )  # fmt: skip
        made.colorbar(image, ax=axes, label="received power [dBm]", pad=0.01, aspect=30)
        axes.set(xlabel="range [m]", ylabel="range rate [m/s]", title="Range-Doppler map")
        return save(made, path, flat=True)


def _cuts(result: Result, path: Path) -> Path:
    level, made_map = _level(result), result.rdmap
    with style():
        made = figure(7.2, 3.2)
        left, right = made.subplots(1, 2, sharey=True)
        left.plot(made_map.range, level.max(axis=0), color=PALETTE[0], lw=0.8)
        left.set(xlabel="range [m]", ylabel="received power [dBm]", title="Cut along range", xlim=(0.0, 60.0))
        right.plot(made_map.rate, level.max(axis=1), color=PALETTE[0], lw=0.8)
        right.set(xlabel="range rate [m/s]", title="Cut along range rate", xlim=(-50.0, 50.0))
        for axes, places in ((left, (20.0, 32.0)), (right, (9.0, -10.0))):
            for place in places:
                axes.axvline(place, color="#666666", lw=0.7, ls="--", zorder=0)
            axes.grid(alpha=0.25, lw=0.5)
        return save(made, path, flat=True)


def _beams(bench: Bench, path: Path) -> Path:
    shown = (
        (RUN, "reflector_1", "reflector 1", (-15.0,)),
        (RUN, "reflector_2", "reflectors 2 and 3, in phase at the first receiver", (2.0, -2.0)),
        (CENTRED, "reflector_2", "reflectors 2 and 3, in phase at the centre", (2.0, -2.0)),
    )
    with style():
        made = figure(7.2, 6.6)
        for axes, (run, target, title, truth) in zip(made.subplots(3, 1, sharex=True, sharey=True), shown, strict=True):
            fine, few = (beam_powers(bench, run, target, count) for count in (_FINE, BEAMS))
            if fine is not None and few is not None:
                for (azimuth, power), face in ((fine, {"lw": 1.0}), (few, {"ls": "none", "marker": "o", "ms": 3.0})):
                    level = np.maximum(db(power / fine[1].max()), -2.0 * _BEAM_DB)
                    axes.plot(np.degrees(azimuth), level, color=PALETTE[0], **face)
            for angle in truth:
                axes.axvline(angle, color="#666666", lw=0.7, ls="--", zorder=0)
            axes.set(ylabel="power [dB]", title=f"Beams over {title}", ylim=(-_BEAM_DB, 3.0))
            axes.grid(alpha=0.25, lw=0.5)
        axes.set_xlim(16.0, -16.0)  # left is left
        axes.set(xlabel="azimuth [deg]   (dashed: true)")
        return save(made, path, flat=True)
