"""Kernels of the keystone sum (see signal.keystone): where echoes lie on its grid, where samples are read off it."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.phasor import unit_phasor


@njit(cache=True, nogil=True, forceinline=True)
def _chebyshev(n, x):  # type: ignore[no-untyped-def]
    """Return the Chebyshev polynomial T_n(x) by its recurrence."""
    before, this = x, 1.0
    for _ in range(n):
        before, this = this, 2.0 * x * this - before
    return this


@njit(cache=True, nogil=True)
def _bessel(n, x):  # type: ignore[no-untyped-def]
    """Return J_n(x) of small x, times 2 unless n is 0, by its power series (Abramowitz & Stegun 9.1.10)."""
    term = 1.0 if n == 0 else 2.0
    for i in range(n):
        term *= 0.5 * x / (i + 1)
    total, k = term, 0
    while abs(term) > 1e-17:
        k += 1
        term *= -0.25 * x * x / (k * (k + n))
        total += term
    return total


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def place_boxes(box, delay, delay_rate, grid, size, across):  # type: ignore[no-untyped-def]
    """Write in which box (n,) of the grid echoes (n,) lie, `across` boxes in a row of such size: rows, columns.

    Args: delay [s], delay_rate at the middle instant; grid slope [Hz/s], middle delay, frequency, shift of row zero,
    rows per Hz, middle row, columns a turn, step [s].
    """
    slope, middle, frequency, shift_0, dense, row_0, columns, step = grid
    for i in range(delay.size):
        shift = delay_rate[i] * (frequency - slope * (delay[i] - middle))
        turn = (slope * delay[i] + shift) * step
        row, column = int((shift - shift_0) * dense + row_0), int((turn - math.floor(turn)) * columns)
        box[i] = row // size[0] * across + column // size[1]


@njit(cache=True, nogil=True, error_model="numpy")
def place_sources(x, y, strength, amplitude, delay, delay_rate, later, faster, ramp, grid, rest, terms):  # type: ignore[no-untyped-def]
    """Write where echoes (n,) lie on the grid, x (n,) rows of Doppler shift and y (n,) columns of beat frequency, and
    their strengths (n, p), one for each term of the series.

    Args: delay [s] and delay_rate at the middle instant; later (n,) [s] and faster (n,) are added to them; ramp carrier
    [Hz], slope [Hz/s], then (middle instant), t (the same from its ramp's start), step [s]; grid middle delay,
    frequency, shift of row zero, rows per Hz, middle row, columns a turn, margin; rest (2, 4): middle, 1 / half width,
    order and half width of the small terms B and A; terms (j,): the last order of B's series with each order of A's.
    """
    carrier, slope, then, t, step = ramp
    middle, frequency, shift_0, dense, row_0, columns, margin = grid
    for i in range(delay.size):
        tau, b = delay[i] + later[i], delay_rate[i] + faster[i]
        off = tau - middle
        shift = b * (frequency - slope * off)
        x[i] = (shift - shift_0) * dense + row_0
        turn = (slope * tau + shift) * step
        turn -= math.floor(turn)
        y[i] = turn * columns + margin
        cosine, sine = unit_phasor(carrier * (delay_rate[i] * then + later[i]) + slope * tau * (t - 0.5 * tau))
        size = amplitude[i] * complex(cosine, sine)
        far = (b * slope * off * slope / frequency - rest[0, 0]) * rest[0, 1]
        late = (-0.5 * slope * b * b - rest[1, 0]) * rest[1, 1]
        p = 0
        for j in range(len(terms)):
            for k in range(terms[j] + 1):
                strength[i, p] = size * (_chebyshev(k, far) * _chebyshev(j, late))
                p += 1


@njit(cache=True, nogil=True, error_model="numpy")
def place_samples(place, factor, some, frame, rest, terms, falloff):  # type: ignore[no-untyped-def]
    """Write at which place of the transforms over shifts each sample (m, s) is read off, and its factors (p, m, s).

    Args: some, the first chirp to write and the one after the last; frame repetition, step [s], stretch [1/s], middle
    shift [Hz], rows per Hz, oversampling, length of the transform; rest and terms as for `place_sources`; falloff,
    coefficients of the polynomial that divides by the kernel's transform.
    """
    repetition, step, stretch, shift, dense, over, length = frame
    chirps, samples = place.shape
    order_b, order_a = int(rest[0, 2]), int(rest[1, 2])
    turns_b, turns_a = 2.0 * math.pi * rest[0, 3], 2.0 * math.pi * rest[1, 3]
    size_b, size_a = np.ones(order_b + 1), np.ones(order_a + 1)
    for m in range(some[0], some[1]):
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
