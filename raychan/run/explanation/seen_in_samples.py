"""What a receiver sees of noise-free samples at the places and in the beams of its detections."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.radar.windows import window
from raychan.records import Detections
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Samples = NDArray[np.complexfloating[Any, Any]]


def seen_in(samples: Samples, found: Detections, radar: Radar, settings: Any) -> Floats:
    """Return the power (n,) [W] that samples (receiver, chirp, sample) of ramps at equal distances give where
    detections peak, between the cells of the map: of an array in the beam of each, else the mean of all antennas."""
    wave = radar.waveform
    taper = window(settings.range_window, wave.n_samples)
    fast = wave.chirp_duration / wave.n_samples * np.arange(wave.n_samples)
    doppler = 2.0 * wave.middle / C0 * found.rate
    power = np.zeros(len(found.range))
    for i, range in enumerate(found.range):
        beat = np.exp(2j * np.pi * (2.0 * wave.slope / C0 * range + doppler[i]) * fast)
        ramps = samples @ (taper / taper.sum() * beat)
        beam = found.beam[i].reshape(-1, len(ramps))
        slots = _slots(ramps, float(doppler[i]), len(beam) or len(radar.tx_elements), radar, settings.rate_window)
        power[i] = np.abs((slots * beam).sum()) ** 2 if beam.size else (np.abs(slots) ** 2).mean()
    # A real sample has half of an echo's amplitude at its own beat.
    return power if wave.complex_sampling else 4.0 * power


def _slots(ramps: Complexes, doppler: float, many: int, radar: Radar, name: str) -> Complexes:
    """Return what so many slots hold (s, a) of ramps (a, c) at a Doppler shift [Hz], as the map tells transmitters
    apart: by time division each has its own ramps, by Doppler division each turns from ramp to ramp. Args: name of the
    window along rate."""
    count, slots = np.arange(ramps.shape[1]), radar.slots
    turned = ramps * np.exp(2j * np.pi * doppler * radar.waveform.repetition * count)
    if radar.multiplexing == "tdm":
        taper = window(name, len(count) // slots)
        return np.stack([turned[:, s::slots] @ (taper / taper.sum()) for s in range(many)])
    taper = window(name, len(count))
    codes = np.exp(-2j * np.pi * (np.outer(count, np.arange(many)) % slots) / slots)
    return np.asarray((turned @ (codes * (taper / taper.sum())[:, None])).T)
