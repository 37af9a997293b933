"""Which cells of a map show the receiver's DC offset: what no path explains, where a constant in all samples stands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from raychan.radar.radar import Radar
from raychan.records import Detections, Floats
from raychan.run.convergence import figure
from raychan.run.directions import UNEXPLAINED
from raychan.run.receiver import quiet_map
from raychan.run.result import DC, SIDELOBE, Explanation
from raychan.signal.converter import offset


def dc_power(radar: Radar, settings: Any) -> Floats | None:
    """Return the powers (v, r) [W] that a radar's DC offset alone brings to its map; None without an offset."""
    wave, constant = radar.waveform, offset(radar.impairments, radar.waveform.complex_sampling)
    if constant == 0.0:
        return None
    # Alike in all receivers: the map of one has the mean power of all.
    samples = np.full((1, wave.n_chirps, wave.n_samples), constant, np.complex64)
    power: Floats = quiet_map(samples, radar, settings)
    return power


def named(why: Explanation, brought: float, error: float) -> Explanation:
    """Return the explanation of a cell, as of the DC offset where no echo stands and the offset brings its power.

    Args: brought [W] by the offset to the cell; error [W], the difference of two launches there.
    """
    nothing = not why.contributions or (why.label == SIDELOBE and brought > why.predicted)
    if not nothing or brought < UNEXPLAINED * why.power:
        return why
    why = replace(why, label=DC, contributions=(), error_db=figure(why.power, error))
    return replace(why, folded=False, true_range=math.nan, true_rate=math.nan)


def all_named(
    reasons: Sequence[Explanation], found: Detections, error: Floats, radar: Radar, settings: Any
) -> tuple[Explanation, ...]:
    """Return the explanations of detections, those of the DC offset as such; error (v, r) [W], see `named`."""
    power = dc_power(radar, settings)
    if power is None:
        return tuple(reasons)
    cells = zip(reasons, map(tuple, found.cell), strict=True)
    return tuple(named(why, float(power[cell]), float(error[cell])) for why, cell in cells)
