"""Cells of a map whose error a run leaves above the tolerance, and the lines that say so."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.run.map_cells import MapCells

Floats = NDArray[np.float64]

_NAMED = 3  # cells that a line names


@dataclass(frozen=True)
class Unreached:
    """A cell that a budget left above the tolerance: range [m], rate [m/s], and whether it is `deep` tubes, those that
    bounced, that change most."""

    range: float
    rate: float
    deep: bool

    @property
    def text(self) -> str:
        """Where the cell lies, and what changes there."""
        return f"{self.range:.2f} m, {self.rate:+.2f} m/s ({'tubes that bounced' if self.deep else 'first surfaces'})"


@dataclass(frozen=True)
class Remains:
    """How a refinement ended: the cells `unreached` after so many `steps`, and what `ended` it, '' where none is left;
    `speckled` cells were refined to their speckle only."""

    unreached: tuple[Unreached, ...]
    steps: int
    ended: str
    tolerance_db: float
    speckled: int = 0

    def notes(self, found: tuple[Floats, Floats], size: tuple[float, float]) -> list[str]:
        """Return a line on the cells that are speckle, one on the detections whose levels are not within the tolerance,
        and one on cells that may still become detections, with what ended the refinement.

        Args: found ranges and rates (n,) of the detections; size of a cell [m], [m/s].
        """
        said, tolerance = [], f"{self.tolerance_db:g} dB"
        if self.speckled:
            said.append(
                f"{self.speckled} cells of the map are speckle (model.speckle): displacing bodies by 0.05 deg and 1 mm "
                f"moves them by more than {tolerance}, and they are refined to that only"
            )
        ranges, rates = found
        detected = [
            bool(((np.abs(ranges - u.range) <= size[0]) & (np.abs(rates - u.rate) <= size[1])).any())
            for u in self.unreached
        ]
        how = f"refined {'once' if self.steps == 1 else f'{self.steps} times'}, ended by {self.ended}"
        for one, what in (
            (True, f"the level still changes by more than {tolerance} at"),
            (False, "where nothing is detected yet, what may still change makes a detection at"),
        ):
            some = [u.text for u, is_one in zip(self.unreached, detected, strict=True) if is_one == one]
            if some:
                more = f" and {len(some) - _NAMED} more" if len(some) > _NAMED else ""
                said.append(f"{how}: {what} {'; '.join(some[:_NAMED])}{more}")
        return said


def unreached_of(cells: MapCells) -> Iterator[Unreached]:
    """Give the cells that are still to be refined and may be wrong by more than is allowed: refinement aims at less."""
    beyond = cells.doubt > np.abs(cells.level) * cells.allowed
    change, last = cells.change, np.flatnonzero(cells.open & beyond)
    for i in last[np.unique(last % max(len(cells.place), 1), return_index=True)[1]]:
        (shallow, deep), place = change[i], cells.cell_of(i)
        yield Unreached(float(place[0]), float(place[1]), bool(deep > shallow))
