"""Side lobes of windows: envelopes of their responses, and how a window correlates noise between cells."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from raychan.radar.near_spectrum import MANY, near_zero
from raychan.radar.windows import window

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_FINE = 16  # points per resolution cell
_COARSE = 2  # the same of two axes: a side lobe between points is up to 0.9 dB higher; 4 take four times as long
_WIDEST = 64  # resolution cells within which every window of many samples has its first null
# Samples of an axis: bounds by resolution cells are those of 1536 x 1536 samples, at most 0.2 dB lower and 1.7 dB
# higher up to a quarter of these, 7 dB at half of them (rect, Hamming, Taylor; others differ more, below -130 dB; no
# command). A frame of 2048 x 2048 took 9.6 of 18.8 s for twelve envelopes.
_MOST = 512
_AS_HIGH = 0.5  # of the highest peak of a smeared echo: a map cell between two peaks may make such a one the higher


class SideLobeEnvelope:
    """Least falling bound of a window's power response, 1 at the peak; offsets in resolution cells."""

    def __init__(self, name: str, n: int, slots: int = 1) -> None:
        """Args: window by name, of n samples; slots, parts of its period that fall on each other, as those of the
        transmitters do by Doppler division: what they leak adds up as amplitudes."""
        taper = window(name, n)
        if n > MANY and slots == 1:
            response = np.abs(np.fft.rfft(taper / taper.sum(), n * _FINE)) ** 2
        else:
            period = np.abs(np.fft.fft(taper / taper.sum(), n * _FINE)).reshape(slots, -1).sum(axis=0)
            response = period[: len(period) // 2 + 1] ** 2
        self.table: Floats = np.maximum.accumulate(response[::-1])[::-1]

    def __call__(self, cells: Floats) -> Floats:
        """Return the bound at offsets of any shape."""
        # The lower neighbour in the table: a bound must not fall below the response between two points.
        at = np.minimum(np.abs(cells) * _FINE, len(self.table) - 1).astype(np.int64)
        return np.asarray(self.table[at])


class MigratingEnvelope:
    """Least falling bound of both windows' power response to an echo that migrates over range cells, about a peak of
    it; offsets in resolution cells.

    Side lobes of an abrupt rate window are those of the frame's beginning and end, at the ranges where the echo then
    is: they do not lose what the peak loses by migration, which is no matter of a shift.
    """

    def __init__(self, names: tuple[str, str], count: tuple[int, int], moved: float, slots: int = 1) -> None:
        """Args: windows (rate, range) by name, of so many chirps and samples; moved, range cells during the frame;
        slots of the rate axis as for `SideLobeEnvelope`."""
        # What leaks from slot to slot depends on how many cells there are.
        fewer = count[0] if slots > 1 else min(count[0], _MOST), min(count[1], _MOST)
        # Bounds farther off are those a cell before the end, where the response may be zero.
        self._short = [_COARSE * (a < b) for a, b in zip(fewer, count, strict=True)]
        count = fewer
        tapers = [window(name, n) for name, n in zip(names, count, strict=True)]
        when = [(np.arange(n) - 0.5 * (n - 1)) / n for n in count]
        turn = np.exp(2j * np.pi * moved * np.outer(*when)).astype(np.complex64)
        for axis, taper in enumerate(tapers):
            turn *= np.expand_dims(taper / taper.sum(), 1 - axis).astype(np.float32)
        size = np.abs(fft.fft2(turn, [n * _COARSE for n in count]))
        size = size.reshape(slots, -1, size.shape[1]).sum(axis=0)
        # By the windows' symmetry all quadrants are alike.
        power = size[: size.shape[0] // 2 + 1, : size.shape[1] // 2 + 1] ** 2
        self.off = _peaks(power)
        """Resolution cells (2,) along rate and range that a peak may stand off the middle of the frame."""
        power = np.maximum.accumulate(power[::-1], axis=0)[::-1]
        power = np.maximum.accumulate(power[:, ::-1], axis=1)[:, ::-1]
        self.table: Singles = power / power[0, 0]

    def __call__(self, rate: Floats, range: Floats) -> Floats:
        """Return the bound at offsets along rate and range from the middle of the frame, of one shape."""
        rows, columns = (
            np.minimum(np.abs(x) * _COARSE, n - 1 - short).astype(np.int64)
            for x, n, short in zip((rate, range), self.table.shape, self._short, strict=True)
        )
        return self.table[rows, columns].astype(np.float64)


@lru_cache(maxsize=16)
def migrating(names: tuple[str, str], count: tuple[int, int], moved: float, slots: int) -> MigratingEnvelope:
    """Return an envelope, kept for the next peak and frame; args as for `MigratingEnvelope`."""
    return MigratingEnvelope(names, count, moved, slots)


def _peaks(power: Singles) -> Floats:
    """Return the places farthest along each axis (2,) of peaks of a quadrant of a response, in resolution cells."""
    around = np.pad(power, 1, mode="reflect") if min(power.shape) > 1 else np.pad(power, 1, mode="edge")
    rows, columns = power.shape
    highest = np.max([around[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0)
    at = np.argwhere((power >= highest) & (power >= _AS_HIGH * power.max()))
    return np.asarray(at.max(axis=0) / _COARSE)


def main_lobe(name: str, n: int) -> float:
    """Return where the main lobe of a window of n samples ends: its first null, in resolution cells from the peak."""
    taper = window(name, n)
    if n > MANY:
        size = np.abs(near_zero(taper, _FINE, _WIDEST * _FINE))
    else:
        size = np.abs(np.fft.fft(taper, n * _FINE))[: n * _FINE // 2 + 1]
    rises = np.flatnonzero(np.diff(size) > 0.0)
    return (float(rises[0]) if len(rises) else 0.5 * n * _FINE) / _FINE


def correlation(name: str, n: int, cells: Floats) -> Floats:
    """Return the correlation of white noise between two cells `cells` resolution cells apart, by the window (n,)."""
    weight = window(name, n) ** 2
    phase = np.exp(2j * np.pi * np.multiply.outer(cells, np.arange(n) - 0.5 * (n - 1)) / n)
    return np.asarray(np.abs(phase @ weight) / weight.sum())
