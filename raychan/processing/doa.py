"""Direction of arrival from the phases along a uniform line of receivers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_FINE = 16  # points per beam of the coarse search


def azimuth(snapshots: NDArray[np.complexfloating], elements: Floats, wavelength: float) -> Floats:
    """Return azimuths (n,) [rad] of echoes from their values (n, a) at receivers (a, 3) [m] in the antenna's frame.

    The receivers form a uniform line along y; the direction cosine of the strongest wave is the peak of their spatial
    spectrum, refined by the remaining phase step between neighbours. NaN for other arrays and beyond +-90 deg;
    elevation 0 is assumed, and a spacing above half a wavelength is ambiguous."""
    count = len(elements)
    if count < 2 or not len(snapshots):
        return np.full(len(snapshots), np.nan)
    steps = np.diff(elements, axis=0)
    spacing = float(steps[0, 1])
    if spacing == 0.0 or not np.allclose(steps, [0.0, spacing, 0.0], rtol=0.0, atol=1e-6 * abs(spacing)):
        return np.full(len(snapshots), np.nan)
    size = _FINE * count
    coarse = np.argmax(np.abs(np.fft.fft(snapshots, size, axis=1)), axis=1) / size
    flat = snapshots * np.exp(-2j * np.pi * coarse[:, None] * np.arange(count))
    left = np.angle((flat[:, 1:] * flat[:, :-1].conj()).sum(axis=1)) / (2.0 * np.pi)
    turn = coarse + left
    sine = (turn - np.rint(turn)) * wavelength / spacing
    return np.where(np.abs(sine) <= 1.0, np.arcsin(np.clip(sine, -1.0, 1.0)), np.nan)
