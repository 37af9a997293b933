"""Point-spread function of the range-Doppler processor: its response in any map cell to a path anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.radar.near_spectrum import MANY
from raychan.radar.side_lobes import main_lobe
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.run.explanation.cell_sums import cell_waves, periodic, sums_in_cells
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]
Sums = tuple[Complexes, Floats, NDArray[np.int64]]

_FINE = 64  # points of the tabulated window response per resolution cell (not measured)
_LEAST = 1e-3  # of a cell's amplitude: largest sum of the paths left out (speed against error; not measured)
_PART = 1 << 13  # paths summed at once by one thread, or more, so that there are _PARTS parts at most: with 1 << 15
# two threads wait for each other, of a frame of the living street 0.05 of 2.1 s
_PARTS = 32
_FEW = 1 << 14  # sums, of cells and groups, up to which paths are summed in parts; not measured
_STEP = 0.25  # range cells that a path may move within one part of the frame (speed against error; not measured)


@dataclass
class _Sums:
    """Sums over paths in map cells by groups: `total` (c, g), `size` (c, 4, g), number (c, g) and power (c, g) of the
    strongest path."""

    total: Complexes
    size: Floats
    strongest: NDArray[np.int64]
    most: Floats

    @staticmethod
    def of(cells: int, groups: int) -> _Sums:
        """Return room for the sums."""
        shape = cells, groups
        return _Sums(np.empty(shape, complex), np.empty((cells, 4, groups)), np.empty(shape, np.int64), np.empty(shape))

    @property
    def columns(self) -> tuple[NDArray[Any], ...]:
        return self.total, self.size, self.strongest, self.most

    def add(self, other: _Sums, first: int) -> None:
        """Add the sums over other paths, which are numbered from `first` on."""
        self.total += other.total
        self.size += other.size
        better = other.most > self.most
        self.strongest = np.where(better, other.strongest + first, self.strongest)
        self.most = np.maximum(self.most, other.most)


class PointSpread:
    """Response of both windows with side lobes and aliases, 1 at the peak; range migration by parts of the frame.

    With real sampling each echo has a mirror image, its conjugate at minus its range and minus its rate, which appears
    where the range is folded.
    """

    def __init__(self, waveform: Waveform, range_window: str, rate_window: str) -> None:
        self.waveform = waveform
        self._range = window(range_window, waveform.n_samples)
        self._rate = window(rate_window, waveform.n_chirps)
        self._windows = range_window, rate_window
        self._by_parts: dict[int, tuple[Complexes, Floats]] = {}
        self._beyond: dict[int, tuple[Floats, Floats]] = {}

    @property
    def _range_tables(self) -> Complexes:
        return _in_range(self._windows[0], len(self._range))

    def in_profile(self, delay: Floats, range: float) -> tuple[Complexes, Floats]:
        """Return the response (n,) at a range [m] to paths of delays (n,) [s], with their phase at mid sweep of the
        frame's first ramp, and the ranges (n,) [m] of the paths."""
        wave, at = self.waveform, 0.5 * C0 * delay
        turn = wave.swept * delay - 0.5 * wave.slope * delay**2
        cells = np.ascontiguousarray((at - range) / wave.range_resolution)
        return periodic(self._range_tables[:, 0], len(self._range), _FINE, cells) * np.exp(-2j * np.pi * turn), at

    def in_cell(
        self, amplitude: Complexes, delay: Floats, rate: Floats, range: float, cell_rate: float
    ) -> tuple[Complexes, Floats]:
        """Return the contributions (n,) of paths to a map cell, and the ranges (n,) [m] of the paths at mid frame.

        Args: amplitude, delay [s] at the frame's start and rate [m/s] of paths; range [m] and rate [m/s] of the cell.
        """
        wave, at = self.image_in_cell(amplitude, delay, rate, range, cell_rate)
        if self.mirrors:
            wave = wave + self.image_in_cell(amplitude, delay, rate, -range, -cell_rate)[0].conj()
        return wave, at

    def image_in_cell(
        self, amplitude: Complexes, delay: Floats, rate: Floats, range: float, cell_rate: float
    ) -> tuple[Complexes, Floats]:
        """Return what `in_cell` returns, without mirror images. The contribution of a mirror image to a cell is the
        conjugate of the path's own at minus the cell's range and minus its rate."""
        found: tuple[Complexes, Floats] = cell_waves(amplitude, delay, rate, (range, cell_rate), *self._tables(rate))
        return found

    def in_cells(
        self, group: NDArray[np.int64], count: int, amplitude: Complexes, delay: Floats, rate: Floats, cells: Floats
    ) -> Sums:
        """Return the contributions of paths (n,) to map cells, summed by groups: see `cell_sums.cell_sums`.

        Args: group (n,) of each path, below `count`; cells (c, 3), each range [m], rate [m/s] and amplitude, to 1e-3 of
        which the sum over all paths is exact; else as for `in_cell`.
        """
        found = self._images_in_cells(group, count, amplitude, delay, rate, cells)
        if not self.mirrors:
            return found
        mirrored = self._images_in_cells(group, count, amplitude, delay, rate, cells * (-1.0, -1.0, 1.0))
        strongest = np.where(mirrored[1][:, 1] > found[1][:, 1], mirrored[2], found[2])
        size = found[1] + mirrored[1] * [[0.0], [1.0], [1.0], [1.0]]  # each path is counted once
        return found[0] + mirrored[0].conj(), size, strongest

    def _images_in_cells(
        self, group: NDArray[np.int64], count: int, amplitude: Complexes, delay: Floats, rate: Floats, cells: Floats
    ) -> Sums:
        least = _LEAST * cells[:, 2] / max(len(rate), 1)
        tables = self._tables(rate)
        beyond = self._bounds(len(tables[3][1]))
        # Few sums are made by parts of the paths; many, which do not fit a processor's cache, by parts of the cells.
        size = max(_PART, -(-len(rate) // _PARTS))
        parts = -(-len(rate) // size) if len(cells) * count <= _FEW else 1
        sums = [_Sums.of(len(cells), count) for _ in range(max(parts, 1))]

        def by_paths(at: slice) -> None:
            for i in range(len(sums))[at]:
                part = slice(i * size, (i + 1) * size)
                paths = group[part], amplitude[part], delay[part], rate[part]
                sums_in_cells(*paths, cells, least, beyond, *sums[i].columns, *tables)

        def by_cells(at: slice) -> None:
            some = (x[at] for x in sums[0].columns)
            sums_in_cells(group, amplitude, delay, rate, cells[at], least[at], beyond, *some, *tables)

        if len(sums) > 1:
            parallel_for(len(sums), by_paths, least=2)
        else:
            parallel_for(len(cells), by_cells, least=2)
        for i, one in enumerate(sums[1:], 1):
            sums[0].add(one, i * size)
        return sums[0].total, sums[0].size, sums[0].strongest

    def _tables(self, rate: Floats) -> tuple[Any, ...]:
        """Return ramp, sizes and tables for `cell_waves`, for as many parts of the frame as the fastest path needs."""
        wave, count = self.waveform, len(self._rate)
        moved = float(np.abs(rate).max(initial=0.0)) * wave.repetition / wave.range_resolution * count
        parts = max(1, min(count, int(np.ceil(moved / _STEP))))
        if parts not in self._by_parts:
            self._by_parts[parts] = self._rate_tables(parts)
        ramp = (
            wave.carrier,
            wave.slope,
            wave.centre,
            wave.swept,
            wave.middle,
            wave.repetition,
            wave.range_resolution,
            C0,
        )
        return ramp, (len(self._range), count, _FINE), self._range_tables, self._by_parts[parts]

    def _bounds(self, parts: int) -> tuple[Floats, Floats]:
        """Return upper bounds of the range response (s,) and of the rate responses of a frame in parts (2, m), at 0,
        1, 2, ... cells from the peak."""
        if parts not in self._beyond:
            in_range = np.maximum(*np.abs(self._range_tables).T)
            rates = np.abs(self._by_parts[parts][0]).sum(axis=0).T
            self._beyond[parts] = _beyond(in_range), np.stack([_beyond(x) for x in rates])
        return self._beyond[parts]

    @property
    def mirrors(self) -> bool:
        """Whether echoes have mirror images."""
        return not self.waveform.complex_sampling

    @property
    def periods(self) -> tuple[float, float]:
        """Ranges [m] and rates [m/s] after which the map repeats; with real sampling it covers half of the former."""
        wave = self.waveform
        return wave.range_resolution * wave.n_samples, 0.5 * C0 / (wave.middle * wave.repetition)

    @property
    def resolutions(self) -> tuple[float, float]:
        """Resolution of range [m] and rate [m/s]."""
        return self.waveform.range_resolution, self.periods[1] / self.waveform.n_chirps

    @cached_property
    def main_lobes(self) -> tuple[float, float]:
        """Resolution cells of range and rate from a peak to the first null of its window."""
        return main_lobe(self._windows[0], len(self._range)), main_lobe(self._windows[1], len(self._rate))

    @property
    def drift(self) -> float:
        """Range-Doppler coupling [s]: range error of a path for each m/s that it recedes faster than its cell."""
        return self.waveform.middle / self.waveform.slope

    def stands(self, delay: Floats, rate: Floats, mid_frame: bool) -> tuple[Floats, Floats]:
        """Return the ranges (n,) [m] of paths, at mid frame or at its start, and their rates (n,) [m/s]."""
        return 0.5 * C0 * delay + (rate * self.waveform.centre if mid_frame else 0.0), rate

    def _rate_tables(self, parts: int) -> tuple[Complexes, Floats]:
        """Return, for each part of the frame, the rate response with weights 1 and with weights of the chirp number
        from the part's middle (parts, ., 2), and the middles (parts,)."""
        chirps, tables, middles = np.arange(len(self._rate)), [], []
        for part in np.array_split(chirps, parts):
            held = np.zeros(len(chirps))
            held[part] = self._rate[part] / self._rate.sum()
            tables.append(np.stack([_table(held), _table(held * (chirps - part.mean()))], axis=1))
            middles.append(part.mean())
        return np.array(tables), np.array(middles)


@lru_cache(maxsize=2)
def _in_range(name: str, n: int) -> Complexes:
    """Return the range response of a window of n samples and its derivative by range cells (., 2)."""
    taper = window(name, n)
    table = _table(taper / taper.sum())
    both = np.empty((len(table), 2), table.dtype)
    both[:, 0] = table
    # What np.gradient gives, without an array more: of 2^20 samples each has a gigabyte.
    np.subtract(table[2:], table[:-2], out=both[1:-1, 1])
    both[1:-1, 1] *= 0.5 * _FINE
    both[0, 1], both[-1, 1] = _FINE * (table[1] - table[0]), _FINE * (table[-1] - table[-2])
    return both


def _table(weights: Floats) -> Complexes:
    """Return the spectrum of weights over its period of len(weights) cells, _FINE points a cell."""
    n = len(weights)
    if n > MANY:
        half = np.fft.rfft(weights, n * _FINE)
        half *= np.exp((1j * np.pi * (n - 1) / n / _FINE) * np.arange(len(half)))
        # One period on, it changes sign where n is even.
        return np.concatenate([half, (half if n & 1 else -half)[-2::-1].conj()])
    raw = np.fft.fft(weights, n * _FINE)
    # The phase is counted from the middle of the samples, where a symmetric window is real.
    return np.append(raw, raw[0]) * np.exp(1j * np.pi * (n - 1) / n * np.arange(n * _FINE + 1) / _FINE)


def _beyond(size: Floats) -> Floats:
    """Return the largest magnitude of a response at 0, 1, 2, ... cells from the peak and farther."""
    n = len(size) // _FINE
    by_cell = np.maximum.reduceat(size, np.arange(0, n * _FINE, _FINE))
    by_cell = np.maximum(by_cell, by_cell[::-1])[: n // 2 + 1]
    return np.asarray(np.maximum.accumulate(by_cell[::-1])[::-1])
