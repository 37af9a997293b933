"""What a range-Doppler processor answers to a path, at any distance from its cell."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.kernels.cell import cell_waves, periodic, sums_in_cells
from raychan.kernels.rows import in_two
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]
Sums = tuple[Complexes, Floats, NDArray[np.int64]]

_FINE = 64  # points of the tabulated window response per resolution cell
_LEAST = 1e-4  # of a cell's amplitude: what all paths that are left out may bring to it
_STEP = 0.25  # range cells that a path may move within one piece of the frame


class Response:
    """Response of both windows, side lobes and aliases included, 1 at the peak; migration by pieces of the frame."""

    def __init__(self, waveform: Waveform, range_window: str, rate_window: str) -> None:
        self.waveform = waveform
        self._range = window(range_window, waveform.n_samples)
        self._rate = window(rate_window, waveform.n_chirps)
        self._pieces: dict[int, tuple[Complexes, Floats]] = {}

    @cached_property
    def _range_tables(self) -> Complexes:
        """The range response and its slope by range cells."""
        table = _table(self._range / self._range.sum())
        return np.stack([table, np.gradient(table, 1.0 / _FINE)], axis=1)

    @cached_property
    def _beyond(self) -> Floats:
        """The largest that the range response and its slope are (s,) cells from the peak and farther."""
        n = len(self._range)
        size = np.abs(self._range_tables).max(axis=1)
        by_cell = np.maximum.reduceat(size, np.arange(0, n * _FINE, _FINE))
        by_cell = np.maximum(by_cell, by_cell[::-1])[: n // 2 + 1]
        return np.asarray(np.maximum.accumulate(by_cell[::-1])[::-1])

    def in_profile(self, delay: Floats, range: float) -> tuple[Complexes, Floats]:
        """Return the response (n,) of the range window to paths of delays (n,) [s] at a range [m], their phase at mid
        sweep of the frame's first ramp in, and the ranges (n,) [m] at which they stand."""
        wave, at = self.waveform, 0.5 * C0 * delay
        turn = self._swept * delay - 0.5 * wave.slope * delay**2
        cells = np.ascontiguousarray((at - range) / wave.range_resolution)
        return periodic(self._range_tables[:, 0], len(self._range), _FINE, cells) * np.exp(-2j * np.pi * turn), at

    def in_cell(
        self, amplitude: Complexes, delay: Floats, rate: Floats, range: float, cell_rate: float
    ) -> tuple[Complexes, Floats]:
        """Return what paths (n,) bring to a cell of the map, and the ranges (n,) [m] at which they stand mid frame.

        Args: amplitude, delay [s] at the frame's start and rate [m/s] of paths; range [m] and rate [m/s] of the cell.
        """
        found: tuple[Complexes, Floats] = cell_waves(amplitude, delay, rate, (range, cell_rate), *self._tables(rate))
        return found

    def in_cells(
        self, group: NDArray[np.int64], count: int, amplitude: Complexes, delay: Floats, rate: Floats, cells: Floats
    ) -> Sums:
        """Return the sums by groups of what paths (n,) bring to cells of the map: see kernels.cell.cell_sums.

        Args: group (n,) of each path, below `count`; cells (c, 3), each range [m], rate [m/s] and amplitude: what all
        paths together bring is known to 1e-4 of that at least; else as for `in_cell`.
        """
        shape = len(cells), count
        total, size, strongest = np.empty(shape, complex), np.empty((shape[0], 4, count)), np.empty(shape, np.int64)
        least = _LEAST * cells[:, 2] / max(float(np.abs(amplitude).sum()), 1e-300)
        tables = self._tables(rate)

        def some(at: slice) -> None:
            sums_in_cells(
                group, amplitude, delay, rate, cells[at], least[at], self._beyond, total[at], size[at], strongest[at],
                *tables,
            )  # fmt: skip

        in_two(len(cells), some, least=2)
        return total, size, strongest

    def _tables(self, rate: Floats) -> tuple[Any, ...]:
        """Return ramp, sizes and tables for `cell_waves`, in as many pieces of the frame as the fastest path needs."""
        wave, count = self.waveform, len(self._rate)
        moved = float(np.abs(rate).max(initial=0.0)) * wave.repetition / wave.range_resolution * count
        pieces = max(1, min(count, int(np.ceil(moved / _STEP))))
        if pieces not in self._pieces:
            self._pieces[pieces] = self._rate_tables(pieces)
        middle = wave.carrier + self._swept
        ramp = (wave.carrier, wave.slope, wave.centre, self._swept, middle, wave.repetition, wave.range_resolution, C0)
        return ramp, (len(self._range), count, _FINE), self._range_tables, self._pieces[pieces]

    @property
    def _swept(self) -> float:
        return 0.5 * self.waveform.bandwidth * (1.0 - 1.0 / self.waveform.n_samples)

    def _rate_tables(self, pieces: int) -> tuple[Complexes, Floats]:
        """Return the rate response of each piece of the frame and that of its chirps' numbers, counted from its middle
        (pieces, ., 2), and the middles (pieces,)."""
        chirps, tables, middles = np.arange(len(self._rate)), [], []
        for part in np.array_split(chirps, pieces):
            held = np.zeros(len(chirps))
            held[part] = self._rate[part] / self._rate.sum()
            tables.append(np.stack([_table(held), _table(held * (chirps - part.mean()))], axis=1))
            middles.append(part.mean())
        return np.array(tables), np.array(middles)


def _table(weights: Floats) -> Complexes:
    """Return the response of weights over its period of len(weights) cells, _FINE points a cell."""
    n = len(weights)
    raw = np.fft.fft(weights, n * _FINE)
    # The phase is counted from the middle of the samples, where a symmetric window is real.
    return np.append(raw, raw[0]) * np.exp(1j * np.pi * (n - 1) / n * np.arange(n * _FINE + 1) / _FINE)
