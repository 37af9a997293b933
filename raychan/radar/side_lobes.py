"""Side lobes of a window: an envelope of its response, and how it correlates noise between cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.windows import window

Floats = NDArray[np.float64]

_FINE = 16  # points per resolution cell


class SideLobeEnvelope:
    """Least falling bound of a window's power response, 1 at the peak; offsets in resolution cells."""

    def __init__(self, name: str, n: int, slots: int = 1) -> None:
        """Args: window by name, of n samples; slots, parts of its period that fall on each other, as those of the
        transmitters do by Doppler division: what they leak adds up as amplitudes."""
        taper = window(name, n)
        period = np.abs(np.fft.fft(taper / taper.sum(), n * _FINE)).reshape(slots, -1).sum(axis=0)
        response = period[: len(period) // 2 + 1] ** 2
        self.table: Floats = np.maximum.accumulate(response[::-1])[::-1]

    def __call__(self, cells: Floats) -> Floats:
        """Return the bound at offsets of any shape."""
        # The lower neighbour in the table: a bound must not fall below the response between two points.
        at = np.minimum(np.abs(cells) * _FINE, len(self.table) - 1).astype(np.int64)
        return np.asarray(self.table[at])


def correlation(name: str, n: int, cells: Floats) -> Floats:
    """Return the correlation of white noise between two cells `cells` resolution cells apart, by the window (n,)."""
    weight = window(name, n) ** 2
    phase = np.exp(2j * np.pi * np.multiply.outer(cells, np.arange(n) - 0.5 * (n - 1)) / n)
    return np.asarray(np.abs(phase @ weight) / weight.sum())
