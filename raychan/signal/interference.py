"""Mutual interference: the ramps of a second radar in the samples of the first.

The victim mixes what arrives with its own ramp. The difference frequency is f_i + S_i u - f_v - S_v t, with u the time
in the interferer's ramp at which it left and t that in the victim's. The filter before the converter lets the band
pass that the range axis shows: -fs to 0 with I/Q sampling, -fs/2 to fs/2 with real sampling. Ramps that cross give a
burst of length fs / |S_i - S_v|, whose sum of |sample|^2 is P fs^2 / |S_i - S_v|, with real sampling half of it, as
samples are real parts; parallel ones a line in range.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.radar.dual_paths import amplitudes_of
from raychan.radar.interferer import Interferer
from raychan.radar.radar import Radar
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.records import Paths
from raychan.signal.fronts import fronts_of
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def burst(victim: Radar, interferer: Interferer, paths: Paths, rng: np.random.Generator) -> Complexes:
    """Return what an interferer adds to the samples (a, c, s) [sqrt(W)] of a victim.

    The filter is sharp: a beat passes whole while its frequency at that instant is within the band.
    Args: paths one way from the interferer to the victim, both antennas in, at the interferer's carrier.
    Source: Brooker, IEEE Trans. EMC 49(1), 2007; Toth et al., Asilomar Conf., 2018.
    """
    wave, other = victim.waveform, interferer.radar.waveform
    if isinstance(wave, OwnWaveform):
        raise ValueError("interference into a radar whose waveform is its own: only ramps are mixed with ramps")
    elements, fronts = victim.elements_world, fronts_of(paths)
    out = np.zeros((victim.receivers, wave.n_chirps, wave.n_samples), np.complex128)
    phases = interferer.ramp_phases(rng)
    rate = wave.sample_rate
    band = (-rate, 0.0) if wave.complex_sampling else (-0.5 * rate, 0.5 * rate)
    own = (wave.carrier, wave.slope, wave.chirp_duration / wave.n_samples, *band)
    others = (other.carrier, other.slope, other.chirp_duration)
    begin, begins = _starts(wave), interferer.start + _starts(other)
    here, rows = np.zeros(3), iter(out)
    for name in amplitudes_of(paths):
        for element in elements:
            (longer, factor), faster = fronts.between(here, element), fronts.faster(here, element)
            later, growth = (longer - faster * fronts.instant) / C0, (paths.length_rate + faster) / C0
            size = np.sqrt(interferer.radar.power) * factor * getattr(paths, name)
            size = size * np.exp(-2j * np.pi * other.carrier * later)
            _burst(size, paths.delay + later, growth, own, others, begin, begins, phases, next(rows))
    if not wave.complex_sampling:
        out.imag = 0.0
    return out


def _starts(wave: Waveform) -> Floats:
    """Return when the ramps (c,) start [s]."""
    return np.array([wave.start_of(m) for m in range(wave.n_chirps)])


@njit(cache=True, nogil=True, error_model="numpy")
def _burst(amplitude, delay, delay_rate, own, others, begin, begins, phases, out):  # type: ignore[no-untyped-def]
    """Add to samples (c, s) of one receiver; amplitudes hold the phase of the carrier over the delay at time 0."""
    f_v, s_v, step, low, high = own
    f_i, s_i, duration = others
    for p in range(amplitude.size):
        for m in range(out.shape[0]):
            for s in range(out.shape[1]):
                t = s * step
                now = begin[m] + t
                grown = delay_rate[p] * now
                sent = now - (delay[p] + grown)
                n = np.searchsorted(begins, sent, "right") - 1
                if n < 0 or sent - begins[n] >= duration:
                    continue
                u = sent - begins[n]
                if not low <= f_i + s_i * u - f_v - s_v * t <= high:
                    continue
                # The carrier's phase over the delay is in the amplitude.
                turn = (f_i - f_v) * t + f_i * (u + delay[p] - t) + 0.5 * (s_i * u * u - s_v * t * t) + phases[n]
                angle = 2.0 * math.pi * (turn - math.floor(turn))
                out[m, s] += amplitude[p] * complex(math.cos(angle), math.sin(angle))
