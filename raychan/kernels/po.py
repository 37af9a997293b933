"""Physical optics of a flat triangle: the exact phase integral and the vector factor of its Huygens currents."""

from __future__ import annotations

import cmath
import math

import numpy as np
from numba import njit

from raychan.kernels.polar import Vec, cross, dot, mirror, reflect


@njit(cache=True)
def _radiated(e: Vec, k: Vec, s: Vec, n: Vec, r_s: complex, r_p: complex, g: Vec) -> complex:
    """Project on g what the currents of the reflected wave of (e, k) radiate towards s."""
    er = reflect(e, k, n, r_s, r_p)
    hr = cross(mirror(k, n), er)
    magnetic = cross(s, cross(n, er))
    electric = cross(n, hr)
    return dot(g, magnetic) + dot(g, electric)


@njit(cache=True)
def huygens(
    e_in: Vec, k_in: Vec, e_out: Vec, k_out: Vec, n: Vec, r_in: tuple[complex, complex], r_out: tuple[complex, complex]
) -> complex:
    """Return the reciprocal coupling of two waves by the Huygens currents of a unit area of surface.

    e_in travels along k_in from the transmitter; e_out along k_out is the receiver's field, were it to
    transmit. Both incidences are used and averaged, so that exchanging the two ends changes nothing
    (equal to classic physical optics for monostatic scattering). Multiply by -j k / 4 pi and the
    phase integral. Source: Stratton-Chu, reflected field only; Balanis, Advanced EE, 2012, sec. 7.10.
    """
    to_rx = (-k_out[0], -k_out[1], -k_out[2])
    to_tx = (-k_in[0], -k_in[1], -k_in[2])
    forward = _radiated(e_in, k_in, to_rx, n, r_in[0], r_in[1], e_out)
    backward = _radiated(e_out, k_out, to_tx, n, r_out[0], r_out[1], e_in)
    return 0.5 * (forward + backward)


@njit(cache=True)
def _edge(a: float, b: float, ea: complex, eb: complex) -> complex:
    """Mean of exp(-j phi) along a line on which phi runs from a to b, given exp(-j a) and exp(-j b)."""
    gap = b - a
    if abs(gap) < 1e-3:
        return ea * complex(1.0 - gap * gap / 6.0, gap * (gap * gap / 24.0 - 0.5))
    return 1j * (eb - ea) / gap


@njit(cache=True)
def _corner_terms(
    p0: float, p1: float, p2: float, e0: complex, e1: complex, e2: complex
) -> tuple[complex, complex, complex]:
    """Return the parts of the mean of exp(-j phi) over a triangle that belong to each corner, given e = exp(-j p).

    The mean is the second divided difference of exp at the corner phases (Hermite-Genocchi), times two: Gordon
    (1975) for a triangle, without his singular cases. Where the phase runs, it is a sum of corner terms; what
    corners within 2 rad have in common is shared equally.
    """
    # Sorted, low to high, with the place each came from.
    i0, i1, i2 = 0, 1, 2
    if p0 > p1:
        p0, p1, e0, e1, i0, i1 = p1, p0, e1, e0, i1, i0
    if p1 > p2:
        p1, p2, e1, e2, i1, i2 = p2, p1, e2, e1, i2, i1
    if p0 > p1:
        p0, p1, e0, e1, i0, i1 = p1, p0, e1, e0, i1, i0
    span, x = p2 - p0, p1 - p0
    if span < 2.0:
        if span < 0.05:
            # Complete homogeneous sums of (0, x, span): the divided difference as a series.
            xx, yy, xy = x * x, span * span, x * span
            real = 1.0 - (xx + xy + yy) / 12.0 + (xx * xx + xx * xy + xx * yy + xy * yy + yy * yy) / 360.0
            whole = e0 * complex(real, -(x + span) / 3.0 + (x + span) * (xx + yy) / 60.0)
        else:
            whole = 2j * (_edge(p1, p2, e1, e2) - _edge(p0, p1, e0, e1)) / span
        # First order in the phase: the mean of l_i phi over a triangle is (phi_i - mean) / 12.
        mean = (x + span) / 3.0
        t0 = whole * complex(1.0 / 3.0, mean / 12.0)
        t1 = whole * complex(1.0 / 3.0, (mean - x) / 12.0)
        t2 = whole * complex(1.0 / 3.0, (mean - span) / 12.0)
    else:
        scale = 2j / span
        gap = p2 - p1
        if gap < 2.0:
            upper = scale * _edge(p1, p2, e1, e2)
            t1, t2 = upper * complex(0.5, gap / 12.0), upper * complex(0.5, -gap / 12.0)
        else:
            t1, t2 = scale * e1 / (1j * gap), -scale * e2 / (1j * gap)
        if x < 2.0:
            lower = scale * _edge(p0, p1, e0, e1)
            t0 = -lower * complex(0.5, x / 12.0)
            t1 -= lower * complex(0.5, -x / 12.0)
        else:
            t0 = -scale * e0 / (1j * x)
            t1 += scale * e1 / (1j * x)
    r0 = t0 if i0 == 0 else (t1 if i1 == 0 else t2)
    r1 = t0 if i0 == 1 else (t1 if i1 == 1 else t2)
    r2 = t0 if i0 == 2 else (t1 if i1 == 2 else t2)
    return r0, r1, r2


