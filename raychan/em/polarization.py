"""Polarisation: field vectors reflected at mirrors and transmitted through layers (numba kernels of 3-tuples)."""

from __future__ import annotations

import math

from raychan.compile.jit import njit
from raychan.em.phasor import times
from raychan.vectors import Vec, cross, dot


@njit(cache=True, error_model="numpy")
def s_vector(k: Vec, n: Vec) -> Vec:
    """Return the unit vector perpendicular to the plane of incidence; any tangent at normal incidence."""
    s = cross(k, n)
    size = math.sqrt(dot(s, s))
    if size < 1e-9:
        s = cross((1.0, 0.0, 0.0), n) if abs(n[0]) < 0.7 else cross((0.0, 1.0, 0.0), n)
        size = math.sqrt(dot(s, s))
    return s[0] / size, s[1] / size, s[2] / size


@njit(cache=True, error_model="numpy")
def mirror(k: Vec, n: Vec) -> Vec:
    """Return direction k reflected at a plane of unit normal n."""
    c = 2.0 * dot(k, n)
    return k[0] - c * n[0], k[1] - c * n[1], k[2] - c * n[2]


@njit(cache=True, forceinline=True)
def onto(e: Vec, a: Vec) -> complex:
    """Return the part of a field e along a real vector."""
    return times(a[0], e[0]) + times(a[1], e[1]) + times(a[2], e[2])


@njit(cache=True, forceinline=True)
def made_of(s: Vec, p: Vec, a: complex, b: complex) -> Vec:
    """Return the field with parts a along s and b along p, real vectors."""
    return times(s[0], a) + times(p[0], b), times(s[1], a) + times(p[1], b), times(s[2], a) + times(p[2], b)


@njit(cache=True)
def reflect(e: Vec, k: Vec, n: Vec, r_s: complex, r_p: complex) -> Vec:
    """Return field e (travelling along k) after reflection with coefficients (R_s, R_p)."""
    s = s_vector(k, n)
    return made_of(s, cross(s, mirror(k, n)), r_s * onto(e, s), r_p * onto(e, cross(s, k)))


@njit(cache=True)
def transmit(e: Vec, k: Vec, n: Vec, t_s: complex, t_p: complex) -> Vec:
    """Return field e (travelling along k, which it keeps) behind a thin layer with (T_s, T_p)."""
    s = s_vector(k, n)
    p = cross(s, k)
    return made_of(s, p, t_s * onto(e, s), t_p * onto(e, p))
