"""Physical optics: fields that the currents on a lit surface radiate (numba kernels of scalars)."""

from __future__ import annotations

import math

from raychan.compile.jit import njit
from raychan.em.phasor import times
from raychan.em.polarization import mirror, onto, s_vector, transmit
from raychan.vectors import Vec, cross, dot


@njit(cache=True, forceinline=True)
def incident(k: Vec, n: Vec) -> tuple[Vec, Vec, Vec, Vec]:
    """Return of a wave along k on a surface the vectors s and p, p of the reflected wave, and its direction."""
    s, ahead = s_vector(k, n), mirror(k, n)
    return s, cross(s, k), cross(s, ahead), ahead


@njit(cache=True, forceinline=True)
def radiated(e: Vec, wave: tuple[Vec, Vec, Vec, Vec], to: Vec, n: Vec, r_s: complex, r_p: complex, g: Vec) -> complex:
    """Return the field, projected on g, that the currents of the reflected wave of e radiate in the direction `to`.

    Args: wave as `incident` gives it. The currents n x H, -n x E of the reflected wave (E, H = k x E) radiate
    to x (n x E) + n x H, here by the rule for two cross products.
    Source: Stratton-Chu; Balanis, Advanced Engineering Electromagnetics, 2012, sec. 7.10.
    """
    s, p_in, p, k = wave
    along, ahead, over = onto(g, n), onto(g, k), dot(to, n) + dot(n, k)
    by_s = times(dot(to, s), along) - times(over, onto(g, s))
    by_p = times(dot(to, p), along) + times(dot(n, p), ahead) - times(over, onto(g, p))
    return r_s * onto(e, s) * by_s + r_p * onto(e, p_in) * by_p


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
    return coupled(e_in, k_in, incident(k_in, n), e_out, k_out, incident(k_out, n), n, r_in, r_out)


@njit(cache=True, forceinline=True)
def coupled(e_in, k_in, wave_in, e_out, k_out, wave_out, n, r_in, r_out):  # type: ignore[no-untyped-def]
    """Return what `huygens` returns, of two waves with their vectors as `incident` gives them."""
    to_rx, to_tx = (-k_out[0], -k_out[1], -k_out[2]), (-k_in[0], -k_in[1], -k_in[2])
    forward = radiated(e_in, wave_in, to_rx, n, r_in[0], r_in[1], e_out)
    backward = radiated(e_out, wave_out, to_tx, n, r_out[0], r_out[1], e_in)
    return times(0.5, forward + backward)


@njit(cache=True)
def reflected_wave(e: Vec, k: Vec, to: Vec, element: Vec, r_s: complex, r_p: complex, g: Vec) -> complex:
    """Return the field, projected on g, that the currents n x H, -n x E of the reflected wave of (e, k) on a vector
    element of area (on the lit side) radiate in the direction `to`; multiply as for `huygens`. Source: as there."""
    size = math.sqrt(dot(element, element))
    if size == 0.0:
        return 0j
    n = (element[0] / size, element[1] / size, element[2] / size)
    return times(size, radiated(e, incident(k, n), to, n, r_s, r_p, g))


@njit(cache=True)
def shadow_wave(e: Vec, k: Vec, to: Vec, element: Vec, t_s: complex, t_p: complex, g: Vec) -> complex:
    """Return the field, projected on g, that the currents n x H, -n x E of the wave (e, k) itself, less what is
    transmitted (T_s, T_p), on a vector element of area (on the lit side) radiate in the direction `to`.

    This is the shadow radiation, which vanishes in backscatter; with `reflected_wave` it makes physical optics, 2 n x H
    on a conductor. Source: Ufimtsev, Fundamentals of the Physical Theory of Diffraction, 2014, ch. 1.
    """
    size = math.sqrt(dot(element, element))
    if size == 0.0:
        return 0j
    n = (element[0] / size, element[1] / size, element[2] / size)
    behind = transmit(e, k, n, t_s, t_p)
    lost = (e[0] - behind[0], e[1] - behind[1], e[2] - behind[2])
    magnetic = cross(to, cross(element, lost))
    electric = cross(element, cross(k, lost))
    return dot(g, magnetic) + dot(g, electric)
