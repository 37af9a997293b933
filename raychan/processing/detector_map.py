"""What the CFAR runs on: the mean power of the receivers, or the strongest of a bank of beams over them."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from raychan.processing.beams import BeamBank
from raychan.processing.cfar import Training, batches, level, statistic
from raychan.processing.peaks import AROUND, maxima, stepped
from raychan.records import RangeDoppler

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

BEAMS = ("coherent", "mean")
_ROUNDING = 1e-5  # two sums of single precision over the receivers


class DetectorMap(Protocol):
    """Power of every cell, and what its noise is compared with."""

    power: Floats
    """(v, r) [W]"""
    noise: float
    """Expected thermal noise of a cell of one look [W]; 0 when unknown."""
    looks: int
    """Independent powers that are averaged in a cell."""
    dip: float
    """Least power of an echo between the points of the map, over that of its peak."""
    receiver_noise: float
    """What `noise` grows by in a beam of weights w, over |w|^2."""

    def maxima(self, least: float) -> Ints:
        """Return the local maxima (c, 2) above a power [W]."""

    def lines(self, cell: Ints) -> tuple[Floats, Floats]:
        """Return the power of the column (v,) and the row (r,) of a cell (2,), by what is seen of that cell."""

    def single(self, pfa: float) -> float:
        """Return the false alarm probability that the threshold must keep for a cell to keep `pfa`."""

    def level(self, cells: Ints, ring: Training, method: str) -> Floats:
        """Return the mean or ordered statistic (c,) of the training cells around map cells (c, 2)."""


class MeanPower:
    """The mean over the receivers of their powers: noise averages, echoes gain nothing."""

    dip = 0.5  # between two padded cells of any window (not measured)

    def __init__(self, map: RangeDoppler, mirrors: bool = False) -> None:
        """Args: mirrors, whether ranges go on as mirror images (see `peaks.stepped`)."""
        self.power, self.noise, self.looks = map.power, map.noise, len(map.spectrum)
        self._mirrors = mirrors
        self.receiver_noise = float(self.looks)  # SNR is over the noise of one receiver

    def maxima(self, least: float) -> Ints:
        """Return the local maxima (c, 2) above a power [W]."""
        return maxima(self.power, least, self._mirrors)

    def lines(self, cell: Ints) -> tuple[Floats, Floats]:
        """Return the power of the column (v,) and the row (r,) of a cell (2,)."""
        return self.power[:, cell[1]], self.power[cell[0]]

    def single(self, pfa: float) -> float:
        """Return `pfa`."""
        return pfa

    def level(self, cells: Ints, ring: Training, method: str) -> Floats:
        """Return the level (c,) of the noise around map cells (c, 2)."""
        return level(self.power, cells, ring, method)


class StrongestBeam:
    """The strongest beam of each cell; its noise is that of the same beam in the training cells."""

    looks = 1
    dip = 0.3  # as above, less 0.9 dB between two beams, twice for a plane array

    def __init__(self, map: RangeDoppler, bank: BeamBank, mirrors: bool = False) -> None:
        """Args: mirrors, whether ranges go on as mirror images (see `peaks.stepped`)."""
        self.bank, self.spectrum, self._mirrors = bank, map.spectrum, mirrors
        self.power, self.beam = bank.strongest(map.spectrum)
        self.noise = map.noise * bank.noise_gain
        self.receiver_noise = 1.0 / bank.noise_gain

    def maxima(self, least: float) -> Ints:
        """Return the cells (c, 2) above a power [W] that are local maxima of the beam that is strongest in them.

        A weak echo beside a strong one of another direction is one, though the strong one's beam hides it from the
        map of the strongest beams.
        """
        cells = np.argwhere(self.power > least)
        for step in AROUND:
            near, image = stepped(cells, step, self.power.shape, self._mirrors)
            beside = np.empty(len(cells))
            for at in batches(len(cells), self.spectrum.shape[0]):
                rows = self.bank.rows[self.beam[tuple(cells[at].T)]]
                held = self.spectrum[:, near[at, 0], near[at, 1]]
                wave = np.einsum("ca,ac->c", rows, np.where(image[at], held.conj(), held))
                beside[at] = wave.real**2 + wave.imag**2
            cells = cells[self.power[tuple(cells.T)] >= beside * (1.0 - _ROUNDING)]
        return cells

    def lines(self, cell: Ints) -> tuple[Floats, Floats]:
        """Return the power of the column (v,) and the row (r,) of a cell (2,), in the beam that is strongest there."""
        weights = self.bank.rows[self.beam[cell[0], cell[1]]]
        waves = weights @ self.spectrum[:, :, cell[1]], weights @ self.spectrum[:, cell[0]]
        column, row = (np.asarray(wave.real**2 + wave.imag**2, np.float64) for wave in waves)
        return column, row

    def single(self, pfa: float) -> float:
        """Return the false alarm probability of each beam."""
        return self.bank.single(pfa)

    def level(self, cells: Ints, ring: Training, method: str) -> Floats:
        """Return the level (c,) of the noise around map cells (c, 2) in the beam that is strongest there."""
        out = np.empty(len(cells))
        rows = self.bank.rows[self.beam[tuple(cells.T)]]
        for at in batches(len(cells), len(ring.offsets) * rows.shape[1]):
            v, r = ring.around(cells[at], self.power.shape)
            wave = np.einsum("ca,act->ct", rows[at], self.spectrum[:, v, r])
            out[at] = statistic(np.asarray(wave.real**2 + wave.imag**2, np.float64), method)
        return out