_MOST = 20  # pieces along an edge: enough for the most that a tube which counts may bend


@njit(cache=True)
def triangle_terms(phases, linear: float, out) -> int:  # type: ignore[no-untyped-def]
    """Integrate exp(-j phi) over a triangle on which phi is quadratic; return how many pieces it took.

    Args: phases (6,) [rad] at the corners 0, 1, 2 and the middles of edges 01, 12, 20; linear [rad] how far a piece's
    phase may bend from linear. out (3,) receives the mean's parts that belong to each corner (their sum is the mean),
    so that each may be given its own delay. The triangle is cut in m^2 equal pieces, linear on each, with
    the mean bend of a piece put in its phase.
    """
    d01 = phases[3] - 0.5 * (phases[0] + phases[1])
    d12 = phases[4] - 0.5 * (phases[1] + phases[2])
    d20 = phases[5] - 0.5 * (phases[2] + phases[0])
    bend = max(abs(d01), abs(d12), abs(d20))
    m = min(max(1, math.ceil(math.sqrt(bend / linear))), _MOST)
    h = 1.0 / m
    # The mean of a piece's own bend: a third of the sum of its edges' bends, alike for all pieces.
    shift = cmath.exp(-1j * (d01 + d12 + d20) * h * h / 3.0) * h * h
    if m == 1:
        e0, e1, e2 = cmath.exp(-1j * phases[0]), cmath.exp(-1j * phases[1]), cmath.exp(-1j * phases[2])
        t0, t1, t2 = _corner_terms(phases[0], phases[1], phases[2], e0, e1, e2)
        out[0], out[1], out[2] = shift * t0, shift * t1, shift * t2
        return 1
    p, e = np.empty((2, m + 1)), np.empty((2, m + 1), np.complex128)
    total, s1, s2 = 0j, 0j, 0j
    # Along a row the phase is a parabola, so its exponential follows from two running factors.
    curve = -8.0 * d20 * h * h
    turn = cmath.exp(-1j * curve)
    for i in range(m + 1):
        row = i & 1
        v = i * h
        first = _quadratic(phases, d01, d12, d20, v, 0.0)
        step = _quadratic(phases, d01, d12, d20, v, h) - first
        value, factor = cmath.exp(-1j * first), cmath.exp(-1j * step)
        for j in range(m - i + 1):
            p[row, j], e[row, j] = first, value
            first += step
            step += curve
            value *= factor
            factor *= turn
        if i == 0:
            continue
        # Pieces between rows i - 1 and i: upright ones, then their neighbours (flipped).
        low = 1 - row
        for j in range(m - i + 1):
            p0, p1, p2 = p[low, j], p[row, j], p[low, j + 1]
            t0, t1, t2 = _corner_terms(p0, p1, p2, e[low, j], e[row, j], e[low, j + 1])
            total += t0 + t1 + t2
            s1 += t0 * (i - 1) + t1 * i + t2 * (i - 1)
            s2 += t0 * j + t1 * j + t2 * (j + 1)
            if j < m - i:
                p0, p1, p2 = p[row, j + 1], p[low, j + 1], p[row, j]
                t0, t1, t2 = _corner_terms(p0, p1, p2, e[row, j + 1], e[low, j + 1], e[row, j])
                total += t0 + t1 + t2
                s1 += t0 * i + t1 * (i - 1) + t2 * i
                s2 += t0 * (j + 1) + t1 * (j + 1) + t2 * j
    out[0], out[1], out[2] = shift * (total - (s1 + s2) * h), shift * s1 * h, shift * s2 * h
    return m * m


@njit(cache=True, inline="always")
def _quadratic(phases, d01, d12, d20, v, w):  # type: ignore[no-untyped-def]
    u = 1.0 - v - w
    return u * phases[0] + v * phases[1] + w * phases[2] + 4.0 * (d01 * u * v + d12 * v * w + d20 * w * u)


@njit(cache=True, nogil=True)
def quadratic_means(phases, linear):  # type: ignore[no-untyped-def]
    """Return the mean of exp(-j phi) over each triangle of (n, 6) corner and mid-edge phases."""
    out = np.empty(phases.shape[0], np.complex128)
    part = np.empty(3, np.complex128)
    for i in range(phases.shape[0]):
        triangle_terms(phases[i], linear, part)
        out[i] = part[0] + part[1] + part[2]
    return out
