"""Beat signals of point echoes under linear ramps, sample by sample: the exact sum, which is the oracle of the fast
ones, and a sum for echoes that change from ramp to ramp."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def beat_sum(
    amplitude: Complexes,
    delay: Floats,
    delay_rate: Floats,
    carrier: float,
    slope: float,
    repetition: float,
    step: float,
    chirps: int,
    samples: int,
) -> Complexes:
    """Return samples (chirps, samples) of echoes (n,), each term evaluated exactly: the oracle of the faster sums.

    Args: amplitude at time 0, with its carrier phase; delay at time 0 [s]; delay_rate, its change per time (2 v / c);
    carrier [Hz]; slope [Hz/s]; repetition and sample step [s].
    Source: dechirp phase 2 pi (f_c tau + S t tau - S tau^2 / 2), Stove, IEE Proc. F 139(5), 1992.
    """
    out = np.zeros((chirps, samples), np.complex128)

    def some(rows: slice) -> None:
        _beat_sum(amplitude, delay, delay_rate, carrier, slope, repetition, step, rows.start, out[rows])

    parallel_for(chirps, some, 2)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _beat_sum(amplitude, delay, delay_rate, carrier, slope, repetition, step, first, out):  # type: ignore[no-untyped-def]
    for m in range(first, first + len(out)):
        for p in range(delay.size):
            for s in range(out.shape[1]):
                t = s * step
                grown = delay_rate[p] * (m * repetition + t)
                tau = delay[p] + grown
                turn = carrier * grown + slope * tau * (t - 0.5 * tau)
                angle = -2.0 * math.pi * (turn - math.floor(turn))
                out[m - first, s] += amplitude[p] * complex(math.cos(angle), math.sin(angle))


_LANES = 8  # echoes whose recurrences run side by side, so that a core's vector unit is full
_RESTART = 128  # samples after which a recurrence starts again from the exact phase, before rounding adds up


def ramp_sums(
    amplitude: Complexes,
    delay: Floats,
    delay_rate: Floats,
    carrier: float,
    slope: float,
    step: float,
    samples: int,
) -> Complexes:
    """Return samples (ramps, samples) of echoes (ramps, n) that differ from ramp to ramp.

    Args as for `beat_sum`, amplitude and delay at the start of each ramp. Along a ramp the phase is quadratic in the
    sample number, so each sample follows from the one before by two complex products.
    """
    out = np.zeros((len(delay), samples), np.complex128)

    def some(rows: slice) -> None:
        _ramp_sums(amplitude[rows], delay[rows], delay_rate[rows], carrier, slope, step, out[rows])

    parallel_for(len(delay), some, 2)
    return out


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _ramp_sums(amplitude, delay, delay_rate, carrier, slope, step, out):  # type: ignore[no-untyped-def]
    (ramps, count), samples = delay.shape, out.shape[1]
    pieces = (samples + _RESTART - 1) // _RESTART
    for m in range(ramps):
        re, im = np.zeros(samples), np.zeros(samples)
        # Phasors of the lanes: value, step to the next sample, turn of that step (first and second phase difference).
        z, w, q = np.empty((2, _LANES)), np.empty((2, _LANES)), np.empty((2, _LANES))
        turn = np.empty(3)
        for block in range((count + _LANES - 1) // _LANES * pieces):
            first, start = block // pieces * _LANES, block % pieces * _RESTART
            z[:], w[:], q[:] = 0.0, 0.0, 0.0
            for lane in range(min(_LANES, count - first)):
                p = first + lane
                for i in range(3):
                    t = (start + i) * step
                    grown = delay_rate[m, p] * t
                    tau = delay[m, p] + grown
                    turn[i] = carrier * grown + slope * tau * (t - 0.5 * tau)
                angle = -2.0 * math.pi * (turn[0] - math.floor(turn[0]))
                begin = amplitude[m, p] * complex(math.cos(angle), math.sin(angle))
                along = -2.0 * math.pi * (turn[1] - turn[0])
                bend = -2.0 * math.pi * (turn[2] - 2.0 * turn[1] + turn[0])
                z[0, lane], z[1, lane] = begin.real, begin.imag
                w[0, lane], w[1, lane] = math.cos(along), math.sin(along)
                q[0, lane], q[1, lane] = math.cos(bend), math.sin(bend)
            for s in range(start, min(start + _RESTART, samples)):
                sum_re, sum_im = 0.0, 0.0
                for lane in range(_LANES):
                    sum_re += z[0, lane]
                    sum_im += z[1, lane]
                    r = z[0, lane] * w[0, lane] - z[1, lane] * w[1, lane]
                    z[1, lane] = z[0, lane] * w[1, lane] + z[1, lane] * w[0, lane]
                    z[0, lane] = r
                    r = w[0, lane] * q[0, lane] - w[1, lane] * q[1, lane]
                    w[1, lane] = w[0, lane] * q[1, lane] + w[1, lane] * q[0, lane]
                    w[0, lane] = r
                re[s] += sum_re
                im[s] += sum_im
        for s in range(samples):
            out[m, s] = complex(re[s], im[s])
