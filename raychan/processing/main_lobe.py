"""Where peaks of a map lie between its cells, and how high they are: by the main lobes of its windows."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from raychan.processing.cfar import Grid
from raychan.radar.waveform import OwnWaveform, Waveform
from raychan.radar.windows import window

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_STEEP = 5.0  # Np of power: a main lobe that falls more to a neighbour is near its null there
_TINY = 1e-300
_KNOTS = 257  # of the table of offsets up to half a map cell (not measured)
_FINE = 512  # knots of the response per resolution cell (not measured)


class MainLobe:
    """The main lobe of a window over n samples, on a grid of `pad` map cells per resolution cell."""

    def __init__(self, name: str, n: int, pad: int) -> None:
        taper = window(name, n)
        self._x = np.arange(2 * _FINE + 1) / _FINE
        phase = np.exp(2j * np.pi * np.outer(self._x, np.arange(n) - 0.5 * (n - 1)) / n)
        self._fall = np.log(np.maximum(np.abs(phase @ taper) / taper.sum(), _TINY) ** 2 + _TINY)
        self.pad, shift = pad, np.linspace(0.0, 0.5, _KNOTS)
        top, above, below = self(shift), self(shift - 1.0), self(shift + 1.0)
        self._shift, self._gain = shift, -top
        self._near, self._far = np.exp(0.5 * (above - top)), np.exp(0.5 * (below - top))
        self._past = np.linspace(-1.0, 0.5, 3 * _KNOTS)
        # Beyond the null of the main lobe ratios say nothing more.
        self._ratio = np.minimum.accumulate((self(self._past - 1.0) - self(self._past))[::-1])[::-1]
        bend = below - 2.0 * top + above
        self.flat = bool(bend.max() >= -1e-9)  # of one sample: all cells are equal
        self.deep = bool((below - top).min() < -_STEEP)
        if not (self.flat or self.deep):
            self._parabola = 0.5 * (below - above) / bend
            scale = -top[1:] / (0.25 * (above - below) * self._parabola)[1:]
            self._scale = np.concatenate([scale[:1], scale])

    def __call__(self, away: Floats) -> Floats:
        """Return the response [Np of power] at map cells from the peak."""
        return np.asarray(np.interp(np.abs(away) / self.pad, self._x, self._fall))

    def between(self, below: Floats, top: Floats, above: Floats) -> tuple[Floats, Floats]:
        """Return the offset [map cells] of peaks and how much higher they are [Np], from three neighbours [Np].

        The parabola through them, of which what it errs for a lone echo is undone: echoes that merge may make a lobe
        wider or narrower. Where a neighbour is near a null, its level says little: the stronger one places a lone
        echo, and the parabola stays where the weaker one contradicts.
        """
        # A null beside a peak (unpadded, or without noise) must not distort the parabola.
        low, high = (np.maximum(x, top - _STEEP) for x in (below, above))
        bend = low - 2.0 * top + high
        inside = bend < 0.0
        shift = np.clip(np.divide(0.5 * (low - high), bend, out=np.zeros(len(top)), where=inside), -0.5, 0.5)
        gain = 0.25 * (high - low) * shift
        if self.flat:
            return shift, gain
        if not self.deep:
            size = np.abs(shift)
            return np.sign(shift) * np.interp(size, self._parabola, self._shift), gain * np.interp(
                size, self._parabola, self._scale
            )
        near, far = (np.exp(0.5 * np.minimum(f(below, above) - top, 0.0)) for f in (np.maximum, np.minimum))
        lone = np.interp(near, self._near, self._shift)
        shown = np.interp(lone, self._shift, self._far)
        off = np.where(far > shown, near - shown, near)
        fit = inside * np.clip(1.0 - (np.abs(far - shown) / np.maximum(off, _TINY)) ** 2, 0.0, 1.0)
        return (
            fit * np.sign(above - below) * lone + (1.0 - fit) * shift,
            fit * np.interp(lone, self._shift, self._gain) + (1.0 - fit) * gain,
        )

    def beyond(self, top: Floats, over: Floats) -> tuple[Floats, Floats]:
        """Return what `between` does of lone peaks nearer to a neighbour, `over`, than to the cell, upwards."""
        past = np.interp(top - over, self._ratio, self._past)
        return 1.0 - past, over - top - self(past)


class PeakShape:
    """The main lobes of a map along rate and range."""

    def __init__(
        self, windows: tuple[str, str], samples: tuple[int, int], grid: Grid, skew: float = 0.0, wraps: bool = False
    ) -> None:
        """Args: windows, and how many samples they have; skew, range cells by which an echo lies lower in the next row
        of a map, per rate cell: rows are freed of their own Doppler shifts; wraps, whether the last range cell is
        beside the first."""
        given = zip(windows, samples, grid.pad, strict=True)
        self.lobes = [_main_lobe(name, n, pad) for name, n, pad in given]
        self._skew, self._wraps = skew * grid.pad[1] / grid.pad[0], wraps

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
        inner = ((cells[:, 1] > 0) & (cells[:, 1] < shape[1] - 1) | self._wraps) & (shape[1] > 2)
        shift[inner, 1], gain[inner] = self.lobes[1].between(reach[0, inner], top[inner], reach[1, inner])
        if shape[0] > 2:
            here, rest = self.lobes[1](shift[:, 1]), self._turn(shape) - round(self._turn(shape))
            ends = cells[:, 0] == 0, cells[:, 0] == shape[0] - 1
            sides = [
                x - np.maximum(self.lobes[1](shift[:, 1] + step * (rest * end - self._skew)) - here, -_STEEP) * inner
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


@lru_cache(maxsize=16)
def _main_lobe(name: str, n: int, pad: int) -> MainLobe:
    """Return a main lobe, kept for the next frame of a sequence."""
    return MainLobe(name, n, pad)
