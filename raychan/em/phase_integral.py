"""The phase integral of physical optics: the mean of exp(-j phase) over a triangle, the phase quadratic across it.

A phase that bends little is integrated in closed form (Gordon 1975). One that runs fast is given by the ends of lines
along which it runs (stationary phase), others by a Gauss rule or by pieces that are linear each. The mean is returned
in three parts, one for each corner, so that each may be given its own delay.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.phasor import even_phasor, mean_parts, points_for, times, times_j, unit_phasor

_TURN = 0.5 / math.pi


@njit(cache=True, forceinline=True)
def _exp_minus_j(phase: float) -> complex:
    """Return exp(-j phase)."""
    cosine, sine = unit_phasor(_TURN * phase)
    return complex(cosine, sine)


@njit(cache=True, error_model="numpy", forceinline=True)
def _edge(a: float, b: float, ea: complex, eb: complex) -> complex:
    """Return the mean of exp(-j phi) along a line on which phi runs from a to b, given exp(-j a) and exp(-j b)."""
    gap = b - a
    if abs(gap) < 1e-3:
        return ea * complex(1.0 - gap * gap / 6.0, gap * (gap * gap / 24.0 - 0.5))
    return times_j(1.0 / gap, eb - ea)


@njit(cache=True, error_model="numpy", forceinline=True)
def _with_first_moment(
    p0: float, p1: float, p2: float, t0: complex, t1: complex, t2: complex, lost: complex
) -> tuple[complex, complex, complex]:
    """Return corner terms of the same sum with the right first moment of the phase, from which they are off by j
    `lost`.

    Terms of stationary phase fall with frequency, t ~ 1/phase: with fixed amplitudes their sum would be right at the
    carrier only, and would not match that of neighbours integrated by another rule beside it.
    """
    mean = (p0 + p1 + p2) / 3.0
    a, b, c = p0 - mean, p1 - mean, p2 - mean
    shift = times_j(-1.0 / (a * a + b * b + c * c), lost)
    return t0 + times(a, shift), t1 + times(b, shift), t2 + times(c, shift)


@njit(cache=True, error_model="numpy")
def _corner_terms(
    p0: float, p1: float, p2: float, e0: complex, e1: complex, e2: complex
) -> tuple[complex, complex, complex]:
    """Return the parts of the mean of exp(-j phi) over a triangle that belong to each corner, given e = exp(-j p).

    The mean is the second divided difference of exp at the corner phases (Hermite-Genocchi), times two: Gordon
    (1975) for a triangle, without his singular cases. Where the phase runs, it is a sum of corner terms; what
    corners within 2 rad have in common is shared equally.
    """
    # Sorted, low to high, with the corner each came from.
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
            whole = times_j(2.0 / span, _edge(p1, p2, e1, e2) - _edge(p0, p1, e0, e1))
        # First order in the phase: the mean of l_i phi over a triangle is (phi_i - mean) / 12.
        mean = (x + span) / 3.0
        t0 = whole * complex(1.0 / 3.0, mean / 12.0)
        t1 = whole * complex(1.0 / 3.0, (mean - x) / 12.0)
        t2 = whole * complex(1.0 / 3.0, (mean - span) / 12.0)
    else:
        scale = 2.0 / span
        gap = p2 - p1
        # Each division by a phase leaves out of the first moment what _with_first_moment puts back.
        if gap < 2.0:
            upper = times_j(scale, _edge(p1, p2, e1, e2))
            t1, t2 = upper * complex(0.5, gap / 12.0), upper * complex(0.5, -gap / 12.0)
            lost = upper
        else:
            t1, t2 = times(scale / gap, e1), times(-scale / gap, e2)
            lost = times(2.0, t1 + t2)
        if x < 2.0:
            lower = times_j(scale, _edge(p0, p1, e0, e1))
            t0 = -lower * complex(0.5, x / 12.0)
            t1 -= lower * complex(0.5, -x / 12.0)
            lost -= lower
        else:
            first, last = times(-scale / x, e0), times(scale / x, e1)
            t0 = first
            t1 += last
            lost += times(2.0, first + last)
        t0, t1, t2 = _with_first_moment(p0, p1, p2, t0, t1, t2, lost)
    r0 = t0 if i0 == 0 else (t1 if i1 == 0 else t2)
    r1 = t0 if i0 == 1 else (t1 if i1 == 1 else t2)
    r2 = t0 if i0 == 2 else (t1 if i1 == 2 else t2)
    return r0, r1, r2


_MOST_PIECES = 20  # along an edge: tubes that count bend no more than these follow
_NEGLIGIBLE = 1e-5  # share of the mean over a triangle in phase that may be left out
_PANEL = 6.0  # rad that the Gauss rule along an edge follows to 1e-6
_ALWAYS_GAUSS = 18.0  # rad of phase up to which pieces are never used; not measured
_POINTS_PER_PIECE = 16  # points of a Gauss rule that take as long as a piece; not measured
_SIX_POINTS = np.zeros((2, 8))  # of a Gauss rule, and two without weight: whole vector units
_SIX_POINTS[:, :6] = np.stack(np.polynomial.legendre.leggauss(6)) * 0.5 + np.array([[0.5], [0.0]])


@njit(cache=True, error_model="numpy", forceinline=True)
def _end_term(w: float, c: float) -> complex:
    """Return the term of one end, over exp(-j phi) there, of the integral of exp(-j phi) along a line: phi' = w,
    phi'' = c."""
    short = 1.0 / w
    x = c * short * short
    return complex(-x * short, short * (1.0 - 3.0 * x * x))


@njit(cache=True, error_model="numpy")
def _along_edge(pa, pm, pb, wa, wb, c):  # type: ignore[no-untyped-def]
    """Integrate `_end_term` times exp(-j phi) along an edge; return the parts of its two ends, and by how many phases
    they were divided.

    Args: pa, pm, pb phases [rad] at ends and middle; wa, wb, c slopes at the ends and bend across the edge.
    """
    s, d = pb - pa, pm - 0.5 * (pa + pb)
    sa, sb = s + 4.0 * d, s - 4.0 * d
    if sa * sb > 0.0 and min(abs(sa), abs(sb)) > 4.0:
        # The phase runs: the ends alone count (stationary phase), here to second order.
        turn, ra, rb = wb - wa, 1.0 / sa, 1.0 / sb
        ya, yb, za, zb = turn * ra / wa, turn * rb / wb, 8.0 * d * ra * ra, 8.0 * d * rb * rb
        worst = max(abs(ya), abs(yb)) + max(abs(za), abs(zb))
        if 12.0 * worst * worst < _NEGLIGIBLE * min(abs(sa * wa), abs(sb * wb)):
            first = times_j(-ra, _end_term(wa, c) * complex(1.0, ya - za) * _exp_minus_j(pa))
            last = times_j(rb, _end_term(wb, c) * complex(1.0, yb - zb) * _exp_minus_j(pb))
            return first, last, 2.0
    first, last = _by_panels(pa, s, 4.0 * d, wa, wb - wa, c)
    return first, last, 1.0


@njit(cache=True, fastmath=True, error_model="numpy")
def _by_panels(begin, run, bend, slope, turn, c):  # type: ignore[no-untyped-def]
    """Return the parts of both ends of the integral of `_end_term` times exp(-j phi) along an edge, panel by panel,
    phi = begin + t run + t (1 - t) bend, its slope across the edge slope + t turn."""
    panels = 1 + int((abs(run) + abs(bend)) / _PANEL)
    share = 1.0 / panels
    first_re, first_im, last_re, last_im = 0.0, 0.0, 0.0, 0.0
    for i in range(panels):
        for q in range(8):
            t = (i + _SIX_POINTS[0, q]) * share
            short = 1.0 / (slope + t * turn)
            x = c * short * short
            e_re, e_im = even_phasor(_TURN * (begin + t * (run + bend * (1.0 - t))), short * _SIX_POINTS[1, q])
            level = 1.0 - 3.0 * x * x
            re, im = -x * e_re - level * e_im, level * e_re - x * e_im
            last_re += t * re
            last_im += t * im
            first_re += (1.0 - t) * re
            first_im += (1.0 - t) * im
    return complex(share * first_re, share * first_im), complex(share * last_re, share * last_im)


@njit(cache=True, error_model="numpy", uncounted=True)
def _by_stationary_phase(phases, d, out) -> bool:  # type: ignore[no-untyped-def]
    """Write the mean's parts where the phase runs fast along all lines parallel to one edge: only the ends of these
    lines count, which lie on the two other edges. Return False where it runs in no such direction.

    Source: Wong, Asymptotic Approximations of Integrals, 2001, secs. II.3 and VIII.
    """
    best, edge = 0.0, -1
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        wi = phases[j] - phases[i] + 4.0 * d[i]
        wj = wi - 8.0 * d[i]
        wk = wi + 4.0 * (d[j] - d[i] - d[k])
        if wi * wj > 0.0 and wi * wk > 0.0:
            least = min(abs(wi), abs(wj), abs(wk))
            if 60.0 * abs(8.0 * d[i] / (least * least)) ** 3 < _NEGLIGIBLE * least and least > max(best, 4.0):
                best, edge = least, i
    if edge < 0:
        return False
    i, j, k = edge, (edge + 1) % 3, (edge + 2) % 3
    wi = phases[j] - phases[i] + 4.0 * d[i]
    wj, c = wi - 8.0 * d[i], -8.0 * d[i]
    wk = wi + 4.0 * (d[j] - d[i] - d[k])
    j_part, k_part, ahead = _along_edge(phases[j], phases[3 + j], phases[k], wj, wk, c)
    i_part, other, behind = _along_edge(phases[i], phases[3 + k], phases[k], wi, wk, c)
    lost = times(2.0 * ahead, j_part + k_part) - times(2.0 * behind, i_part + other)
    parts = times(-2.0, i_part), times(2.0, j_part), times(2.0, k_part - other)
    out[i], out[j], out[k] = _with_first_moment(phases[i], phases[j], phases[k], *parts, lost)
    return True


@njit(cache=True, forceinline=True, uncounted=True)
def _quadratic(phases, d01, d12, d20, v, w):  # type: ignore[no-untyped-def]
    """Return the quadratic phase at barycentric (1 - v - w, v, w)."""
    u = 1.0 - v - w
    return u * phases[0] + v * phases[1] + w * phases[2] + 4.0 * (d01 * u * v + d12 * v * w + d20 * w * u)


@njit(cache=True)
def _by_pieces(phases, d01, d12, d20, m, out) -> int:  # type: ignore[no-untyped-def]
    """Write the mean's parts by m^2 equal pieces, the phase linear on each, with the mean bend of a piece added to
    it."""
    h = 1.0 / m
    # The mean of a piece's own bend: a third of the sum of its edges' bends, alike for all pieces.
    shift = times(h * h, _exp_minus_j((d01 + d12 + d20) * h * h / 3.0))
    p, e = np.empty((2, m + 1)), np.empty((2, m + 1), np.complex128)
    total, s1, s2 = 0j, 0j, 0j
    # Along a row the phase is a parabola, so its exponential follows from two running factors.
    curve = -8.0 * d20 * h * h
    turn = _exp_minus_j(curve)
    for i in range(m + 1):
        row = i & 1
        v = i * h
        first = _quadratic(phases, d01, d12, d20, v, 0.0)
        step = _quadratic(phases, d01, d12, d20, v, h) - first
        value, factor = _exp_minus_j(first), _exp_minus_j(step)
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
            s1 += times(i - 1.0, t0 + t2) + times(float(i), t1)
            s2 += times(float(j), t0 + t1) + times(j + 1.0, t2)
            if j < m - i:
                p0, p1, p2 = p[row, j + 1], p[low, j + 1], p[row, j]
                t0, t1, t2 = _corner_terms(p0, p1, p2, e[row, j + 1], e[low, j + 1], e[row, j])
                total += t0 + t1 + t2
                s1 += times(float(i), t0 + t2) + times(i - 1.0, t1)
                s2 += times(j + 1.0, t0 + t1) + times(float(j), t2)
    s1, s2 = times(h, s1), times(h, s2)
    out[0], out[1], out[2] = shift * (total - (s1 + s2)), shift * s1, shift * s2
    return m * m


@njit(cache=True, uncounted=True)
def triangle_terms(phases, linear: float, out) -> int:  # type: ignore[no-untyped-def]
    """Write the mean of exp(-j phi) over a triangle on which phi is quadratic; return how many points or pieces it
    took.

    Args: phases (6,) [rad] at the corners 0, 1, 2 and the middles of edges 01, 12, 20; linear [rad] by which a phase
    may bend that counts as linear; out (3,) receives the part of each corner, whose sum is the mean.
    Source: Gordon (1975), IEEE Trans. Antennas Propag. 23(4), for the linear phase.
    """
    d01 = phases[3] - 0.5 * (phases[0] + phases[1])
    d12 = phases[4] - 0.5 * (phases[1] + phases[2])
    d20 = phases[5] - 0.5 * (phases[2] + phases[0])
    bend = max(abs(d01), abs(d12), abs(d20))
    if bend <= linear:
        e0, e1, e2 = _exp_minus_j(phases[0]), _exp_minus_j(phases[1]), _exp_minus_j(phases[2])
        t0, t1, t2 = _corner_terms(phases[0], phases[1], phases[2], e0, e1, e2)
        shift = _exp_minus_j((d01 + d12 + d20) / 3.0)
        out[0], out[1], out[2] = shift * t0, shift * t1, shift * t2
        return 1
    span = max(phases[0], phases[1], phases[2]) - min(phases[0], phases[1], phases[2])
    if span > _PANEL and _by_stationary_phase(phases, (d01, d12, d20), out):
        return 1
    reach = span + 4.0 * bend
    points, pieces = points_for(reach), min(math.ceil(math.sqrt(bend / linear)), _MOST_PIECES)
    if points > 0 and (reach <= _ALWAYS_GAUSS or points * points <= _POINTS_PER_PIECE * pieces * pieces):
        mean_parts(phases, d01, d12, d20, points, out)
        return points * points
    return _by_pieces(phases, d01, d12, d20, pieces, out)


@njit(cache=True, nogil=True)
def quadratic_means(phases, linear):  # type: ignore[no-untyped-def]
    """Return the means (n,) of exp(-j phi) over triangles with phases (n, 6) as for `triangle_terms`."""
    out = np.empty(phases.shape[0], np.complex128)
    _each_mean(phases, linear, np.empty(3, np.complex128), out)
    return out


@njit(cache=True, nogil=True, uncounted=True)
def _each_mean(phases, linear, part, out):  # type: ignore[no-untyped-def]
    """Write the means, with room for the parts (3,) of one."""
    for i in range(phases.shape[0]):
        triangle_terms(phases[i], linear, part)
        out[i] = part[0] + part[1] + part[2]
