"""Polarisation: field vectors reflected at mirrors and transmitted through layers (numba kernels of 3-tuples)."""

from __future__ import annotations

import math

from raychan.compile.jit import njit
from raychan.vectors import Vec, cross, dot


@njit(cache=True)
def s_vector(k: Vec, n: Vec) -> Vec:
    """Return the unit vector perpendicular to the plane of incidence; any tangent at normal incidence."""
    s = cross(k, n)
    size = math.sqrt(dot(s, s))
    if size < 1e-9:
        s = cross((1.0, 0.0, 0.0), n) if abs(n[0]) < 0.7 else cross((0.0, 1.0, 0.0), n)
        size = math.sqrt(dot(s, s))
    return s[0] / size, s[1] / size, s[2] / size


@njit(cache=True)
def mirror(k: Vec, n: Vec) -> Vec:
    """Return direction k reflected at a plane of unit normal n."""
    c = 2.0 * dot(k, n)
    return k[0] - c * n[0], k[1] - c * n[1], k[2] - c * n[2]


@njit(cache=True)
def reflect(e: Vec, k: Vec, n: Vec, r_s: complex, r_p: complex) -> Vec:
    """Return field e (travelling along k) after reflection with coefficients (R_s, R_p)."""
    s = s_vector(k, n)
    p_in = cross(s, k)
    p_out = cross(s, mirror(k, n))
    a, b = r_s * dot(e, s), r_p * dot(e, p_in)
    return a * s[0] + b * p_out[0], a * s[1] + b * p_out[1], a * s[2] + b * p_out[2]


@njit(cache=True)
def transmit(e: Vec, k: Vec, n: Vec, t_s: complex, t_p: complex) -> Vec:
    """Return field e (travelling along k, which it keeps) behind a thin layer with (T_s, T_p)."""
    s = s_vector(k, n)
    p = cross(s, k)
    a, b = t_s * dot(e, s), t_p * dot(e, p)
    return a * s[0] + b * p[0], a * s[1] + b * p[1], a * s[2] + b * p[2]
