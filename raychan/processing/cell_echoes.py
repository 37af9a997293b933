"""Echoes within one cell of a map: directions, powers and beams, and which directions may be wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_UNTOLD = 0.01  # of an echo's power: waves that were not told apart, weaker than this, move its level by 0.9 dB at most
_UNTOLD_EVEN = 0.1
"""The same before a uniform line, whose side lobes are low: of 215 cells of streets before lines of 8, 16
and 64 two leave that much."""


@dataclass(frozen=True, eq=False)
class CellEchoes:
    """Echoes in one cell, strongest first."""

    direction: Floats
    """Cosines (k, 2) along y and z."""
    power: Floats
    """(k,) [W]"""
    weights: Complexes
    """Beams (k, s * a): times the cell's snapshot (s * a,) the echoes' waves."""
    fold: Ints
    """(k,) how many times more than the snapshot is read."""
    waves: Complexes
    """What the transmitters' channels (k, t * a) hold of each, of unit amplitude."""
    misfit: Floats
    """Share (k,) of each one's power that may be no wave of that form."""
    rest: float = 0.0
    """Power [W] of the strongest beam of what they leave: more than noise where two echoes were not told apart."""
    least: float = 0.0
    """Power [W] below which what they leave is noise, or what of them is no plane wave."""
    left: float = 0.0
    """Power [W] of what they leave in all channels, where waves of several forms are sought."""
    open: bool | Bools = False
    """Which directions (k,) other sets of waves lack that explain the cell as well."""

    @property
    def explained(self) -> bool:
        """Whether they leave noise, or what of them is no plane wave."""
        return self.rest <= self.least

    @property
    def order(self) -> tuple[bool, int, float]:
        """What is less of echoes that explain a cell better than others do."""
        return not self.explained, len(self.power) * self.explained, self.left

    def by_fold(self) -> dict[int, Floats]:
        """Return the directions of the echoes of each fold, first that of the strongest."""
        return {h: self.direction[self.fold == h] for h in dict.fromkeys(self.fold.tolist())}

    @property
    def noise_gain(self) -> Floats:
        """Noise power in each beam (k,) over that of one receiver."""
        return np.asarray((np.abs(self.weights) ** 2).sum(axis=1))

    def take(self, some: Bools) -> CellEchoes:
        """Return some of the echoes."""
        names = ("direction", "power", "weights", "fold", "waves", "misfit", "open")
        return replace(self, **{x: getattr(self, x)[some] for x in names})

    def unsure(self, aperture: Aperture) -> NDArray[np.bool_]:
        """Return which directions (k,) may be those of sums of waves not told apart: wrong by a part of a beam width
        before uniform lines and rectangles, by more where side lobes are high; or of as many unknowns as there are
        data, which other sets of waves fit as well."""
        if len(self.power) * (2 + sum(aperture.scans)) >= 2 * self.weights.shape[1]:
            return np.ones(len(self.power), bool)
        share = _UNTOLD_EVEN if aperture.uniform else _UNTOLD
        return np.asarray((self.rest > share * self.power) & (not self.explained) | self.open)
