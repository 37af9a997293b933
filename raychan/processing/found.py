"""What is found in a map: peaks, the echoes within them, and both with their places in map cells."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

BEFORE = 0.1
"""Map cells by which noise may move the peak of an echo at range 0 to before it (not measured)."""


@dataclass(frozen=True, eq=False)
class Found:
    """Peaks or echoes (n,) of a map."""

    cells: Ints
    """(n, 2) rate, range"""
    shift: Floats
    """(n, 2) map cells from the cell to the peak"""
    power: Floats
    """(n,) [W]"""
    noise: Floats
    """(n,) [W] of the cell or the beam that the peak is seen in"""

    def take(self, rows: Any) -> Self:
        """Return some rows."""
        return type(self)(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    @property
    def place(self) -> Floats:
        """Places (n, 2) in map cells."""
        return np.asarray(self.cells + self.shift)


@dataclass(frozen=True, eq=False)
class Peaks(Found):
    """Peaks of a map before their directions are known."""

    shown: Floats
    """(n,) [W] power in their cells, `power` is that between cells"""
    least: Floats
    """(n,) [W] power below which a beam is noise"""
    smear: Floats
    """(n,) resolution cells over which a mover migrates"""
    direction: Floats
    """Cosines (n, 2) of the beam that is strongest"""


@dataclass(frozen=True, eq=False)
class Echoes(Found):
    """Echoes with their directions."""

    direction: Floats
    """Cosines (n, 2) along y and z"""
    unsure: NDArray[np.bool_]
    """(n,) whether the direction may be that of a side lobe: waves in the cell were not told apart"""
    weights: Complexes
    """Beams (n, s * a) that the echoes are seen in, of what slots hold under their folds and at their rates, with nulls
    towards the others of their cells."""
    fold: Ints
    """(n,) by how many spans of rates they are folded in their cells."""


@dataclass(frozen=True, eq=False)
class Row:
    """One echo: as in `Echoes`, and the peak in whose cell it was found."""

    peak: int
    cell: Ints
    shift: Floats
    power: float
    noise: float
    direction: Floats
    misfit: float
    """Share of the power that is no plane wave: an echo that was not told apart from it, seen by all beams."""
    bent: float
    """The same of any echo there: its wave is curved, and elements see it at different ranges."""
    wave: Complexes
    """(t * a,) what the transmitters' channels hold of it, of unit amplitude."""
    unsure: bool
    weights: Complexes
    """(s * a,) of its beam, of what slots hold under its fold and at its rate, nulls towards others of the cell."""
    fold: int
    """By how many spans of rates it is folded in its cell."""
    shown: float
    """[W] power in its cell."""
    beside: bool
    """Whether it peaks a resolution cell or more from that peak."""
    crest: bool
    """Whether its beam shows no more in the map cells around that peak's."""
