"""Where peaks of a map lie between its cells, and how high they are: by the main lobes of its windows, and by what the
cells around hold beside a lone echo."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.cfar import Grid, batches
from raychan.processing.main_lobe import STEEP, main_lobe
from raychan.radar.waveform import OwnWaveform, Waveform

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]
Wave = Callable[[Ints, Ints], Complexes]
Peak = tuple[Floats, Floats]

_TINY = 1e-300
_REACH = 6
"""Map cells around a peak. At padding 2, of 122 detections of a strong and a weak echo (Hann and rect windows), no
level is more than 0.003 dB off the peak of the map."""
_ASIDE = 2  # range cells to either side that are needed where cells are read under different folds (not measured)
_STEPS = 8  # per map cell, of places that are tried for a peak: over one a lobe is a parabola (not measured)


class PeakShape:
    """The main lobes of a map along rate and range."""

    def __init__(
        self, windows: tuple[str, str], samples: tuple[int, int], grid: Grid, skew: float = 0.0, wraps: bool = False
    ) -> None:
        """Args: windows, and how many samples they have; skew, range cells by which an echo lies lower in the next row
        of a map, per rate cell: rows are freed of their own Doppler shifts; wraps, whether the last range cell is
        beside the first."""
        given = zip(windows, samples, grid.pad, strict=True)
        self.lobes = [main_lobe(name, n, pad) for name, n, pad in given]
        self._skew, self.wraps = skew * grid.pad[1] / grid.pad[0], wraps

    @classmethod
    def of(cls, grid: Grid, windows: tuple[str, str], waveform: Waveform | None, chirps: int | None) -> PeakShape:
        """Return the main lobes of a map; args as for `detection.detect`."""
        rates = chirps or grid.count[0]
        if waveform is None:
            return cls(windows, (rates, grid.count[1]), grid)
        if isinstance(waveform, OwnWaveform):
            # Its compression has no window's response: one sample has none, and the parabola stays.
            return cls((windows[0], "rect"), (rates, 1), grid)
        skew = waveform.chirp_duration / waveform.frame_duration
        return cls(windows, (rates, waveform.n_samples), grid, skew, waveform.complex_sampling)

    def refine(self, power: Floats, cells: Ints) -> tuple[Floats, Floats]:
        """Return the offsets (c, 2) in cells and the power (c,) of the peaks at map cells (c, 2)."""
        rows, columns = cells.T
        steps = ((-1, 0), (1, 0), (0, -1), (0, 1))
        around = [power[self.cells_at(rows + down, columns + along, power.shape)] for down, along in steps]
        return self.between(power[tuple(cells.T)], np.array(around).reshape(2, 2, -1), cells, power.shape)

    def among(
        self, wave: Wave, looks: int, cells: Ints, lone: Peak, shape: tuple[int, ...], alike: bool = True
    ) -> Peak:
        """Return what `refine` does, whatever the cells around hold beside a lone echo.

        A window makes a spectrum band-limited: from the cells around follows what lies between them. At padding 1 too
        much of it is beyond them, and peaks stay as they are.
        Args: wave, a function that returns what so many looks hold (looks, ...) in rows and columns (...) of a map;
        lone, what `refine` returns; alike, whether all cells are read under one fold. Where they are not, noise is
        not band-limited, and near an end of the ranges, where cells on one side tell it all, peaks stay as they are.
        """
        rows, columns = cells.T
        shift, power = (x.copy() for x in lone)
        reach = [min(_REACH, (n - 1) // 2) for n in shape]
        padded = all(lobe.pad > 1 or n <= 2 for lobe, n in zip(self.lobes, shape, strict=True))
        told = np.full(len(cells), padded and not self.lobes[1].flat)
        # Near an end of the ranges more cells lie on one side; beyond an end of the rates echoes lie elsewhere.
        low = columns - reach[1]
        low = low if self.wraps else np.clip(low, 0, shape[1] - 1 - 2 * reach[1])
        ends = np.clip(rows, reach[0], shape[0] - 1 - reach[0]) - rows
        there = low - np.sign(ends) * round(self._turn(shape))
        there = self._inner(cells, shape) & (there >= 0) & (there < shape[1] - 2 * reach[1])
        told &= (self.wraps | (ends == 0) | there) & (shape[1] > 2) & (np.abs(shift[:, 0]) <= 0.5)
        told &= alike | self.wraps | (np.minimum(columns, shape[1] - 1 - columns) >= _ASIDE * self.lobes[1].pad)
        some = np.flatnonzero(told)
        groups, group = np.unique(np.stack([ends, low - columns], axis=1)[some], axis=0, return_inverse=True)
        for k, (_, first) in enumerate(groups):
            mine = some[group.ravel() == k]
            down, along = np.arange(-reach[0], reach[0] + 1), np.arange(2 * reach[1] + 1) + first
            for part in batches(len(mine), looks * len(down) * len(along)):
                at = mine[part]
                seen, lower = self._around(wave, cells[at], down, along, shape)
                shift[at], power[at] = self._peak(
                    seen, down.astype(np.float64), along.astype(np.float64), lower, shift[at]
                )
        return shift, power

    def _around(
        self, wave: Wave, cells: Ints, down: Ints, along: Ints, shape: tuple[int, ...]
    ) -> tuple[Complexes, Floats]:
        """Return the amplitudes (a, c, v, r) at steps (v,) and (r,) from cells (c, 2), with phases that count from the
        middle samples of both axes, and the range cells (v,) by which an echo lies lower in these rows than in the
        cell's. Of all cells the same rows lie beyond an end of the rates."""
        v, r = np.broadcast_arrays(cells[:, :1, None] + down[:, None], cells[:, 1:, None] + along)
        seen, turns, jump = wave(*self.cells_at(v, r, shape)), v[:1, :, :1] // shape[0], round(self._turn(shape))
        phase = sum(
            x * (0.5 * (lobe.n - 1) / (lobe.n * lobe.pad))
            for x, lobe in zip((v, r + turns * jump), self.lobes, strict=True)
        )
        lower = self._skew * down - (self._turn(shape) - jump) * turns[0, :, 0]
        return seen * np.exp(-2j * np.pi * phase), lower

    def _peak(self, seen: Complexes, down: Floats, along: Floats, lower: Floats, shift: Floats) -> Peak:
        """Return offsets (c, 2) and power (c,) of peaks by what `_around` returns, from the offsets of lone echoes:
        what is seen beside these is interpolated."""
        (rate, reach), steps = self.lobes, np.arange(-_STEPS - 1, _STEPS + 2) / _STEPS
        # Along an axis of two cells there is nothing between them.
        fine = [steps * (len(x) > 1) for x in (down, along)]
        place = shift[:, 1] + self._skew * shift[:, 0]

        def lone(v: Floats, r: Floats) -> Floats:
            """Return the amplitudes (c, v, r) of lone echoes at rates (v,) and ranges (v, r), freed of the skew."""
            return rate.wave(v - shift[:, :1])[:, :, None] * reach.wave(r - place[:, None, None])

        own, here = lone(down, along + lower[:, None]), (len(down) // 2, int(np.flatnonzero(along == 0)[0]))
        peak = (seen[:, :, *here] / own[:, *here])[:, :, None, None]
        weights = reach.weights(along, fine[1] - lower[:, None])
        rows = np.einsum("acvr,vfr->acvf", seen - peak * own, weights, optimize=True)
        near = rate.weights(down, fine[0]) @ rows + peak * lone(fine[0], fine[1][None])
        off, power = _top((near.real**2 + near.imag**2).mean(axis=0), fine)
        off[:, 1] -= self._skew * off[:, 0]
        return off, power

    def _inner(self, cells: Ints, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Return which cells (c, 2) of a map have neighbours below and above in range."""
        return ((cells[:, 1] > 0) & (cells[:, 1] < shape[1] - 1) | self.wraps) & (shape[1] > 2)

    def cells_at(self, rows: Ints, columns: Ints, shape: tuple[int, ...]) -> tuple[Ints, Ints]:
        """Return rows and columns of a map of those that may lie beyond its ends: rows go on at the other end, in range
        cells as far away as the Doppler shifts of both ends are, of which rows are freed."""
        turns = np.floor_divide(rows, shape[0])
        return rows - turns * shape[0], (columns + turns * round(self._turn(shape))) % shape[1]

    def _turn(self, shape: tuple[int, ...]) -> float:
        """Return by how many range cells of a map an echo lies higher in a row than in the next span of rates."""
        return self._skew * shape[0]

    def between(self, top: Floats, around: Floats, cells: Ints, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
        """Return what `refine` does, from the powers (c,) of cells and of those below and above (axis, 2, c)."""
        top, (rate, reach) = np.log(np.maximum(top, _TINY)), np.log(np.maximum(around, _TINY))
        shift, gain = np.zeros(cells.shape), np.zeros(len(cells))
        inner = self._inner(cells, shape)
        shift[inner, 1], gain[inner] = self.lobes[1].between(reach[0, inner], top[inner], reach[1, inner])
        if shape[0] > 2:
            here, rest = self.lobes[1](shift[:, 1]), self._turn(shape) - round(self._turn(shape))
            ends = cells[:, 0] == 0, cells[:, 0] == shape[0] - 1
            sides = [
                x - np.maximum(self.lobes[1](shift[:, 1] + step * (rest * end - self._skew)) - here, -STEEP) * inner
                for x, step, end in zip(rate, (-1.0, 1.0), ends, strict=True)
            ]
            shift[:, 0], more = self.lobes[0].between(sides[0], top, sides[1])
            for x, side, step, end in zip(rate, sides, (-1.0, 1.0), ends, strict=True):
                # Over the end of the rates an echo lies elsewhere between range cells, which may hide its peak.
                over = end & (x <= top) & (side > top)
                away, more[over] = self.lobes[0].beyond(top[over], side[over])
                shift[over, 0] = step * away
            gain += more
            shift[inner, 1] -= self._skew * shift[inner, 0]
        return shift, np.exp(top + gain)


def _top(power: Floats, fine: list[Floats]) -> Peak:
    """Return where (c, 2), up to a cell away, the powers (c, v, r) at fine steps (v,) and (r,) peak, and that
    power (c,), by parabolas in dB."""
    level = np.log(np.maximum(power, _TINY))
    inner = level[:, 1:-1, 1:-1]
    k, at = np.arange(len(level)), np.unravel_index(inner.reshape(len(level), -1).argmax(axis=1), inner.shape[1:])
    off, top = np.empty((len(level), 2)), inner[k, *at]
    gain = np.zeros(len(level))
    for axis, place in enumerate(fine):
        low, high = (level[k, at[0] + 1 + s * (axis == 0), at[1] + 1 + s * (axis == 1)] for s in (-1, 1))
        # No step is 0: of an axis without any all levels are equal.
        part = np.clip(0.5 * (low - high) / np.minimum(low - 2.0 * top + high, -_TINY), -0.5, 0.5)
        off[:, axis] = np.clip(place[at[axis] + 1] + part * (place[1] - place[0]), -1.0, 1.0)
        gain += 0.25 * (high - low) * part
    return off, np.exp(top + gain)
