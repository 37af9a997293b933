"""What a range-Doppler processor answers to a path, at any distance from its cell."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from raychan.kernels.beat import periodic
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_FINE = 64  # points of the tabulated window response per resolution cell
_STEP = 0.25  # range cells that a path may move within one piece of the frame


class Response:
    """Response of both windows, side lobes and aliases included, 1 at the peak; migration by pieces of the frame."""

    def __init__(self, waveform: Waveform, range_window: str, rate_window: str) -> None:
        self.waveform = waveform
        self._range = window(range_window, waveform.n_samples)
        self._rate = window(rate_window, waveform.n_chirps)

    @cached_property
    def _range_tables(self) -> tuple[Complexes, Complexes]:
        """The range response and its slope by range cells."""
        table = _table(self._range / self._range.sum())
        return table, np.gradient(table, 1.0 / _FINE)

    def reference(self, delay: Floats, rate: Floats | None = None) -> tuple[Floats, Complexes]:
        """Return range [m] and phase factor (n,) at mid sweep and mid frame, or its start without rates."""
        wave = self.waveform
        then = delay if rate is None else delay + 2.0 * rate * wave.centre / C0
        swept = 0.5 * wave.bandwidth * (1.0 - 1.0 / wave.n_samples)
        turn = wave.carrier * (then - delay) + swept * then - 0.5 * wave.slope * then**2
        return 0.5 * C0 * then, np.exp(-2j * np.pi * turn)

    def in_range(self, offset: Floats) -> Complexes:
        """Return the response (n,) of the range window at offsets [m]."""
        return _lookup(self._range_tables[0], len(self._range), offset / self.waveform.range_resolution)

    def in_cell(self, offset: Floats, rate: Floats, cell_rate: float) -> Complexes:
        """Return the response (n,) of paths with range offsets [m] and rates [m/s] in a cell of rate `cell_rate`."""
        wave, count = self.waveform, len(self._rate)
        # Doppler is measured at the middle sample of the sweep.
        middle = wave.carrier + 0.5 * wave.bandwidth * (1.0 - 1.0 / wave.n_samples)
        apart = 2.0 * middle / C0 * (rate - cell_rate) * count * wave.repetition
        # Each row of the map is freed of its own Doppler within the ramp, not of that of others.
        offset = offset + (rate - cell_rate) * middle / wave.slope
        apart_range = offset / wave.range_resolution
        per_chirp = rate * wave.repetition / wave.range_resolution
        moved = float(np.abs(per_chirp).max(initial=0.0)) * count
        pieces = max(1, min(count, int(np.ceil(moved / _STEP))))
        total = np.zeros(len(offset), np.complex128)
        for part in np.array_split(np.arange(count), pieces):
            # Within a piece the range response runs along a straight line.
            middle_chirp = part.mean()
            held = np.zeros(count)
            held[part] = self._rate[part] / self._rate.sum()
            slope = held * (np.arange(count) - middle_chirp)
            away = apart_range + per_chirp * (middle_chirp - 0.5 * (count - 1))
            level, lean = (_lookup(table, len(self._range), away) for table in self._range_tables)
            total += level * _lookup(_table(held), count, apart)
            total += lean * per_chirp * _lookup(_table(slope), count, apart)
        return total


def _table(weights: Floats) -> Complexes:
    """Return the response of weights over its period of len(weights) cells, _FINE points a cell."""
    n = len(weights)
    raw = np.fft.fft(weights, n * _FINE)
    # The phase is counted from the middle of the samples, where a symmetric window is real.
    return np.append(raw, raw[0]) * np.exp(1j * np.pi * (n - 1) / n * np.arange(n * _FINE + 1) / _FINE)


def _lookup(table: Complexes, n: int, cells: Floats) -> Complexes:
    found: Complexes = periodic(table, n, _FINE, np.ascontiguousarray(cells))
    return found
