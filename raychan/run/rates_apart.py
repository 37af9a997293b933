"""Echoes that cross before a wide array: each element sees a range rate of its own, and a beam adds one cell of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from raychan.radar.array import Wavefronts
from raychan.radar.radar import Radar
from raychan.radar.windows import window
from raychan.run.result import ExplainedDetections, Explanation
from raychan.units import db

Floats = NDArray[np.float64]

_OFF = 0.05  # rate cells between the places where the peak is sought


def rates_apart(found: ExplainedDetections, reasons: Sequence[Explanation], radar: Radar) -> tuple[Floats, Floats]:
    """Return by how many rate cells the rate of each detection (n,) differs over the elements, and what a beam loses by
    it (n,) [dB]: the mean over the elements of the rate window's response in one cell, of the best."""
    cells, held = np.zeros(len(reasons)), np.ones(len(reasons))
    wave, every = radar.channel_waveform, radar.elements_world
    if radar.rx_position is not None or wave.n_chirps < 2:
        return cells, db(held)
    taper = window(radar.processing.rate_window, wave.n_chirps)
    turn = 2.0 * np.pi * (np.arange(wave.n_chirps) - 0.5 * (wave.n_chirps - 1)) / wave.n_chirps
    for i, why in enumerate(reasons):
        if not why.drift:
            continue
        # A folded echo comes from where it stands.
        away = np.array([found.true_range[i] if np.isfinite(found.true_range[i]) else found.range[i]])
        looks = (np.array([look], float) for look in (why.arrival, why.departure))
        drift = np.reshape(why.drift, (1, 2, 3))
        fronts = Wavefronts(next(looks), away, next(looks), away, np.zeros(1, bool), drift, np.zeros(1))
        rate = [0.5 * fronts.faster(one.offset, rx)[0] for one in radar.transmissions for rx in every]
        off = (np.array(rate) - np.mean(rate)) / wave.rate_resolution
        cells[i] = np.ptp(off)
        places = off - np.arange(off.min(), off.max() + _OFF, _OFF)[:, None]
        response = np.cos(places[:, :, None] * turn) @ taper / taper.sum()
        held[i] = np.max(response.mean(axis=1) ** 2)
    return cells, -db(np.maximum(held, 1e-30))
