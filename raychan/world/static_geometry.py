"""Still: what of a scene's facets stays as it is while some bodies move, made once for all instants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.world.body import Body
from raychan.world.mesh import Mesh
from raychan.world.shared_rows import SharedRows

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
T = TypeVar("T")
Arrays = tuple[NDArray[Any], ...]

MANY = 200_000  # facets from which on they are kept


@dataclass(frozen=True)
class Instance:
    """A body of many facets that moves: its number, its rows of facets (n,), its mesh, and where that stands: turn
    (3, 3) from body to world axes, origin (3,) [m]."""

    body: int
    rows: NDArray[np.int32]
    mesh: Mesh
    turn: Floats
    origin: Floats


class StaticGeometry:
    """What is kept of bodies through all instants, and `rigid` those of many facets that move. What is kept is the same
    whichever instant was asked for first."""

    def __init__(self, moving: Bools, count: NDArray[np.int64]) -> None:
        self.moving = np.flatnonzero(moving)
        at = np.concatenate([[0], np.cumsum(count)])
        self._rows = {int(b): np.arange(at[b], at[b + 1], dtype=np.int32) for b in self.moving}
        # The facets that move, of these those of small bodies, and the facets that do not.
        self.rows = np.concatenate([np.zeros(0, np.int32), *self._rows.values()])
        self.few = np.flatnonzero(moving & (count < MANY))
        self.few_rows = np.concatenate([np.zeros(0, np.int32), *(self._rows[int(b)] for b in self.few)])
        rest = np.ones(at[-1], bool)
        rest[self.rows] = False
        self.rest = np.flatnonzero(rest).astype(np.int32)
        # Whether rows are kept: where most facets move, all are as soon made anew.
        self.shares = len(self.rest) > len(self.rows)
        self.rigid: tuple[Instance, ...] = ()
        self._kept: dict[str, Any] = {}
        self._sheets: dict[str, tuple[SharedRows, ...]] = {}

    @staticmethod
    def of(bodies: Sequence[Body]) -> StaticGeometry | None:
        """Return what to keep for bodies; None where that does not pay."""
        moving = np.array([b.moves for b in bodies], bool)
        if not moving.any():
            return None
        count = np.array([len(b.geometry.faces) for b in bodies], np.int64)
        pays = count[~moving].sum() >= MANY or (count[moving] >= MANY).any()
        return StaticGeometry(moving, count) if pays else None

    def at(self, bodies: Sequence[Body]) -> StaticGeometry:
        """Return the same with bodies where they stand now."""
        now = copy(self)
        large = [(int(b), bodies[b]) for b in np.setdiff1d(self.moving, self.few)]
        now.rigid = tuple(
            Instance(i, self._rows[i], b.geometry, b.motion.rotation(), b.motion.origin()) for i, b in large
        )
        return now

    def lasting(self, name: str, make: Callable[[], T]) -> T:
        """Return what `make` finds, which is the same wherever bodies stand; made once."""
        if name not in self._kept:
            self._kept[name] = make()
        found: T = self._kept[name]
        return found

    def columns(self, name: str, make: Callable[[Any], Arrays]) -> Arrays:
        """Return columns (n, ...) that `make` finds for rows of facets, each by itself: for all the first time, later
        only for those that move."""
        if not self.shares:
            return make(slice(None))
        if name not in self._sheets:
            return self.keep(name, make(slice(None)))
        return self.copies(name, make(self.rows))

    def keep(self, name: str, columns: Arrays) -> Arrays:
        """Keep columns (n, ...) of all facets; return them, shared with what is kept."""
        self._sheets[name] = tuple(SharedRows(x) for x in columns)
        return tuple(s.copy() for s in self._sheets[name])

    def copies(self, name: str, parts: Arrays) -> Arrays:
        """Return columns that are kept, with other rows for the facets that move."""
        out = tuple(s.copy() for s in self._sheets[name])
        for column, part in zip(out, parts, strict=True):
            column[self.rows] = part
        return out


def lasting(still: StaticGeometry | None, name: str, make: Callable[[], T]) -> T:
    """Return what `make` finds, or found before where something is kept."""
    return make() if still is None else still.lasting(name, make)


def columns(still: StaticGeometry | None, name: str, make: Callable[[Any], Arrays]) -> Arrays:
    """Return the columns that `make` finds for rows of facets, or those kept with the rows of what moves made anew."""
    return make(slice(None)) if still is None else still.columns(name, make)
