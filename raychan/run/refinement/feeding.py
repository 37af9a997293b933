"""Which sources of tubes feed map cells, by the paths of a first launch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_tasks
from raychan.run.explanation.point_spread import PointSpread
from raychan.run.refinement.map_cells import MapCells, feeding_sources
from raychan.run.refinement.source_changes import class_of
from raychan.run.refinement.sourced_paths import SourcedPaths
from raychan.tracing.sources import EXACT, Sources

Complexes = NDArray[np.complexfloating]


def feeding(held: SourcedPaths, response: PointSpread, cells: MapCells) -> Sources:
    """Return the sources that feed cells, and note what all tubes bring, and the deep ones that are left."""
    own, sums = held.by_source(response, cells.place)
    deep, allowed, found = class_of(own) == 1, cells.allowed, np.zeros(len(own), bool)
    tubes = int(np.searchsorted(own, EXACT, side="right"))  # from there on, for exact routes have the least number

    def one(i: int, x: Complexes) -> None:
        feeding = feeding_sources(own, x, float(allowed[i]))
        cells.left[i] = x[deep & ~feeding].sum()
        weak = ~deep & ~feeding & (own != EXACT) & (x != 0.0)
        cells.weak(i, own[weak], x[weak])
        # Not by BLAS, whose sums depend on how many threads it takes.
        cells.tubes[i] = math.sqrt((np.abs(x[tubes:]) ** 2).sum())
        found[feeding] = True

    each(sums, one)
    return own[found]


def each(sums: Iterator[Complexes], work: Callable[[int, Complexes], None]) -> None:
    """Call `work` with the number of each level and its sums (s,), by all threads."""
    first = 0
    for part in sums:
        parallel_tasks(len(part), lambda j, first=first, part=part: work(first + j, part[j]))  # type: ignore[misc]
        first += len(part)
