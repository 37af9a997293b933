"""Peaks that are side lobes of what is no peak: of an echo on the slope of a stronger one, in their row or column."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.processing.detector_map import DetectorMap
from raychan.processing.peaks import SideLobes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LineLobes:
    """The side-lobe test along the row and the column of a peak.

    An echo on the slope of a stronger one is no local maximum of the map, but its side lobes are, away from the
    stronger one's rate or range. It is a maximum of its own row or column.
    """

    seen: DetectorMap
    lobes: SideLobes
    pad: tuple[int, int]
    smear: Floats
    """(v, r) resolution cells over which a mover migrates, by cell"""

    def own(self, cell: Ints) -> bool:
        """Return whether a peak (2,) is more than the side lobes of what is stronger along its column and its row."""
        column, row = self.seen.lines(cell)
        v, r = map(int, cell)
        return self._own(column, v, 0, self.smear[:, r]) and self._own(row, r, 1, self.smear[v])

    def _own(self, line: Floats, at: int, axis: int, smear: Floats) -> bool:
        top = np.flatnonzero((line > line[at]) & (line >= np.roll(line, 1)) & (line >= np.roll(line, -1)))
        if not len(top):
            return True
        cells = np.append(top[np.argsort(-line[top], kind="stable")], at)
        place = np.zeros((len(cells), 2))
        place[:, axis] = cells / self.pad[axis]
        return bool(self.lobes.own(place, line[cells], smear[cells])[-1])
