"""Mutual interference: the ramps of a second radar in the samples of the first.

The victim mixes what arrives with its own ramp. The difference frequency is f_i + S_i u - f_v - S_v t, with u the time
in the interferer's ramp at which it left and t that in the victim's. The filter before the converter lets the band
pass that the range axis shows: -fs to 0 with I/Q sampling, -fs/2 to fs/2 with real sampling. Ramps that cross give a
burst of length fs / |S_i - S_v|, whose sum of |sample|^2 is P fs^2 / |S_i - S_v|; parallel ones a line in range.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.radar.interferer import Interferer
from raychan.radar.radar import Radar
from raychan.records import Paths
from raychan.units import C0

Complexes = NDArray[np.complex128]


def burst(victim: Radar, interferer: Interferer, paths: Paths, rng: np.random.Generator) -> Complexes:
    """Return what an interferer adds to the samples (a, c, s) [sqrt(W)] of a victim.

    The filter is sharp: a beat passes whole while its frequency at that instant is within the band.
    Args: paths one way from the interferer to the victim, both antennas in, at the interferer's carrier.
    Source: Brooker, IEEE Trans. EMC 49(1), 2007; Toth et al., Asilomar Conf., 2018.
    """
    wave, other = victim.waveform, interferer.radar.waveform
    elements = victim.elements_world
    out = np.zeros((len(elements), wave.n_chirps, wave.n_samples), np.complex128)
    phases = interferer.ramp_phases(rng)
    rate = wave.sample_rate
    band = (-rate, 0.0) if wave.complex_sampling else (-0.5 * rate, 0.5 * rate)
    own = (wave.carrier, wave.slope, wave.repetition, wave.chirp_duration / wave.n_samples, *band)
    theirs = (other.carrier, other.slope, other.repetition, other.chirp_duration, interferer.start)
    for layer, element in zip(out, elements, strict=True):
        later = -(paths.arrival @ element) / C0
        size = np.sqrt(interferer.radar.power) * paths.amplitude * np.exp(-2j * np.pi * other.carrier * later)
        _burst(size, paths.delay + later, paths.length_rate / C0, own, theirs, phases, layer)
    if not wave.complex_sampling:
        out.imag = 0.0
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _burst(amplitude, delay, delay_rate, own, theirs, phases, out):  # type: ignore[no-untyped-def]
    """Add to samples (c, s) of one receiver; amplitudes hold the phase of the carrier over the delay at time 0."""
    f_v, s_v, repetition, step, low, high = own
    f_i, s_i, interval, duration, start = theirs
    for p in range(amplitude.size):
        for m in range(out.shape[0]):
            for s in range(out.shape[1]):
                t = s * step
                now = m * repetition + t
                grown = delay_rate[p] * now
                sent = now - (delay[p] + grown) - start
                n = math.floor(sent / interval)
                u = sent - n * interval
                if n < 0 or n >= phases.size or u >= duration:
                    continue
                if not low <= f_i + s_i * u - f_v - s_v * t <= high:
                    continue
                # The carrier's phase over the delay is in the amplitude.
                turn = (f_i - f_v) * t + f_i * (u + delay[p] - t) + 0.5 * (s_i * u * u - s_v * t * t) + phases[n]
                angle = 2.0 * math.pi * (turn - math.floor(turn))
                out[m, s] += amplitude[p] * complex(math.cos(angle), math.sin(angle))
