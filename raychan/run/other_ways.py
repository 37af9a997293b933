"""Routes the other way round: a wave over several surfaces goes both ways alike, but a coarse launch may lose one of
them, where its tube starts on a surface that is partly hidden."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import DiffractedRoutes, Routes
from raychan.tracing.solver import Launch
from raychan.tracing.sources import EXACT, Sources, depth_of, held_in

Facets = NDArray[np.int32]


def last_facets(batch: Routes | DiffractedRoutes) -> Facets:
    """Return the facet (n,) on which each route of tubes scatters, -1 for others."""
    if isinstance(batch, DiffractedRoutes):
        return np.full(len(batch.kind), -1, np.int32)
    rows = np.arange(len(batch.scatter))
    return np.where(batch.scatter >= 0, batch.facet[rows, batch.scatter], np.int32(-1))


class OtherWays:
    """The sources of deep routes of launches, and those of the same routes the other way round."""

    def __init__(self, launch: Launch) -> None:
        self._launch = launch
        self._found: list[tuple[Sources, Sources]] = []
        self._told = np.zeros(0, np.int64)

    def add(self, source: Sources, last: Facets) -> None:
        """Note routes of sources (n,) that scatter on facets `last` (n,)."""
        deep = np.flatnonzero((source != EXACT) & (depth_of(source) > 1))
        source, last = source[deep], last[deep]
        # Neighbours are mostly alike: one of each run is kept.
        heads = np.flatnonzero((np.diff(source, prepend=-1) != 0) | (np.diff(last, prepend=-1) != 0))
        source, last = source[heads], last[heads]
        self._found.append((source, self._launch.turned_round(source, last)))

    def missing(self, wanted: Sources) -> Sources:
        """Return the sources, of no route, of the routes of some sources (s,), in order, the other way round; each is
        returned once."""
        own, turned = (np.concatenate(x) for x in zip(*self._found, strict=True))
        new = np.unique(turned[held_in(wanted, own)])
        new = new[~held_in(np.union1d(own, self._told), new)]
        self._told = np.union1d(self._told, new)
        return new
