"""The unit phasor exp(-j phase) in loops: its value by its series, which is faster there than a library's sine and
cosine, and its mean over a triangle by Gauss-Legendre quadrature, the phase quadratic across it (numba kernels).

The inner loop of the quadrature has no branch and no library call, so that the compiler vectorises it.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

_SIZES = (8, 16, 24, 32)  # points along an edge, each a multiple of a vector unit's width
_REACH = (9.0, 35.0, 62.0, 92.0)  # rad by which the phase may run and bend in all for an error of 1e-6
RULES = np.zeros((len(_SIZES), 2, max(_SIZES)))
for _at, _size in enumerate(_SIZES):
    _knots, _weights = np.polynomial.legendre.leggauss(_size)
    RULES[_at, 0, :_size], RULES[_at, 1, :_size] = 0.5 * _knots + 0.5, 0.5 * _weights
_EVEN = np.array([(-1.0) ** i / math.factorial(2 * i) for i in range(10)])
_ODD = np.array([(-1.0) ** i / math.factorial(2 * i + 1) for i in range(10)])


@njit(cache=True, nogil=True, forceinline=True)
def unit_phasor(turn):  # type: ignore[no-untyped-def]
    """Return cosine and sine of -2 pi times a number of turns, by their series about the nearest quarter turn."""
    quarter = math.floor(4.0 * turn + 0.5)
    x = 2.0 * math.pi * (turn - 0.25 * quarter)
    q = quarter - 4.0 * math.floor(0.25 * quarter)
    s = x * x
    sine = -1.0 / 39916800.0 + s * (1.0 / 6227020800.0 - s * (1.0 / 1307674368000.0))
    sine = x * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362880.0 + s * sine)))))
    cosine = 1.0 / 40320.0 + s * (-1.0 / 3628800.0 + s * (1.0 / 479001600.0 - s * (1.0 / 87178291200.0)))
    cosine = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * cosine)))
    odd = q == 1.0 or q == 3.0
    re = sine if odd else cosine
    im = cosine if odd else sine
    return (-re if q == 1.0 or q == 2.0 else re), (im if q >= 2.0 else -im)


@njit(cache=True, nogil=True, forceinline=True)
def times(x, z):  # type: ignore[no-untyped-def]
    """Return the real number x times z: numba multiplies both as complex numbers, three times the work."""
    return complex(x * z.real, x * z.imag)


@njit(cache=True, nogil=True, forceinline=True)
def times_j(x, z):  # type: ignore[no-untyped-def]
    """Return j x z for a real number x."""
    return complex(-x * z.imag, x * z.real)


@njit(cache=True)
def points_for(reach):  # type: ignore[no-untyped-def]
    """Return how many points along an edge a phase needs that runs and bends by `reach` [rad] in all; 0: more than any
    rule has."""
    for i in range(len(_SIZES)):
        if reach <= _REACH[i]:
            return _SIZES[i]
    return 0


@njit(cache=True, fastmath=True, error_model="numpy", forceinline=True)
def even_phasor(turn, size):  # type: ignore[no-untyped-def]
    """Return real and imaginary part of exp(-2 pi j turn) times a size, by the series about the nearest half turn:
    without a branch, for loops that the compiler vectorises."""
    half = np.floor(2.0 * turn + 0.5)
    angle = 2.0 * math.pi * (turn - 0.5 * half)
    square = angle * angle
    cosine, sine = _EVEN[9], _ODD[9]
    for d in range(8, -1, -1):
        cosine = cosine * square + _EVEN[d]
        sine = sine * square + _ODD[d]
    size *= 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
    return size * cosine, -size * sine * angle


@njit(cache=True, fastmath=True, error_model="numpy")
def _along(first, step, bend, knots, weights):  # type: ignore[no-untyped-def]
    """Return the integrals over x from 0 to 1 of exp(-j 2 pi turn) and of x times it, real and imaginary parts, where
    turn = first + x step + x (1 - x) bend."""
    whole_re, whole_im, late_re, late_im = 0.0, 0.0, 0.0, 0.0
    for i in range(len(knots)):
        x = knots[i]
        re, im = even_phasor(first + x * (step + bend * (1.0 - x)), weights[i])
        whole_re += re
        whole_im += im
        late_re += x * re
        late_im += x * im
    return whole_re, whole_im, late_re, late_im


@njit(cache=True, uncounted=True)
def mean_parts(phases, bend01, bend12, bend20, points, out):  # type: ignore[no-untyped-def]
    """Write the parts (3,) of the mean of exp(-j phi) over a triangle that belong to each corner: those weighted by the
    corner's barycentric coordinate.

    Args: phases (3,) or more [rad], first at the corners; bends [rad] of the edges' middles from straight; points along
    an edge, from `points_for`.
    """
    rule = RULES[points // 8 - 1]
    knots, weights = rule[0, :points], rule[1, :points]
    turn = 0.5 / math.pi
    # Relative to the first corner's phase, which may be many turns.
    p1, p2 = turn * (phases[1] - phases[0]), turn * (phases[2] - phases[0])
    b01, b12, b20 = turn * bend01, turn * bend12, turn * bend20
    part0, part1, part2 = 0j, 0j, 0j
    for q in range(points):
        w, rest = knots[q], 1.0 - knots[q]
        first = w * p2 + 4.0 * w * rest * b20
        last = rest * p1 + w * p2 + 4.0 * w * rest * b12
        re, im, late_re, late_im = _along(first, last - first, 4.0 * rest * rest * b01, knots, weights)
        whole, late = complex(re, im), complex(late_re, late_im)
        share = 2.0 * weights[q] * rest
        part0 += share * rest * (whole - late)
        part1 += share * rest * late
        part2 += share * w * whole
    common = complex(math.cos(phases[0]), -math.sin(phases[0]))
    out[0], out[1], out[2] = common * part0, common * part1, common * part2
