"""Channels of several transmitters under other folds than that of their cell: an echo folded once more is turned from
transmitter to transmitter by time division, and stands a slot further by Doppler division."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar

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

    @classmethod
    def of(cls, radar: Radar, tested: int) -> Slots:
        """Return the slots of a radar whose receiver tells so many folds apart."""
        if radar.waveform.stagger:
            return cls(tested=tested)
        return cls(len(radar.tx_elements), radar.slots, radar.multiplexing == "ddm", tested)

    @property
    def folds(self) -> range:
        """Folds that one cell may hold together, by how many more they are than that under which it is read."""
        return range(self.tested if self.count > 1 else 1)

    def under(self, channels: Complexes, h: int) -> Complexes:
        """Return what slots (s, ...) hold if the echo is folded h times more than they are read now."""
        if self.shifted:
            return np.roll(channels, h, axis=0)
        turn = np.exp(2j * np.pi * (h * np.arange(self.count) % self.count) / self.count).astype(np.complex64)
        return np.asarray(channels * turn.reshape(-1, *[1] * (channels.ndim - 1)))

    def read_under(self, data: Complexes, h: int) -> Complexes:
        """Return data (s * a,) of slots as read for echoes folded h times more."""
        return self.under(data.reshape(self.count, -1), h).ravel()

    def waves(self, waves: Complexes, folds: Any) -> Complexes:
        """Return what slots hold (n, s * a) of waves in the transmitters' channels (n, t * a) that are folded so many
        times (n,) more than the slots are read."""
        count, receivers = len(waves), waves.shape[1] // self.senders
        held = np.zeros((self.count, count, receivers), waves.dtype)
        held[: self.senders] = np.moveaxis(waves.reshape(count, self.senders, receivers), 1, 0)
        for h in {int(x) % self.count for x in folds} - {0}:
            rows = np.asarray(folds) % self.count == h
            held[:, rows] = self.under(held[:, rows], -h)
        return np.moveaxis(held, 0, 1).reshape(count, self.count * receivers)


LONE = Slots()
"""Of one transmitter."""
