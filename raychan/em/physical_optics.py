"""Physical optics: fields that the currents on a lit surface radiate (numba kernels of scalars)."""

from __future__ import annotations

import math

from raychan.compile.jit import njit
from raychan.em.polarization import mirror, reflect, transmit
from raychan.vectors import Vec, cross, dot


@njit(cache=True)
def radiated(e: Vec, k: Vec, s: Vec, n: Vec, r_s: complex, r_p: complex, g: Vec) -> complex:
    """Return the field, projected on g, that the currents of the reflected wave of (e, k) radiate towards s.

    Source: Stratton-Chu; Balanis, Advanced Engineering Electromagnetics, 2012, sec. 7.10.
    """
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
    forward = radiated(e_in, k_in, to_rx, n, r_in[0], r_in[1], e_out)
    backward = radiated(e_out, k_out, to_tx, n, r_out[0], r_out[1], e_in)
    return 0.5 * (forward + backward)


@njit(cache=True)
def reflected_wave(e: Vec, k: Vec, to: Vec, element: Vec, r_s: complex, r_p: complex, g: Vec) -> complex:
    """Return the field, projected on g, that the currents n x H, -n x E of the reflected wave of (e, k) on a vector
    element of area (on the lit side) radiate in the direction `to`; multiply as for `huygens`. Source: as there."""
    size = math.sqrt(dot(element, element))
    if size == 0.0:
        return 0j
    n = (element[0] / size, element[1] / size, element[2] / size)
    return size * radiated(e, k, to, n, r_s, r_p, g)


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
