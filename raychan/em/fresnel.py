"""Reflection and transmission coefficients of half spaces and thin layers (numba kernels of scalars).

Convention: s = perpendicular (TE), p = parallel (TM), field exp(+j omega t); for a perfect conductor R_s = -1, R_p = +1
with the p vectors s x k of each ray, so tangential fields cancel.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from raychan.compile.jit import njit

PEC, HALF_SPACE, LAYER = 0, 1, 2


@njit(cache=True)
def _root(cos_i: float, eps: complex) -> complex:
    """Return the normal component of the wave vector inside over k; the root whose wave decays away from the face."""
    root = cmath.sqrt(eps - (1.0 - cos_i * cos_i))
    return -root if root.imag > 0.0 else root


@njit(cache=True)
def half_space(cos_i: float, eps: complex) -> tuple[complex, complex]:
    """Return Fresnel (R_s, R_p) of a half space of complex permittivity eps (ITU-R P.2040-3, eqs. 36-37)."""
    root = _root(cos_i, eps)
    r_s = (cos_i - root) / (cos_i + root)
    r_p = (eps * cos_i - root) / (eps * cos_i + root)
    return r_s, r_p


@njit(cache=True)
def layer(cos_i: float, eps: complex, thickness: float, k: float) -> tuple[complex, complex, complex, complex]:
    """Return (R_s, R_p, T_s, T_p) of a slab in air (ITU-R P.2040-3, eqs. 43-44).

    R refers to the front face. T is the wave behind the slab over the wave that free space would
    have given there: the slab's own T times exp(+j k d cos_i).
    """
    root = _root(cos_i, eps)
    r_s, r_p = half_space(cos_i, eps)
    passage = cmath.exp(-1j * k * thickness * root)
    twice = passage * passage
    free = cmath.exp(1j * k * thickness * cos_i)
    d_s = 1.0 - r_s * r_s * twice
    d_p = 1.0 - r_p * r_p * twice
    t_s = (1.0 - r_s * r_s) * passage / d_s * free
    t_p = (1.0 - r_p * r_p) * passage / d_p * free
    return r_s * (1.0 - twice) / d_s, r_p * (1.0 - twice) / d_p, t_s, t_p


@njit(cache=True)
def coefficients(
    kind: int, eps: complex, thickness: float, roughness: float, cos_i: float, k: float
) -> tuple[complex, complex, complex, complex]:
    """Return (R_s, R_p, T_s, T_p) of any material; opaque ones transmit nothing.

    Roughness lowers the coherent reflection by the Ament factor exp(-2 (k h cos_i)^2) (Ament 1953).
    """
    cos_i = min(max(cos_i, 1e-9), 1.0)
    r_s, r_p, t_s, t_p = -1.0 + 0j, 1.0 + 0j, 0j, 0j
    if kind == LAYER:
        r_s, r_p, t_s, t_p = layer(cos_i, eps, thickness, k)
    elif kind == HALF_SPACE:
        r_s, r_p = half_space(cos_i, eps)
    if roughness > 0.0:
        loss = math.exp(-2.0 * (k * roughness * cos_i) ** 2)
        r_s *= loss
        r_p *= loss
    return r_s, r_p, t_s, t_p


@njit(cache=True)
def coefficients_array(kind, eps, thickness, roughness, cos_i, k):  # type: ignore[no-untyped-def]
    """Return (n, 4) coefficients of `coefficients` for arrays of n materials and angles."""
    out = np.empty((cos_i.size, 4), np.complex128)
    for i in range(cos_i.size):
        c = coefficients(kind[i], eps[i], thickness[i], roughness[i], cos_i[i], k)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = c
    return out
