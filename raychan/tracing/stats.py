"""What launches cost and leave coarse, and what further ones are asked for."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from raychan.tracing.contributions import added
from raychan.tracing.shooting import Wanted
from raychan.tracing.tubes import Refinement

Ints = NDArray[np.int64]


@dataclass
class Stats:
    """What a launch cost and what it left coarser than asked for."""

    rays: int = 0
    tubes: int = 0
    legs: int = 0
    uncut: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """Tubes (bodies,) that were too many to be cut as finely as asked for."""

    def count_uncut(self, uncut: Ints) -> None:
        """Count further tubes (bodies,) that were too many."""
        self.uncut = added(self.uncut, uncut)

    def add(self, other: Stats) -> None:
        """Count what another launch over the same legs cost, too."""
        self.rays, self.tubes, self.legs = self.rays + other.rays, self.tubes + other.tubes, other.legs
        self.count_uncut(other.uncut)


@dataclass
class Further:
    """A further launch: the refinement by which tubes are cut; numbers of legs in, and what is wanted there (see
    `tracing.sources`); what it costs."""

    refinement: Refinement
    wanted: list[tuple[int, Wanted]]
    stats: Stats = field(default_factory=Stats)
    parts: list[tuple[int, Wanted, int]] = field(default_factory=list)
    """Number of the leg in, what was wanted and the rays that it took, of each part of the launch."""
