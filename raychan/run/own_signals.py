"""Which cells of a map show what the receiver itself makes, where no path explains them: its DC offset, which is a
constant in all samples, and I/Q images of stronger echoes, at minus their range and rate."""

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
from raychan.run.directions import UNEXPLAINED
from raychan.run.receiver import quiet_map
from raychan.run.result import DC, IMAGE, SIDELOBE, Explanation
from raychan.signal.converter import images, offset
from raychan.units import undb


@dataclass(frozen=True)
class OwnSignal:
    """What a receiver makes: the label of detections of it, what it brings to a map (v, r) [W], and by what power (v,
    r) [W] that may be off."""

    label: str
    power: Floats
    error: Floats


def own_signals(cube: Cube, rdmap: RangeDoppler, error: Floats, radar: Radar, settings: Any) -> list[OwnSignal]:
    """Return what a radar's receiver makes itself. Args: the samples that it records and their map; error (v, r) [W] by
    which two launches differ there."""
    wave, faults = radar.waveform, radar.impairments
    constant, found = offset(faults, wave.complex_sampling), []
    if constant != 0.0:
        # Alike in all receivers: the map of one has the mean power of all.
        alone = np.full((1, wave.n_chirps, wave.n_samples), constant, np.complex64)
        found.append(OwnSignal(DC, quiet_map(alone, radar, settings), error))
    if not faults.iq_balanced:
        share, mirrored = images(cube.samples - constant, faults.iq_gain_db, faults.iq_phase_deg)
        power = quiet_map(mirrored, radar, settings)
        # Images of what may be noise, as such a mixer gives it, are none of an echo.
        noise = 0.5 * (1.0 + float(undb(faults.iq_gain_db))) * rdmap.noise
        there = np.ix_(_mirrored(rdmap.rate), _mirrored(rdmap.range))
        # Of two echoes that are images of each other the stronger one is real.
        none = (power < share * float(undb(settings.min_snr_db)) * noise) | (rdmap.power > rdmap.power[there])
        power = np.where(none, 0.0, power)
        found.append(OwnSignal(IMAGE, power, error + share * error[there]))
    return found


def _mirrored(axis: Floats) -> NDArray[np.int64]:
    """Return the cells (n,) of an axis that stand at minus its values (n,), as the transform that made it repeats."""
    step = float(np.ptp(axis)) / max(len(axis) - 1, 1) or 1.0
    return np.rint(-(axis + axis[0]) / step).astype(np.int64) % len(axis)


def named(why: Explanation, cell: tuple[int, int], own: Sequence[OwnSignal]) -> Explanation:
    """Return the explanation of a cell, as of a signal of the receiver's own where no echo stands and that brings its
    power."""
    if not own:
        return why
    most = max(own, key=lambda one: float(one.power[cell]))
    brought = float(most.power[cell])
    nothing = not why.contributions or (why.label == SIDELOBE and brought > why.predicted)
    if not nothing or brought < UNEXPLAINED * why.power:
        return why
    why = replace(why, label=most.label, contributions=(), error_db=figure(why.power, float(most.error[cell])))
    return replace(why, folded=False, true_range=math.nan, true_rate=math.nan)


def all_named(reasons: Sequence[Explanation], found: Detections, own: Sequence[OwnSignal]) -> tuple[Explanation, ...]:
    """Return the explanations of detections, those of signals of the receiver's own as such."""
    cells = ((int(row), int(column)) for row, column in found.cell)
    return tuple(named(why, cell, own) for why, cell in zip(reasons, cells, strict=True))
