"""Physical optics of a flat triangle: the exact phase integral and the vector factor of its Huygens currents."""

from __future__ import annotations

import cmath
import math

import numpy as np
from numba import njit

from raychan.kernels.polar import Vec, cross, dot, mirror, reflect


@njit(cache=True)
def _pair(a: float, b: float) -> complex:
    """Mean of exp(-j phi) along a line on which phi runs from a to b."""
    h = 0.5 * (a - b)
    s = 1.0 - h * h / 6.0 if abs(h) < 1e-4 else math.sin(h) / h
    return s * cmath.exp(-0.5j * (a + b))


@njit(cache=True)
def triangle_mean(p0: float, p1: float, p2: float) -> complex:
    """Return the mean of exp(-j phi) over a triangle on which phi is linear with corner values p0, p1, p2 [rad].

    The second divided difference of exp at the corner phases (Hermite-Genocchi), times two; equal to
    Gordon (1975) for a triangle, without his singular cases.
    """
    low, high = min(p0, p1, p2), max(p0, p1, p2)
    mid = p0 + p1 + p2 - low - high
    span = high - low
    if span < 0.02:
        m = (p0 + p1 + p2) / 3.0
        a, b, c = p0 - m, p1 - m, p2 - m
        second = (a * a + b * b + c * c) / 12.0
        third = (a * a * a + b * b * b + c * c * c) / 30.0
        return cmath.exp(-1j * m) * complex(1.0 - 0.5 * second, third / 6.0)
    return 2j * (_pair(mid, high) - _pair(low, mid)) / span


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
def _corner_terms(p0: float, p1: float, p2: float, out) -> None:  # type: ignore[no-untyped-def]
    """Write into out (3,) the parts of triangle_mean that belong to each corner.

    Where the phase runs, the integral is a sum of corner terms; what two or three corners within 2 rad have
    in common is shared equally.
    """
    values = (p0, p1, p2)
    low, high = 0, 0
    for i in range(1, 3):
        if values[i] < values[low]:
            low = i
        if values[i] >= values[high]:
            high = i
    span = values[high] - values[low]
    if span < 2.0 or low == high:
        # First order in the phase: the mean of l_i phi over a triangle is (phi_i - mean) / 12.
        whole, mean = triangle_mean(p0, p1, p2), (p0 + p1 + p2) / 3.0
        for i in range(3):
            out[i] = whole * complex(1.0 / 3.0, (mean - values[i]) / 12.0)
        return
    mid = 3 - low - high
    out[0], out[1], out[2] = 0j, 0j, 0j
    for a, b, sign in ((mid, high, 1.0), (low, mid, -1.0)):
        gap = values[b] - values[a]
        scale = 2j * sign / span
        if gap < 2.0:
            edge = scale * _pair(values[a], values[b])
            out[a] += edge * complex(0.5, gap / 12.0)
            out[b] += edge * complex(0.5, -gap / 12.0)
        else:
            out[a] += scale * cmath.exp(-1j * values[a]) / (1j * gap)
            out[b] -= scale * cmath.exp(-1j * values[b]) / (1j * gap)


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
    m = min(max(1, math.ceil(math.sqrt(bend / linear))), 64)
    out[0], out[1], out[2] = 0j, 0j, 0j
    h = 1.0 / m
    # The mean of a piece's own bend: a third of the sum of its edges' bends, alike for all pieces.
    shift = cmath.exp(-1j * (d01 + d12 + d20) * h * h / 3.0) * h * h
    part = np.empty(3, np.complex128)
    for i in range(m):
        for j in range(m - i):
            for flip in range(2):
                if flip == 1 and j == m - i - 1:
                    continue
                # Corners in steps along edges 01 and 02; the flipped piece is the upright one's neighbour.
                a = (i + flip, j + flip)
                b = (i + 1, j) if flip == 0 else (i, j + 1)
                c = (i, j + 1) if flip == 0 else (i + 1, j)
                pa = _quadratic(phases, d01, d12, d20, a[0] * h, a[1] * h)
                pb = _quadratic(phases, d01, d12, d20, b[0] * h, b[1] * h)
                pc = _quadratic(phases, d01, d12, d20, c[0] * h, c[1] * h)
                _corner_terms(pa, pb, pc, part)
                for t, q in ((part[0], a), (part[1], b), (part[2], c)):
                    v, w = q[0] * h, q[1] * h
                    out[0] += shift * t * (1.0 - v - w)
                    out[1] += shift * t * v
                    out[2] += shift * t * w
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
