"""Which cells of a map are side lobes: those that no echo's main lobe reaches, as only a simulator knows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import Paths
from raychan.run.explanation.folding import Shown, ambiguities, waves_shown
from raychan.run.explanation.point_spread import PointSpread

Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

_LITTLE = 0.1  # of what all paths bring to a cell: less by main lobes makes it a side lobe (not measured)
SLACK = 0.25  # resolution cells by which a peak may be shifted, by noise or by other echoes (not measured)


@dataclass(frozen=True)
class Cell:
    """A cell to explain: its power, and the difference of two launches there, both [W]; what is seen there of each path
    (n,), and the range cells by which ranges differ over an array."""

    shown: Shown
    power: float
    error: float
    amplitude: Complexes
    spread: float = 0.0


def reaches(paths: Paths, rows: Ints, response: PointSpread, cell: Cell, power: float) -> bool:
    """Return whether the main lobes of some paths, rows of all, reach a cell of the map and bring more than a little.

    Args: power that all paths bring, over that transmitted."""
    return cell.shown.rate is None or from_main_lobes(paths, rows, response, cell) >= _LITTLE * power


def from_main_lobes(paths: Paths, rows: Ints, response: PointSpread, cell: Cell) -> float:
    """Return the power that those of some paths whose main lobes reach a cell bring there, over that transmitted."""
    total, reach = 0j, np.array(response.main_lobes) + SLACK + (0.5 * cell.spread, 0.0)
    for mirrored in (False, True) if response.mirrors else (False,):
        near = rows[ambiguities(paths, rows, response, cell.shown, mirrored, reach)[1]]
        wave = waves_shown(paths, near, cell.amplitude[near], response, cell.shown, mirrored).sum()
        total += wave.conjugate() if mirrored else wave
    return float(abs(total) ** 2)
