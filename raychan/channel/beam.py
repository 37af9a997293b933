"""Beam: how strong a radar is in each direction, so that tubes go where its antennas look."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.frames import direction

Floats = NDArray[np.float64]
Beam = Callable[[Floats], Floats]
"""Of unit directions (n, 3), world axes, away from the end: the field (n,) relative to the strongest."""

_STEP = 2.0  # deg: no beam of use is narrower


def beam_of(radar: Any) -> Beam:
    """Return the beam of a radar: the stronger of its transmitting and its receiving antenna in each direction."""
    azimuth, elevation = np.meshgrid(np.arange(-180.0, 180.0, _STEP), np.arange(-90.0, 90.1, _STEP))
    every = direction(np.radians(azimuth.ravel()), np.radians(elevation.ravel()))
    peaks = [np.linalg.norm(f(every), axis=1).max() for f in (radar.tx_field, radar.rx_field)]

    def beam(look: Floats) -> Floats:
        ends = zip((radar.tx_field, radar.rx_field), peaks, strict=True)
        sizes = [np.linalg.norm(f(look), axis=1) / peak for f, peak in ends if peak > 0.0]
        return np.asarray(np.max(sizes, axis=0) if sizes else np.zeros(len(look)))

    return beam
