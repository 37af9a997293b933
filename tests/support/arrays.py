"""Arrays and snapshots of plane waves, for tests of directions."""

from __future__ import annotations

import numpy as np

from raychan.radar.aperture import Aperture, cosines


def line(count: int, spacing: float = 0.5, axis: int = 1) -> np.ndarray:
    """Return elements (count, 3) of a uniform line about the origin, spacing in wavelengths of 1 m."""
    out = np.zeros((count, 3))
    out[:, axis] = spacing * (np.arange(count) - 0.5 * (count - 1))
    return out


def plane(ny: int, nz: int, spacing: float = 0.5) -> np.ndarray:
    """Return elements (ny nz, 3) of a uniform rectangle."""
    y, z = np.meshgrid(np.arange(ny), np.arange(nz), indexing="ij")
    return spacing * np.stack([np.zeros(ny * nz), y.ravel(), z.ravel()], axis=1)


def noise(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Return complex white noise of power 1."""
    return rng.standard_normal((*shape, 2)).view(complex)[..., 0] * np.sqrt(0.5)


def waves(elements: np.ndarray, azimuth_deg, elevation_deg=0.0, amplitudes=1.0) -> np.ndarray:
    """Return snapshots (n, a) of plane waves; amplitudes (n, k) or one for all."""
    look = cosines(np.radians(np.atleast_1d(azimuth_deg)), np.radians(elevation_deg))
    return np.broadcast_to(amplitudes, (np.shape(amplitudes)[0] if np.ndim(amplitudes) else 1, len(look))) @ Aperture(
        elements, 1.0
    ).steering(look)
