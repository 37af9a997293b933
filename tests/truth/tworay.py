"""Closed forms of the simplest channels: Friis, radar equation, two rays over flat ground."""

from __future__ import annotations

import numpy as np

from .slab import half_space


def friis(length, k):
    """Complex channel gain of free space between isotropic ends: lambda/(4 pi L) exp(-jkL)."""
    return np.exp(-1j * k * length) / (2 * k * length)


def radar_power(distance, sigma, wavelength, gain=1.0):
    """Received over transmitted power of a point target: G^2 lambda^2 sigma / ((4 pi)^3 R^4)."""
    return gain**2 * wavelength**2 * sigma / ((4 * np.pi) ** 3 * distance**4)


def radar_gain(length_out, length_back, sigma, k):
    """Complex gain of a point target: sqrt(4 pi sigma)/lambda times the gains of both ways."""
    return np.sqrt(4 * np.pi * sigma) * k / (2 * np.pi) * friis(length_out, k) * friis(length_back, k)


def two_ray(distance, height_tx, height_rx, k, eps=None):
    """(V, H) rows of (direct, reflected) gains over ground of permittivity eps (None: PEC), ends `distance` apart."""
    direct = np.hypot(distance, height_tx - height_rx)
    reflected = np.hypot(distance, height_tx + height_rx)
    cos_i = (height_tx + height_rx) / reflected
    r_s, r_p = (-1.0, 1.0) if eps is None else half_space(cos_i, eps)
    a, b = friis(direct, k), friis(reflected, k)
    return np.array([[a, b * r_p], [a, b * r_s]])


def two_ray_target(distance, height_radar, height_target, sigma, k, eps=None):
    """(V, H) total gain of an isotropic point target over ground: all four pairs of ways out and back."""
    ways = two_ray(distance, height_radar, height_target, k, eps).sum(axis=1)
    return np.sqrt(4 * np.pi * sigma) * k / (2 * np.pi) * ways**2
