"""Which cells of a map show what is no echo, where no path explains them: the receiver's DC offset, which is a constant
in all samples, I/Q images of stronger echoes, at minus their range and rate, and what interferers send."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.records import Cube, Detections, Floats, RangeDoppler
from raychan.run.convergence import figure
from raychan.run.explanation.directions import UNEXPLAINED
from raychan.run.interferers import Sent
from raychan.run.receiver import quiet_map
from raychan.run.result import DC, IMAGE, INTERFERENCE, SIDELOBE, Explanation
from raychan.signal.converter import images, offset
from raychan.units import undb


@dataclass(frozen=True)
class NoEcho:
    """What is no echo: the label of detections of it, its name, what it brings to a map (v, r) [W], and by what power
    (v, r) [W] that may be off."""

    label: str
    source: str
    power: Floats
    error: Floats


def no_echoes_of(
    cube: Cube,
    rdmap: RangeDoppler,
    error: Floats,
    radar: Radar,
    settings: Any,
    others: Sent,
) -> list[NoEcho]:
    """Return what a radar's receiver makes itself, and what interferers send. Args: the samples that it records and
    their map; error (v, r) [W] by which two launches differ there; samples (a, c, s) of each interferer by name."""
    wave, faults = radar.waveform, radar.impairments
    constant = offset(faults, wave.complex_sampling)
    found = [
        NoEcho(INTERFERENCE, name, quiet_map(sent.astype(np.complex64), radar, settings), error)
        for name, sent in others.items()
    ]
    if constant != 0.0:
        # Alike in all receivers: the map of one has the mean power of all.
        alone = np.full((1, wave.n_chirps, wave.n_samples), constant, np.complex64)
        found.append(NoEcho(DC, "dc offset", quiet_map(alone, radar, settings), error))
    if not faults.iq_balanced:
        share, mirrored = images(cube.samples - constant, faults.iq_gain_db, faults.iq_phase_deg)
        power = quiet_map(mirrored, radar, settings)
        # Images of what may be noise, as such a mixer gives it, are none of an echo.
        noise = 0.5 * (1.0 + float(undb(faults.iq_gain_db))) * rdmap.noise
        there = np.ix_(_mirrored(rdmap.rate), _mirrored(rdmap.range))
        # Of two echoes that are images of each other the stronger one is real.
        none = (power < share * float(undb(settings.min_snr_db)) * noise) | (rdmap.power > rdmap.power[there])
        power = np.where(none, 0.0, power)
        found.append(NoEcho(IMAGE, "I/Q image", power, error + share * error[there]))
    return found


def _mirrored(axis: Floats) -> NDArray[np.int64]:
    """Return the cells (n,) of an axis that stand at minus its values (n,), as the transform that made it repeats."""
    step = float(np.ptp(axis)) / max(len(axis) - 1, 1) or 1.0
    return np.rint(-(axis + axis[0]) / step).astype(np.int64) % len(axis)


def named(why: Explanation, cell: tuple[int, int], no_echo: Sequence[NoEcho]) -> Explanation:
    """Return the explanation of a cell, as of what is no echo where none stands and that brings its power."""
    if not no_echo:
        return why
    most = max(no_echo, key=lambda one: float(one.power[cell]))
    brought = float(most.power[cell])
    nothing = not why.contributions or (why.label == SIDELOBE and brought > why.predicted)
    if not nothing or brought < UNEXPLAINED * why.power:
        return why
    error_db = figure(why.power, float(most.error[cell]))
    why = replace(why, label=most.label, source=most.source, contributions=(), error_db=error_db)
    return replace(why, folded=False, true_range=math.nan, true_rate=math.nan)


def all_named(reasons: Sequence[Explanation], found: Detections, no_echo: Sequence[NoEcho]) -> tuple[Explanation, ...]:
    """Return the explanations of detections, those of what is no echo as such."""
    cells = ((int(row), int(column)) for row, column in found.cell)
    return tuple(named(why, cell, no_echo) for why, cell in zip(reasons, cells, strict=True))
