"""The echoes whose beat signals are summed, and how they come between two elements of an array."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.radar.array import Wavefronts
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]

_MANY = 20_000  # echoes from which on a second thread pays (not measured)


@dataclass(frozen=True)
class Echoes:
    """Echoes at one instant; rows (n,), delay [s]. `Keystone` takes them at the middle sample of a frame."""

    delay: Floats
    delay_rate: Floats
    """Change of the delay per time, 2 v / c."""
    amplitude: Complexes
    fronts: Wavefronts | None = None
    """The waves at both ends; None where all elements stand at the phase centres."""
    begun: float = 0.0
    """The instant [s], from that to which the instants of the waves refer."""

    def __getitem__(self, rows: Any) -> Echoes:
        fronts = None if self.fronts is None else self.fronts[rows]
        return Echoes(self.delay[rows], self.delay_rate[rows], self.amplitude[rows], fronts, self.begun)

    def in_order(self, order: Ints) -> Echoes:
        """Return the echoes in another order, sorted by all threads."""
        (delay, rate), amplitude = np.empty((2, len(order))), np.empty(len(order), np.complex128)

        def some(at: slice) -> None:
            rows = order[at]
            delay[at], rate[at], amplitude[at] = self.delay[rows], self.delay_rate[rows], self.amplitude[rows]

        parallel_for(len(order), some, _MANY)
        return Echoes(delay, rate, amplitude, None if self.fronts is None else self.fronts[order], self.begun)

    def after(self, time: float, carrier: float) -> Echoes:
        """Return the echoes a time [s] later, their amplitudes with the phase of the carrier [Hz] until then."""
        if time == 0.0:
            return self
        grown = self.delay_rate * time
        turned = self.amplitude * np.exp(-2j * np.pi * carrier * grown)
        return Echoes(self.delay + grown, self.delay_rate, turned, self.fronts, self.begun + time)

    def between(self, tx: Floats, rx: Floats) -> tuple[Floats, Floats, Complexes]:
        """Return by how much later (n,) [s] than at the phase centres they come between elements at tx and rx (3,) [m],
        by how much their delays grow faster (n,), and their amplitudes (n,), less the phase of the first."""
        if self.fronts is None:
            return np.zeros(len(self.delay)), np.zeros(len(self.delay)), self.amplitude
        (longer, factor), faster = self.fronts.between(tx, rx), self.fronts.faster(tx, rx)
        longer = longer + faster * (self.begun - self.fronts.instant)
        return longer / C0, faster / C0, self.amplitude * factor
