"""Channels of several transmitters under other folds than that of their cell: an echo folded once more is turned from
transmitter to transmitter by time division, and stands a slot further by Doppler division.

An echo beside the rate of its cell is folded by a part of a span more. Time division then leaves turns between the
transmitters; by Doppler division side lobes along rate of each fall on the slots of the others. Both are phases of
sequences of every n-th chirp, of n slots, which are undone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.radar.windows import window

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]


@dataclass(frozen=True)
class Slots:
    """The slots of a radar's transmitters, and the folds that a receiver tells apart by them."""

    senders: int = 1
    """Transmitters told apart by slots; 1 with staggered ramps, of which a cell keeps the sum."""
    count: int = 1
    """Slots: by time division the transmitters, by Doppler division perhaps more."""
    shifted: bool = False
    """Whether transmitters are told apart by Doppler division."""
    tested: int = 1
    """Folds told apart in a cell."""

    window: str = "rect"
    """Window along rate."""
    chirps: int = 1
    """Chirps that it weighs, by Doppler division of all slots."""

    @classmethod
    def of(cls, radar: Radar, tested: int, window: str) -> Slots:
        """Return the slots of a radar whose receiver tells so many folds apart, by a window along rate."""
        if radar.waveform.stagger:
            return cls(tested=tested)
        shifted = radar.multiplexing == "ddm"
        return cls(len(radar.tx_elements), radar.slots, shifted, tested, window, radar.waveform.n_chirps)

    @property
    def folds(self) -> range:
        """Folds that one cell may hold together, by how many more they are than that under which it is read."""
        return range(self.tested if self.count > 1 else 1)

    def under(self, channels: Complexes, h: float) -> Complexes:
        """Return what slots (s, ...) hold if the echo is folded h times more than they are read now."""
        whole = round(h)
        if not self.shifted:
            return np.asarray(channels * _along(np.exp(2j * np.pi * h * np.arange(self.count) / self.count), channels))
        channels = np.roll(channels, whole, axis=0)
        if h == whole:
            return channels
        turned = scipy.fft.ifft(channels, axis=0) * _along(self._turns(h - whole), channels)
        return np.asarray(scipy.fft.fft(turned, axis=0))

    def _turns(self, part: float) -> Complexes:
        """Return the factors (s,) that undo what turns sequences of every s-th chirp by a part of a span: of a window
        that falls towards the ends of the frame less than without one."""
        chirp = np.arange(self.chirps) - 0.5 * (self.chirps - 1)
        weighed = _taper(self.window, self.chirps) * np.exp(-2j * np.pi * part / self.count * chirp)
        held = weighed.reshape(-1, self.count).sum(axis=0)
        return np.asarray(held.conj() / np.abs(held))

    def read_under(self, data: Complexes, h: float) -> Complexes:
        """Return data (s * a,) of slots as read for echoes folded h times more."""
        return self.under(data.reshape(self.count, -1), h).ravel()

    def waves(self, waves: Complexes, folds: Any) -> Complexes:
        """Return what slots hold (n, s * a) of waves in the transmitters' channels (n, t * a) that are folded so many
        times (n,) more than the slots are read, by Doppler division a whole number of times."""
        count, receivers = len(waves), waves.shape[1] // self.senders
        held = np.zeros((self.count, count, receivers), waves.dtype)
        held[: self.senders] = np.moveaxis(waves.reshape(count, self.senders, receivers), 1, 0)
        if not self.shifted:
            held *= np.exp(-2j * np.pi / self.count * np.multiply.outer(np.arange(self.count), folds))[:, :, None]
        for h in {int(x) % self.count for x in folds} - {0} if self.shifted else ():
            rows = np.asarray(folds) % self.count == h
            held[:, rows] = self.under(held[:, rows], -h)
        return np.moveaxis(held, 0, 1).reshape(count, self.count * receivers)


@lru_cache(maxsize=16)
def _taper(name: str, n: int) -> Floats:
    """Return a window (n,), kept for the next peak."""
    return window(name, n)


def _along(turns: Complexes, channels: Complexes) -> Complexes:
    """Return factors (s,) of slots in the form and precision of channels (s, ...)."""
    return turns.astype(channels.dtype).reshape(-1, *[1] * (channels.ndim - 1))


LONE = Slots()
"""Of one transmitter."""
