"""Reflection and transmission coefficients of half spaces and thin layers (numba kernels of scalars).

Convention: s = perpendicular (TE), p = parallel (TM), field exp(+j omega t); for a perfect conductor R_s = -1, R_p = +1
with the p vectors s x k of each ray, so tangential fields cancel.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.phasor import times, unit_phasor

PEC, HALF_SPACE, LAYER = 0, 1, 2


@njit(cache=True, error_model="numpy", forceinline=True)
def _root(cos_i: float, eps: complex) -> complex:
    """Return the normal component of the wave vector inside over k; the root whose wave decays away from the face."""
    re, im = eps.real - (1.0 - cos_i * cos_i), eps.imag
    size = math.sqrt(re * re + im * im)
    if re >= 0.0:
        root = math.sqrt(0.5 * (size + re))
        other = 0.5 * im / root if root > 0.0 else 0.0
        return complex(-root, -other) if other > 0.0 else complex(root, other)
    other = -math.sqrt(0.5 * (size - re))
    return complex(0.5 * im / other, other)


@njit(cache=True, error_model="numpy", forceinline=True)
def _over(a: complex, b: complex) -> complex:
    """Return a / b: numba divides as Python does, with branches against overflow."""
    size = 1.0 / (b.real * b.real + b.imag * b.imag)
    return complex((a.real * b.real + a.imag * b.imag) * size, (a.imag * b.real - a.real * b.imag) * size)


@njit(cache=True, error_model="numpy", forceinline=True)
def _by_root(cos_i: float, eps: complex, root: complex) -> tuple[complex, complex]:
    """Return what `half_space` does, given `_root`."""
    within = times(cos_i, eps)
    return _over(cos_i - root, cos_i + root), _over(within - root, within + root)


@njit(cache=True, error_model="numpy")
def half_space(cos_i: float, eps: complex) -> tuple[complex, complex]:
    """Return Fresnel (R_s, R_p) of a half space of complex permittivity eps (ITU-R P.2040-3, eqs. 36-37)."""
    return _by_root(cos_i, eps, _root(cos_i, eps))


@njit(cache=True, error_model="numpy", forceinline=True)
def _passage(way: complex) -> complex:
    """Return exp(-j way)."""
    cosine, sine = unit_phasor(0.5 / math.pi * way.real)
    size = math.exp(way.imag)
    return complex(size * cosine, size * sine)


@njit(cache=True, error_model="numpy")
def layer(cos_i: float, eps: complex, thickness: float, k: float) -> tuple[complex, complex, complex, complex]:
    """Return (R_s, R_p, T_s, T_p) of a slab in air (ITU-R P.2040-3, eqs. 43-44).

    R refers to the front face. T is the wave behind the slab over the wave that free space would
    have given there: the slab's own T times exp(+j k d cos_i).
    """
    root = _root(cos_i, eps)
    r_s, r_p = _by_root(cos_i, eps, root)
    passage = _passage(times(k * thickness, root))
    twice = passage * passage
    free = passage * _passage(complex(-k * thickness * cos_i, 0.0))
    square_s, square_p = r_s * r_s, r_p * r_p
    d_s, d_p = 1.0 - square_s * twice, 1.0 - square_p * twice
    t_s, t_p = _over((1.0 - square_s) * free, d_s), _over((1.0 - square_p) * free, d_p)
    rest = 1.0 - twice
    return _over(r_s * rest, d_s), _over(r_p * rest, d_p), t_s, t_p


@njit(cache=True, error_model="numpy")
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
        r_s, r_p = times(loss, r_s), times(loss, r_p)
    return r_s, r_p, t_s, t_p


@njit(cache=True)
def coefficients_array(kind, eps, thickness, roughness, cos_i, k):  # type: ignore[no-untyped-def]
    """Return (n, 4) coefficients of `coefficients` for arrays of n materials and angles."""
    out = np.empty((cos_i.size, 4), np.complex128)
    for i in range(cos_i.size):
        c = coefficients(kind[i], eps[i], thickness[i], roughness[i], cos_i[i], k)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = c
    return out
