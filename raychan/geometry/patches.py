"""Patches of surfaces: points that stand for an area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Patches:
    """Patches, a row each: middle (n, 3) [m], facet (n,) and area (n,) [m^2]; grown, how many times larger than was
    asked for some are, as they were too many."""

    point: Floats
    facet: Ints
    area: Floats
    grown: float = 1.0

    def take(self, rows: NDArray[np.generic]) -> Patches:
        """Return some of the patches."""
        return Patches(self.point[rows], self.facet[rows], self.area[rows], self.grown)
