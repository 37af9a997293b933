"""Beat signals of point echoes under a train of linear ramps: the plain sum, and the quadratic phase of one rate."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.em.phasor import unit_phasor
from raychan.parallel import parallel_for

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


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

    def some(rows: slice) -> None:
        _beat_sum(amplitude, delay, growth, carrier, slope, repetition, step, rows.start, out[rows])

    parallel_for(chirps, some, 2)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _beat_sum(amplitude, delay, growth, carrier, slope, repetition, step, first, out):  # type: ignore[no-untyped-def]
    for m in range(first, first + len(out)):
        for p in range(delay.size):
            for s in range(out.shape[1]):
                t = s * step
                grown = growth[p] * (m * repetition + t)
                tau = delay[p] + grown
                turn = carrier * grown + slope * tau * (t - 0.5 * tau)
                angle = -2.0 * math.pi * (turn - math.floor(turn))
                out[m - first, s] += amplitude[p] * complex(math.cos(angle), math.sin(angle))


@njit(cache=True, nogil=True, forceinline=True)
def _chebyshev(n, x):  # type: ignore[no-untyped-def]
    before, this = x, 1.0
    for _ in range(n):
        before, this = this, 2.0 * x * this - before
    return this


@njit(cache=True, nogil=True)
def _bessel(n, x):  # type: ignore[no-untyped-def]
    """Return J_n(x) of small x, times 2 unless n is 0."""
    term = 1.0 if n == 0 else 2.0
    for i in range(n):
        term *= 0.5 * x / (i + 1)
    total, k = term, 0
    while abs(term) > 1e-17:
        k += 1
        term *= -0.25 * x * x / (k * (k + n))
        total += term
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def sources(x, y, strength, amplitude, delay, growth, later, ramp, grid, rest, terms):  # type: ignore[no-untyped-def]
    """Write where echoes (n,) stand on a grid, x (n,) rows of frequency per time and y (n,) columns of frequency per
    sample, and their strengths (n, p): see signal.keystone.

    Args: delay and growth as for `beat_sum` but at the middle instant, later (n,) [s] to be added to it; ramp carrier
    [Hz], slope [Hz/s], then, t [s], step [s]; grid delay, frequency, row zero, rows per Hz, middle row, columns a
    turn, margin; rest (2, 4): middle, 1 / half width, order and half
    width of the two small terms; terms (j,): the last order of the first that goes with each of the second.
    """
    carrier, slope, then, t, step = ramp
    middle, frequency, shift_0, dense, row_0, columns, margin = grid
    for i in range(delay.size):
        tau, b = delay[i] + later[i], growth[i]
        off = tau - middle
        shift = b * (frequency - slope * off)
        x[i] = (shift - shift_0) * dense + row_0
        turn = (slope * tau + shift) * step
        turn -= math.floor(turn)
        y[i] = turn * columns + margin
        cosine, sine = unit_phasor(carrier * (b * then + later[i]) + slope * tau * (t - 0.5 * tau))
        size = amplitude[i] * complex(cosine, sine)
        far = (b * slope * off * slope / frequency - rest[0, 0]) * rest[0, 1]
        late = (-0.5 * slope * b * b - rest[1, 0]) * rest[1, 1]
        p = 0
        for j in range(len(terms)):
            for k in range(terms[j] + 1):
                strength[i, p] = size * (_chebyshev(k, far) * _chebyshev(j, late))
                p += 1


@njit(cache=True, nogil=True, error_model="numpy")
def stretched(place, factor, frame, rest, terms, falloff):  # type: ignore[no-untyped-def]
    """Write where in the transforms over shifts each sample (m, s) is read off, and its factors (p, m, s) there: see
    signal.keystone.

    Args: frame repetition, step [s], stretch [1/s], middle shift [Hz], rows per Hz, oversampling, length of the
    transform; rest and terms as for `sources`; falloff, coefficients of 1 over the kernel's transform.
    """
    repetition, step, stretch, shift, dense, over, length = frame
    chirps, samples = place.shape
    order_b, order_a = int(rest[0, 2]), int(rest[1, 2])
    turns_b, turns_a = 2.0 * math.pi * rest[0, 3], 2.0 * math.pi * rest[1, 3]
    size_b, size_a = np.ones(order_b + 1), np.ones(order_a + 1)
    for m in range(chirps):
        late = (m - chirps // 2) * repetition
        for s in range(samples):
            t = (s - samples // 2) * step
            u = late * (1.0 + stretch * t) + stretch * t * t
            place[m, s] = length * (u / dense + 0.5)
            at = 2.0 * (2.0 * over * u / dense) ** 2 - 1.0
            value = falloff[0]
            for d in range(1, len(falloff)):
                value = value * at + falloff[d]
            far, long = (late + t) * t, (late + t) ** 2
            cosine, sine = unit_phasor(shift * u + rest[0, 0] * far + rest[1, 0] * long)
            if order_b > 0:
                for k in range(order_b + 1):
                    size_b[k] = _bessel(k, turns_b * far)
            if order_a > 0:
                for j in range(order_a + 1):
                    size_a[j] = _bessel(j, turns_a * long)
            p, quarter = 0, complex(value * cosine, value * sine)
            for j in range(order_a + 1):
                turned = quarter
                for k in range(terms[j] + 1):
                    factor[p, m, s] = turned * (size_b[k] * size_a[j])
                    turned *= -1j
                    p += 1
                quarter *= -1j


_ABREAST = 8  # echoes whose recurrences run side by side, so that a core's vector unit is full
_PIECE = 128  # samples after which a recurrence starts anew from the exact phase


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
    out = np.zeros((len(delay), samples), np.complex128)

    def some(rows: slice) -> None:
        _ramp_sums(amplitude[rows], delay[rows], growth[rows], carrier, slope, step, out[rows])

    parallel_for(len(delay), some, 2)
    return out


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _ramp_sums(amplitude, delay, growth, carrier, slope, step, out):  # type: ignore[no-untyped-def]
    (ramps, count), samples = delay.shape, out.shape[1]
    for m in range(ramps):
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
