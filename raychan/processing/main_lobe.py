"""Main lobes of windows: where lone echoes lie between the cells of a map, and how high they are."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from raychan.radar.near_spectrum import near_zero
from raychan.radar.windows import window

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STEEP = 5.0
"""Np of power: a main lobe that falls more to a neighbour is near its null there (not measured)."""
_TINY = 1e-300
_KNOTS = 257  # of the table of offsets up to half a map cell (not measured)
_FINE = 512  # knots of the response per resolution cell (not measured)
_SPAN = 16  # resolution cells of the response: further than the cells around a peak are apart
_RIDGE = 1e-10  # of the variance: rounding errors of maps in single precision, of all weights (not measured)


class MainLobe:
    """The main lobe of a window over n samples, on a grid of `pad` map cells per resolution cell."""

    def __init__(self, name: str, n: int, pad: int) -> None:
        taper = window(name, n)
        self._x = np.arange(_SPAN * _FINE + 1) / _FINE
        middle = np.exp(1j * np.pi * self._x * (n - 1) / n)
        self._wave, self._covariance = (
            (near_zero(x / x.sum(), _FINE, len(self._x)) * middle).real for x in (taper, taper**2)
        )
        self._fall = np.log(np.maximum(np.abs(self._wave), _TINY) ** 2 + _TINY)
        self.n, self.pad, shift = n, pad, np.linspace(0.0, 0.5, _KNOTS)
        top, above, below = self(shift), self(shift - 1.0), self(shift + 1.0)
        self._shift, self._gain = shift, -top
        self._near, self._far = np.exp(0.5 * (above - top)), np.exp(0.5 * (below - top))
        self._past = np.linspace(-1.0, 0.5, 3 * _KNOTS)
        # Beyond the null of the main lobe ratios say nothing more.
        self._ratio = np.minimum.accumulate((self(self._past - 1.0) - self(self._past))[::-1])[::-1]
        bend = below - 2.0 * top + above
        self.flat = bool(bend.max() >= -1e-9)  # of one sample: all cells are equal
        self.deep = bool((below - top).min() < -STEEP)
        if not (self.flat or self.deep):
            self._parabola = 0.5 * (below - above) / bend
            scale = -top[1:] / (0.25 * (above - below) * self._parabola)[1:]
            self._scale = np.concatenate([scale[:1], scale])

    def __call__(self, away: Floats) -> Floats:
        """Return the response [Np of power] at map cells from the peak."""
        return np.asarray(np.interp(np.abs(away) / self.pad, self._x, self._fall))

    def wave(self, away: Floats) -> Floats:
        """Return the response in amplitude, with its sign, at map cells from the peak."""
        return np.asarray(np.interp(np.abs(away) / self.pad, self._x, self._wave))

    def weights(self, places: Floats, wanted: Floats) -> Floats:
        """Return the weights (..., k) of amplitudes at places (k,) in the best linear estimate of those at others
        (...), all in map cells, of echoes that may lie anywhere.

        Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, equation 2.25.
        """

        def covariance(away: Floats) -> Floats:
            return np.asarray(np.interp(np.abs(away) / self.pad, self._x, self._covariance))

        own = covariance(places[:, None] - places) + _RIDGE * np.eye(len(places))
        return np.asarray(covariance(wanted[..., None] - places) @ np.linalg.inv(own))

    def between(self, below: Floats, top: Floats, above: Floats) -> tuple[Floats, Floats]:
        """Return the offset [map cells] of peaks and how much higher they are [Np], from three neighbours [Np].

        The parabola through them, of which what it errs for a lone echo is undone: echoes that merge may make a lobe
        wider or narrower. Where a neighbour is near a null, its level says little: the stronger one places a lone
        echo, and the parabola stays where the weaker one contradicts.
        """
        # A null beside a peak (unpadded, or without noise) must not distort the parabola.
        low, high = (np.maximum(x, top - STEEP) for x in (below, above))
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


@lru_cache(maxsize=16)
def main_lobe(name: str, n: int, pad: int) -> MainLobe:
    """Return a main lobe, kept for the next frame of a sequence."""
    return MainLobe(name, n, pad)
