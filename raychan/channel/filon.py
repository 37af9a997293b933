"""Filon's rule over footprints: points at which a factor of the integrand, smooth against its phase, is taken.

The mean of exp(-j k L) f over a triangle is the sum of f at points times weights, the means of exp(-j k L) times the
polynomials that are 1 at one point and 0 at the others (L. N. G. Filon, Proc. R. Soc. Edinburgh 49, 1928): as good as
these polynomials follow f, however far k L runs. The phase f = exp(-j x) that an element of an array adds runs along
straight lines evenly; through n Chebyshev points along a line over which x runs by 2 a polynomials follow it up to some
2 J_n(a) (Trefethen, Approximation Theory and Approximation Practice, 2013, ch. 8), nearly nothing once n exceeds a.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.em.phasor import RULES, even_phasor, points_for
from raychan.parallel import parallel_for

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]

_WHOLE = 32  # Gauss points of one of several stretches of a line
_HIT = 1e-14  # of a line: nearer than this a point is where the rule has one
_RUNS = 80.0  # rad by which the phase may run over such a stretch; with points_for's own 92 rad the error is 1e-6


def points_over(run: Floats, part: Floats) -> Ints:
    """Return how many points triangles (r,) need: run (r, 3) [rad], by how much the phase of the smooth factor differs
    at most along the edges ab, bc, ca; part (r,), the error allowed of a factor of one."""
    count = np.empty(len(run), np.int64)
    parallel_for(len(run), lambda at: _counts(run[at], part[at], count[at]))
    return count


def filon(phases: Floats, run: Floats, part: Floats, count: Ints) -> tuple[Floats, Complexes]:
    """Return the barycentric coordinates (p, 3) of the points of triangles (r,), one triangle's after the other's, and
    their weights (p,): sums of these times a smooth factor at the points are means of exp(-j phase) times it.

    Args: phases (r, 6) [rad] at corners a, b, c and middles of edges ab, bc, ca, quadratic; run and part as for
    `points_over`, which gives count (r,).
    """
    first = np.cumsum(count) - count
    bary, weight = np.empty((int(count.sum()), 3)), np.empty(int(count.sum()), np.complex128)
    parallel_for(len(run), lambda at: _rules(first[at], phases[at], run[at], part[at], bary, weight))
    return bary, weight


@njit(cache=True)
def _along(half, part):  # type: ignore[no-untyped-def]
    """Return how many points a line needs over which the phase runs by 2 half [rad]: J_n by Debye's formula (Abramowitz
    and Stegun 9.3.7)."""
    n = max(1, math.ceil(half))
    while True:
        root = math.sqrt(max(1.0 - (half / n) ** 2, 0.0))
        size = half / n * math.exp(root) / (1.0 + root)
        if 2.0 * size**n <= part * math.sqrt(2.0 * math.pi * n * root):
            return n
        n += 1


@njit(cache=True)
def _apex(run):  # type: ignore[no-untyped-def]
    """Return the corner that lies opposite the edge of least run, and half the runs from it and along that edge."""
    apex = 0 if run[1] <= min(run[0], run[2]) else 1 if run[2] <= run[0] else 2
    return apex, 0.5 * max(run[apex], run[(apex + 2) % 3]), 0.5 * run[(apex + 1) % 3]


@njit(cache=True)
def _chebyshev(i, n):  # type: ignore[no-untyped-def]
    """Return Chebyshev point i of n from 0 to 1."""
    return 0.5 - 0.5 * math.cos(math.pi * (i + 0.5) / n)


@njit(cache=True, nogil=True)
def _counts(run, part, count):  # type: ignore[no-untyped-def]
    for r in range(len(run)):
        _, down, across = _apex(run[r])
        n, count[r] = _along(down, part[r]), 0
        for i in range(n):
            count[r] += _along(across * _chebyshev(i, n), part[r])


@njit(cache=True)
def _knots(reach):  # type: ignore[no-untyped-def]
    """Return points and weights of a rule for integrals from 0 to 1 whose phase runs by `reach` [rad]."""
    points, stretches = points_for(reach), 1
    if points == 0:
        points, stretches = _WHOLE, math.ceil(reach / _RUNS)
    x, w = np.empty(points * stretches), np.empty(points * stretches)
    rule = RULES[points // 8 - 1]
    for s in range(stretches):
        for q in range(points):
            x[s * points + q] = (s + rule[0, q]) / stretches
            w[s * points + q] = rule[1, q] / stretches
    return x, w


@njit(cache=True)
def _basis(x, n, out):  # type: ignore[no-untyped-def]
    """Write the polynomials (p, n) that are 1 at one of n Chebyshev points and 0 at the others, at x (p,): barycentric
    formula of the second kind (Berrut and Trefethen, SIAM Rev. 46, 2004)."""
    at, share = np.empty(n), np.empty(n)
    for i in range(n):
        at[i], share[i] = _chebyshev(i, n), (1.0 - 2.0 * (i % 2)) * math.sin(math.pi * (i + 0.5) / n)
    for q in range(len(x)):
        total, hit = 0.0, -1
        for i in range(n):
            off = x[q] - at[i]
            if abs(off) < _HIT:
                hit = i
                break
            out[q, i] = share[i] / off
            total += out[q, i]
        for i in range(n):
            out[q, i] = (1.0 if i == hit else 0.0) if hit >= 0 else out[q, i] / total


@njit(cache=True)
def _reach(phases, edge):  # type: ignore[no-untyped-def]
    """Return by how much [rad] the phase runs and bends in all along an edge."""
    a, b = phases[edge], phases[(edge + 1) % 3]
    return abs(a - b) + 4.0 * abs(phases[3 + edge] - 0.5 * (a + b))


@njit(cache=True, nogil=True)
def _rules(first, phases, run, part, bary, weight):  # type: ignore[no-untyped-def]
    for r in range(len(run)):
        _rule(first[r], phases[r], run[r], part[r], bary, weight)


@njit(cache=True, error_model="numpy")
def _rule(at, phases, run, part, bary, weight):  # type: ignore[no-untyped-def]
    """Write the rule of a triangle from number `at` on: points s along lines from its apex, where s is 0, to the edge
    opposite, where it is 1, and through each of them points t, 0 to 1, along a line parallel to that edge."""
    apex, down, across = _apex(run)
    b, c = (apex + 1) % 3, (apex + 2) % 3
    n = _along(down, part)
    # A polynomial of degree n adds to the run of the phase as exp(-j n x) does over 2.
    s, by_s = _knots(max(_reach(phases, apex), _reach(phases, c)) + 2.0 * n)
    t, by_t = _knots(_reach(phases, b) + 2.0 * _along(across, part))
    rows, line = np.empty((len(s), n)), np.empty((len(t), _along(across, part)))
    _basis(s, n, rows)
    real, imag = np.zeros((n, len(t))), np.zeros((n, len(t)))
    _lines(phases, (apex, b, c), (s, by_s, t, by_t), rows, real, imag)
    common = complex(math.cos(phases[apex]), -math.sin(phases[apex]))
    for i in range(n):
        x = _chebyshev(i, n)
        m = _along(across * x, part)
        _basis(t, m, line)
        for j in range(m):
            re, im = 0.0, 0.0
            for k in range(len(t)):
                re += line[k, j] * real[i, k]
                im += line[k, j] * imag[i, k]
            y = _chebyshev(j, m)
            bary[at, apex], bary[at, b], bary[at, c] = 1.0 - x, x * (1.0 - y), x * y
            weight[at] = common * complex(re, im)
            at += 1


@njit(cache=True, fastmath=True, error_model="numpy")
def _lines(phases, corners, knots, rows, real, imag):  # type: ignore[no-untyped-def]
    """Write the integrals (n, p), real and imaginary part, along s at knots t (p,) of exp(-j phase), relative to that
    of the apex, times the polynomials rows (k, n) at knots s (k,), times 2 s and the weights of t."""
    (a, b, c), (s, by_s, t, by_t) = corners, knots
    turn, n = 0.5 / math.pi, rows.shape[1]
    ab, ac = turn * (phases[b] - phases[a]), turn * (phases[c] - phases[a])
    bend_bc = turn * (phases[3 + b] - 0.5 * (phases[b] + phases[c]))
    bend_ab = turn * (phases[3 + a] - 0.5 * (phases[a] + phases[b]))
    bend_ca = turn * (phases[3 + c] - 0.5 * (phases[c] + phases[a]))
    res, ims, sum_re, sum_im = np.empty(len(s)), np.empty(len(s)), np.empty(n), np.empty(n)
    for j in range(len(t)):
        y = t[j]
        slope, bend = ab + y * (ac - ab), 4.0 * (bend_ab + y * (bend_ca - bend_ab))
        square = 4.0 * bend_bc * y * (1.0 - y)
        for k in range(len(s)):
            x = s[k]
            size = 2.0 * x * by_s[k] * by_t[j]
            res[k], ims[k] = even_phasor(x * (slope + (1.0 - x) * bend + x * square), size)
        sum_re[:], sum_im[:] = 0.0, 0.0
        for k in range(len(s)):
            re, im = res[k], ims[k]
            for i in range(n):
                sum_re[i] += rows[k, i] * re
                sum_im[i] += rows[k, i] * im
        for i in range(n):
            real[i, j], imag[i, j] = sum_re[i], sum_im[i]
