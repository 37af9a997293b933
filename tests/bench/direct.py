"""The direct sum of beat signals as fast as it honestly goes: phase recurrences, no sines, many paths abreast."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

_ABREAST = 8  # paths whose recurrences run side by side, so that a core's vector unit is full
_PIECE = 128  # samples after which the recurrence starts anew from the exact phase


@njit(cache=True, parallel=True, fastmath=True, error_model="numpy")
def recurrent_sum(amplitude, delay, growth, carrier, slope, repetition, step, chirps, samples):
    """Return samples (chirps, samples) of echoes (n,): the sum of `signal.dechirp.beat_sum`, same arguments.

    Along a ramp the phase is quadratic in the sample number, so that each sample follows from the one before by two
    complex products.
    """
    out = np.zeros((chirps, samples), np.complex128)
    groups = (delay.size + _ABREAST - 1) // _ABREAST
    for m in prange(chirps):
        re, im = np.zeros(samples), np.zeros(samples)
        zr, zi, wr, wi = np.empty(_ABREAST), np.empty(_ABREAST), np.empty(_ABREAST), np.empty(_ABREAST)
        qr, qi = np.empty(_ABREAST), np.empty(_ABREAST)
        for g in range(groups):
            for start in range(0, samples, _PIECE):
                for lane in range(_ABREAST):
                    p = g * _ABREAST + lane
                    if p >= delay.size:
                        zr[lane], zi[lane], wr[lane], wi[lane], qr[lane], qi[lane] = 0.0, 0.0, 1.0, 0.0, 1.0, 0.0
                        continue
                    turn = np.empty(3)
                    for i in range(3):
                        t = (start + i) * step
                        grown = growth[p] * (m * repetition + t)
                        tau = delay[p] + grown
                        turn[i] = carrier * grown + slope * tau * (t - 0.5 * tau)
                    first = -2.0 * math.pi * (turn[0] - math.floor(turn[0]))
                    stride = turn[1] - turn[0]
                    along = -2.0 * math.pi * (stride - math.floor(stride))
                    bend = -2.0 * math.pi * (turn[2] - 2.0 * turn[1] + turn[0])
                    a = amplitude[p] * complex(math.cos(first), math.sin(first))
                    zr[lane], zi[lane] = a.real, a.imag
                    wr[lane], wi[lane] = math.cos(along), math.sin(along)
                    qr[lane], qi[lane] = math.cos(bend), math.sin(bend)
                for s in range(start, min(start + _PIECE, samples)):
                    sr, si = 0.0, 0.0
                    for lane in range(_ABREAST):
                        sr += zr[lane]
                        si += zi[lane]
                        r = zr[lane] * wr[lane] - zi[lane] * wi[lane]
                        zi[lane] = zr[lane] * wi[lane] + zi[lane] * wr[lane]
                        zr[lane] = r
                        r = wr[lane] * qr[lane] - wi[lane] * qi[lane]
                        wi[lane] = wr[lane] * qi[lane] + wi[lane] * qr[lane]
                        wr[lane] = r
                    re[s] += sr
                    im[s] += si
        for s in range(samples):
            out[m, s] = complex(re[s], im[s])
    return out
