"""Beat signals of point echoes under a train of linear ramps: the plain sum, and the quadratic phase of one rate."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@njit(cache=True, parallel=True, error_model="numpy")
def beat_sum(
    amplitude: Complexes,
    delay: Floats,
    growth: Floats,
    carrier: float,
    slope: float,
    repetition: float,
    step: float,
    chirps: int,
    samples: int,
) -> Complexes:
    """Return samples (chirps, samples) of echoes (n,), term by term: the oracle of every faster way.

    Args: amplitude at time 0, carrier phase in; delay at time 0 [s]; growth of the delay per time (2 v / c);
    carrier [Hz]; slope [Hz/s]; repetition and sample step [s].
    """
    out = np.zeros((chirps, samples), np.complex128)
    for m in prange(chirps):
        for p in range(delay.size):
            for s in range(samples):
                t = s * step
                grown = growth[p] * (m * repetition + t)
                tau = delay[p] + grown
                turn = carrier * grown + slope * tau * (t - 0.5 * tau)
                angle = -2.0 * math.pi * (turn - math.floor(turn))
                out[m, s] += amplitude[p] * complex(math.cos(angle), math.sin(angle))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def add_bent(out: Complexes, plane: Complexes, growth: float, slope: float, repetition: float, step: float) -> None:
    """Add to out (chirps, samples) the sum of plane phases times what bends them: range migration and its kin.

    With M and t counted from the middle sample (chirps // 2, samples // 2) the phase of an echo that is neither
    constant nor linear in them is -2 pi S b [(1 - b) M t + (1 - b/2) t^2 - (b/2) M^2], b the growth of its delay.
    """
    chirps, samples = out.shape
    first = -(samples // 2)
    bend = np.empty(samples, np.complex128)
    for s in range(samples):
        angle = -2.0 * math.pi * slope * growth * (1.0 - 0.5 * growth) * ((first + s) * step) ** 2
        bend[s] = complex(math.cos(angle), math.sin(angle))
    for m in range(chirps):
        late = (m - chirps // 2) * repetition
        twist = -2.0 * math.pi * slope * growth * (1.0 - growth) * late * step
        start = twist * first + math.pi * slope * (growth * late) ** 2
        turn = complex(math.cos(start), math.sin(start))
        one = complex(math.cos(twist), math.sin(twist))
        for s in range(samples):
            out[m, s] += plane[m, s] * bend[s] * turn
            turn *= one


_ABREAST = 8  # echoes whose recurrences run side by side, so that a core's vector unit is full
_PIECE = 128  # samples after which a recurrence starts anew from the exact phase


@njit(cache=True, parallel=True, fastmath=True, error_model="numpy")
def ramp_sums(
    amplitude: Complexes,
    delay: Floats,
    growth: Floats,
    carrier: float,
    slope: float,
    step: float,
    samples: int,
) -> Complexes:
    """Return samples (ramps, samples) of echoes (ramps, n) that every ramp has of its own.

    Args as for `beat_sum`, amplitude and delay at the start of each ramp. Along a ramp the phase is quadratic in the
    sample number, so that each sample follows from the one before by two complex products.
    """
    ramps, count = delay.shape
    out = np.zeros((ramps, samples), np.complex128)
    for m in prange(ramps):
        re, im = np.zeros(samples), np.zeros(samples)
        z, w, q = np.empty((2, _ABREAST)), np.empty((2, _ABREAST)), np.empty((2, _ABREAST))
        turn = np.empty(3)
        for first in range(0, count, _ABREAST):
            for start in range(0, samples, _PIECE):
                z[:], w[:], q[:] = 0.0, 0.0, 0.0
                for lane in range(min(_ABREAST, count - first)):
                    p = first + lane
                    for i in range(3):
                        t = (start + i) * step
                        grown = growth[m, p] * t
                        tau = delay[m, p] + grown
                        turn[i] = carrier * grown + slope * tau * (t - 0.5 * tau)
                    angle = -2.0 * math.pi * (turn[0] - math.floor(turn[0]))
                    begin = amplitude[m, p] * complex(math.cos(angle), math.sin(angle))
                    along = -2.0 * math.pi * (turn[1] - turn[0])
                    bend = -2.0 * math.pi * (turn[2] - 2.0 * turn[1] + turn[0])
                    z[0, lane], z[1, lane] = begin.real, begin.imag
                    w[0, lane], w[1, lane] = math.cos(along), math.sin(along)
                    q[0, lane], q[1, lane] = math.cos(bend), math.sin(bend)
                for s in range(start, min(start + _PIECE, samples)):
                    sum_re, sum_im = 0.0, 0.0
                    for lane in range(_ABREAST):
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
    return out


@njit(cache=True, nogil=True)
def periodic(table, n, fine, cells):  # type: ignore[no-untyped-def]
    """Return a window's response at `cells` (m,) cells from its peak, linear between `fine` points a cell.

    Args: table (n fine + 1,) one period of the response of n samples, its phase counted from their middle.
    """
    out = np.empty(len(cells), np.complex128)
    for i in range(len(cells)):
        period = math.floor(cells[i] / n)
        at = (cells[i] - period * n) * fine
        low = min(int(at), n * fine - 1)
        value = table[low] + (at - low) * (table[low + 1] - table[low])
        # One period on, a response counted from the middle of an even window has turned its sign.
        out[i] = -value if (int(period) * (n - 1)) % 2 else value
    return out
