"""Still: what of a scene's facets stays as it is while some bodies move, made once for all instants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.tables import Facets
from raychan.world.body import Body
from raychan.world.sheet import Sheet

Bools = NDArray[np.bool_]
T = TypeVar("T")
Arrays = tuple[NDArray[Any], ...]

MANY = 30_000  # facets that stand still from which on they are kept


class Still:
    """The rows of facets of bodies that stand still. What is kept is the same whichever instant was asked for first."""

    def __init__(self, moving: Bools, count: NDArray[np.int64]) -> None:
        self.moving = np.flatnonzero(moving)
        at = np.concatenate([[0], np.cumsum(count)])
        pieces = [np.arange(at[b], at[b + 1], dtype=np.int32) for b in self.moving]
        # The facets that move, and those that do not.
        self.rows = np.concatenate([np.zeros(0, np.int32), *pieces])
        rest = np.ones(at[-1], bool)
        rest[self.rows] = False
        self.rest = np.flatnonzero(rest).astype(np.int32)
        self.facets: Facets | None = None
        self._kept: dict[str, Any] = {}
        self._sheets: dict[str, tuple[Sheet, ...]] = {}

    @staticmethod
    def of(bodies: Sequence[Body]) -> Still | None:
        """Return what to keep for bodies; None where that does not pay."""
        moving = np.array([b.moves for b in bodies], bool)
        if not moving.any():
            return None
        count = np.array([len(b.geometry.faces) for b in bodies], np.int64)
        return Still(moving, count) if count[~moving].sum() >= MANY else None

    def once(self, name: str, make: Callable[[], T]) -> T:
        """Return what `make` finds, which is the same wherever bodies stand; made once."""
        if name not in self._kept:
            self._kept[name] = make()
        found: T = self._kept[name]
        return found

    def columns(self, name: str, make: Callable[[Any], Arrays]) -> Arrays:
        """Return columns (n, ...) that `make` finds for rows of facets, each by itself: for all the first time, later
        only for those that move."""
        if name not in self._sheets:
            return self.keep(name, make(slice(None)))
        return self.copies(name, make(self.rows))

    def keep(self, name: str, columns: Arrays) -> Arrays:
        """Keep columns (n, ...) of all facets; return them, shared with what is kept."""
        self._sheets[name] = tuple(Sheet(x) for x in columns)
        return tuple(s.copy() for s in self._sheets[name])

    def copies(self, name: str, parts: Arrays) -> Arrays:
        """Return columns that are kept, with other rows for the facets that move."""
        out = tuple(s.copy() for s in self._sheets[name])
        for column, part in zip(out, parts, strict=True):
            column[self.rows] = part
        return out


def once(still: Still | None, name: str, make: Callable[[], T]) -> T:
    """Return what `make` finds, or found before where something is kept."""
    return make() if still is None else still.once(name, make)


def columns(still: Still | None, name: str, make: Callable[[Any], Arrays]) -> Arrays:
    """Return the columns that `make` finds for rows of facets, or those kept with the rows of what moves made anew."""
    return make(slice(None)) if still is None else still.columns(name, make)
