"""Spheres by the Mie series (Bohren & Huffman 1983, ch. 4; Harrington 1961, sec. 6-9), for exp(+j omega t)."""

from __future__ import annotations

import numpy as np
from scipy.special import spherical_jn, spherical_yn


def _order(x):
    return int(np.ceil(x + 6.0 * x ** (1.0 / 3.0) + 12))


def _riccati(x, count):
    """psi_n(x) and zeta_n(x) = x h_n^(2)(x) for n = 0..count."""
    n = np.arange(count + 1)
    psi = x * spherical_jn(n, x)
    return psi, psi - 1j * x * spherical_yn(n, x)


def coefficients(radius, k, eps=None):
    """Return a_n (electric) and b_n (magnetic), n = 1.., of a sphere; eps None is a perfect conductor."""
    x = k * radius
    count = _order(x)
    psi, zeta = _riccati(x, count)
    n = np.arange(1, count + 1)
    if eps is None:
        d_psi = psi[:-1] - n * psi[1:] / x
        d_zeta = zeta[:-1] - n * zeta[1:] / x
        return d_psi / d_zeta, psi[1:] / zeta[1:]
    m = np.sqrt(complex(eps))
    d = _log_derivative(m * x, count)[1:]
    electric, magnetic = d / m + n / x, d * m + n / x
    a = (electric * psi[1:] - psi[:-1]) / (electric * zeta[1:] - zeta[:-1])
    b = (magnetic * psi[1:] - psi[:-1]) / (magnetic * zeta[1:] - zeta[:-1])
    return a, b


def _log_derivative(z, count):
    """psi_n'(z) / psi_n(z), n = 0..count, by downward recurrence (stable for lossy spheres too)."""
    start = int(max(count, abs(z))) + 100
    d = np.zeros(start + 1, complex)
    for n in range(start, 0, -1):
        d[n - 1] = n / z - 1.0 / (d[n] + n / z)
    return d[: count + 1]


def amplitudes(radius, k, theta, eps=None):
    """(S_perpendicular, S_parallel) [m] at scattering angles theta [rad]; pi is back to the source, 0 is forward.

    Perpendicular and parallel are to the plane of incident and scattered directions.
    """
    a, b = coefficients(radius, k, eps)
    mu = np.cos(np.atleast_1d(np.asarray(theta, float)))
    s1, s2 = np.zeros(mu.shape, complex), np.zeros(mu.shape, complex)
    before, pi_n = np.zeros_like(mu), np.ones_like(mu)
    for n in range(1, a.size + 1):
        tau = n * mu * pi_n - (n + 1) * before
        weight = (2 * n + 1) / (n * (n + 1))
        s1 += weight * (a[n - 1] * pi_n + b[n - 1] * tau)
        s2 += weight * (a[n - 1] * tau + b[n - 1] * pi_n)
        before, pi_n = pi_n, ((2 * n + 1) * mu * pi_n - (n + 1) * before) / n
    return s1 / (1j * k), s2 / (1j * k)


def backscatter(radius, k, eps=None):
    """Monostatic S [m], far field: sum of (2n+1)(-1)^n (b_n - a_n) / 2jk."""
    a, b = coefficients(radius, k, eps)
    n = np.arange(1, a.size + 1)
    return np.sum((2 * n + 1) * (-1.0) ** n * (b - a)) / 2j / k


def rcs(radius, k, eps=None):
    """Monostatic far-field RCS [m2]."""
    return 4 * np.pi * abs(backscatter(radius, k, eps)) ** 2


def backscatter_near(radius, k, distance, eps=None):
    """S [m] = D^2 E_s exp(2jkD) at a tangential Hertzian dipole `distance` from the centre (unit field at 1 m).

    Scattered dyadic Green's function of the sphere at the source point (Tai 1994, sec. 10).
    """
    a, b = coefficients(radius, k, eps)
    y = k * distance
    n = np.arange(1, a.size + 1)
    _, zeta = _riccati(y, a.size)
    d_zeta = zeta[:-1] - n * zeta[1:] / y
    terms = (2 * n + 1) * (a * d_zeta**2 + b * zeta[1:] ** 2)
    # exact phase reference kept out of the terms, which carry exp(-2jkD) by themselves
    return 0.5j * np.sum(terms) / k * np.exp(2j * y)
