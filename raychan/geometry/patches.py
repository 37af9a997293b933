"""Patches of surfaces: points that stand for an area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Patches:
    """Patches, a row each: middle (n, 3) [m], facet (n,) and area (n,) [m^2]."""

    point: Floats
    facet: Ints
    area: Floats

    def take(self, rows: NDArray[np.generic]) -> Patches:
        """Return some of the patches."""
        return Patches(self.point[rows], self.facet[rows], self.area[rows])
