"""Single diffraction at a straight wedge by the uniform theory of diffraction, UTD (numba kernels of scalars).

Conventions: field exp(+j omega t); angles about the edge are measured from face 0 through the open space to face n at
n pi (exterior angle n pi, so n = 2 is a half plane); soft (s) = E along the edge, hard (h) = H along it. Reflection
coefficients as in `fresnel`: a perfect conductor has R_s = -1, R_p = +1. Incident and reflected fields are counted
apart, so at grazing incidence (both fall together) the coefficients need no factor of one half.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import Vec, cross, dot

ROOT_J = cmath.exp(0.25j * math.pi)
CONDUCTOR = (-1.0 + 0j, 1.0 + 0j)


@njit(cache=True)
def _tail(u: float) -> complex:
    """Return F(u^2)/u, finite at u = 0, for u >= 0: sqrt(j pi) exp(z^2) erfc(z) at z = u sqrt(j).

    Source: Abramowitz & Stegun, 7.1.6 (series) and 7.1.14 (continued fraction).
    """
    z = ROOT_J * u
    if u < 2.4:
        # Power series of erf, whose terms do not cancel each other.
        term, total, m = z, z, 0
        while abs(term) > 1e-17 * (abs(total) + 1e-300) and m < 80:
            m += 1
            term = term * 2.0 * z * z / (2 * m + 1)
            total += term
        return math.sqrt(math.pi) * ROOT_J * (cmath.exp(z * z) - 2.0 / math.sqrt(math.pi) * total)
    # Continued fraction, from its last term.
    f = z
    for m in range(80 if u < 6.0 else 20, 0, -1):
        f = z + 0.5 * m / f
    return ROOT_J / f


@njit(cache=True)
def transition(x: float) -> complex:
    """Return the transition function F(x) of x >= 0 (Kouyoumjian & Pathak 1974, eq. 26); 0 at 0, 1 far away."""
    u = math.sqrt(x)
    return u * _tail(u)


@njit(cache=True)
def _term(beta: float, sign: float, n_wedge: float, size: float) -> complex:
    """Return cot((pi + sign beta)/2n) F(k L a) with `size` = sqrt(2 k L), finite on its boundary.

    With eps the angle to the boundary, a = 2 sin^2(eps/2) and the cotangent is that of eps/2n, so their product
    is a step of finite height that cancels the jump of the geometrical field. On the boundary itself (to 1e-12)
    the value is that of the lit side: there the geometrical wave is to be counted.
    """
    eps = math.pi + sign * beta
    eps -= 2.0 * math.pi * n_wedge * math.floor(eps / (2.0 * math.pi * n_wedge) + 0.5)
    s = abs(math.sin(0.5 * eps))
    if abs(eps) < 1e-12:
        step = math.copysign(n_wedge, eps)
    else:
        step = s / math.tan(0.5 * eps / n_wedge)
    return size * step * _tail(size * s)


@njit(cache=True)
def wedge_coefficients(
    phi_i: float,
    phi_d: float,
    n_wedge: float,
    beta0: float,
    k: float,
    length: float,
    r_0: tuple[complex, complex],
    r_n: tuple[complex, complex],
) -> tuple[complex, complex]:
    """Return (D_s, D_h) [sqrt(m)] of a wedge.

    phi_i, phi_d: directions of source and observer about the edge [rad], from face 0; beta0: angle of the rays to
    the edge [rad]; length: distance parameter L [m]; r_0, r_n: (R_s, R_p) of the faces at their own incidence
    (sin phi_i on face 0, sin(n pi - phi_d) on face n, after Luebbers).
    Sources: Kouyoumjian & Pathak 1974, eq. 25; Luebbers 1984, eq. 8.
    """
    size = math.sqrt(2.0 * k * length)
    minus, plus = phi_d - phi_i, phi_d + phi_i
    direct = _term(minus, 1.0, n_wedge, size) + _term(minus, -1.0, n_wedge, size)
    at_n, at_0 = _term(plus, 1.0, n_wedge, size), _term(plus, -1.0, n_wedge, size)
    scale = -1.0 / (ROOT_J * 2.0 * n_wedge * math.sqrt(2.0 * math.pi * k) * math.sin(beta0))
    soft = direct + r_0[0] * at_0 + r_n[0] * at_n
    hard = direct + r_0[1] * at_0 + r_n[1] * at_n
    return scale * soft, scale * hard


@njit(cache=True)
def wedge_angle(direction: Vec, edge: Vec, normal: Vec) -> float:
    """Return the angle [rad, 0 to 2 pi) about the edge of a direction away from it, from face 0 (outward `normal`).

    Face 0 extends from the edge along normal x edge; the open space lies to its normal's side.
    """
    angle = math.atan2(dot(direction, normal), dot(direction, cross(normal, edge)))
    if angle < -1e-12:
        return angle + 2.0 * math.pi
    return max(angle, 0.0)


@njit(cache=True)
def diffract(
    e: Vec,
    k_in: Vec,
    k_out: Vec,
    edge: Vec,
    normal: Vec,
    n_wedge: float,
    k: float,
    s_in: float,
    s_out: float,
    r_0: tuple[complex, complex],
    r_n: tuple[complex, complex],
) -> Vec:
    """Return the field at s_out [m] behind an edge, before the phase exp(-jk s_out), of field e at the edge.

    k_in, k_out: directions of travel (on one Keller cone); edge, normal: as in `wedge_angle`; s_in: distance of
    the point source [m], infinity for a plane wave. Spreading sqrt(s_in/(s_out(s_in + s_out))) is included.
    Source: Kouyoumjian & Pathak 1974, eqs. 17-20 (edge-fixed dyadic).
    """
    side_in, side_out = cross(edge, k_in), cross(edge, k_out)
    sin_in, sin_out = math.sqrt(dot(side_in, side_in)), math.sqrt(dot(side_out, side_out))
    phi_in = (-side_in[0] / sin_in, -side_in[1] / sin_in, -side_in[2] / sin_in)
    phi_out = (side_out[0] / sin_out, side_out[1] / sin_out, side_out[2] / sin_out)
    beta_in, beta_out = cross(phi_in, k_in), cross(phi_out, k_out)
    whole = s_out if math.isinf(s_in) else s_in * s_out / (s_in + s_out)
    back = (-k_in[0], -k_in[1], -k_in[2])
    d_s, d_h = wedge_coefficients(
        wedge_angle(back, edge, normal),
        wedge_angle(k_out, edge, normal),
        n_wedge,
        math.asin(min(sin_in, 1.0)),
        k,
        whole * sin_in * sin_in,
        r_0,
        r_n,
    )
    spread = math.sqrt(whole) / s_out
    a, b = -d_s * spread * dot(e, beta_in), -d_h * spread * dot(e, phi_in)
    return (
        a * beta_out[0] + b * phi_out[0],
        a * beta_out[1] + b * phi_out[1],
        a * beta_out[2] + b * phi_out[2],
    )


@njit(cache=True)
def transition_array(x):  # type: ignore[no-untyped-def]
    """Return `transition` of each element of x (n,)."""
    out = np.empty(x.size, np.complex128)
    for i in range(x.size):
        out[i] = transition(x[i])
    return out


@njit(cache=True)
def wedge_coefficients_array(phi_i, phi_d, n_wedge, beta0, k, length, r_0, r_n):  # type: ignore[no-untyped-def]
    """Return (n, 2) coefficients D_s, D_h [sqrt(m)] of `wedge_coefficients`.

    phi_i, phi_d, beta0, length: (n,); r_0, r_n: (n, 2) complex, columns R_s, R_p.
    """
    out = np.empty((phi_i.size, 2), np.complex128)
    for i in range(phi_i.size):
        face_0, face_n = (r_0[i, 0], r_0[i, 1]), (r_n[i, 0], r_n[i, 1])
        out[i, 0], out[i, 1] = wedge_coefficients(phi_i[i], phi_d[i], n_wedge, beta0[i], k, length[i], face_0, face_n)
    return out
