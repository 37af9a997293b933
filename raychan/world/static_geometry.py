"""What does not change between instants while some bodies of a scene move: computed once and shared by all instants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.world.body import Body
from raychan.world.meshes.mesh import Mesh
from raychan.world.shared_rows import SharedRows

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
T = TypeVar("T")
Arrays = tuple[NDArray[Any], ...]

MANY = 200_000  # facets from which on sharing pays; not measured
FEW = 2_000
"""The same for a preview, whose frames cost little else: of the urban street (65,000 facets, of which 61,000 move) a
frame's geometry takes 15 ms instead of 75 (CPU; `make bench BENCH="--only preview"`)."""


@dataclass(frozen=True)
class Instance:
    """A large body that moves: its number, its rows of facets (n,), its mesh, and its pose: turn (3, 3) from body to
    world axes, origin (3,) [m]."""

    body: int
    rows: NDArray[np.int32]
    mesh: Mesh
    turn: Floats
    origin: Floats


class StaticGeometry:
    """What is kept of bodies through all instants, and the `instances`: large bodies that move, posed at one instant.
    What is kept does not depend on the instant that was asked for first."""

    def __init__(self, moving: Bools, count: NDArray[np.int64], many: int) -> None:
        self.moving = np.flatnonzero(moving)
        at = np.concatenate([[0], np.cumsum(count)])
        self._rows = {int(b): np.arange(at[b], at[b + 1], dtype=np.int32) for b in self.moving}
        # Rows of the facets that move, of those of small bodies, and of the facets that do not move.
        self.rows = np.concatenate([np.zeros(0, np.int32), *self._rows.values()])
        self.small = np.flatnonzero(moving & (count < many))
        self.small_rows = np.concatenate([np.zeros(0, np.int32), *(self._rows[int(b)] for b in self.small)])
        # First and last of the rows of neighbouring bodies that move, and where these begin among all that move.
        ends = np.flatnonzero(np.diff(self.rows) != 1) + 1
        begin, end = np.concatenate([[0], ends]), np.concatenate([ends, [len(self.rows)]])
        self._runs = [(int(self.rows[i]), int(i), int(j - i)) for i, j in zip(begin, end, strict=True) if j > i]
        rest = np.ones(at[-1], bool)
        rest[self.rows] = False
        self.rest = np.flatnonzero(rest).astype(np.int32)
        # Whether columns are kept: where most facets move, all are computed anew as fast.
        self.shares = len(self.rest) > len(self.rows)
        self.instances: tuple[Instance, ...] = ()
        self._kept: dict[str, Any] = {}
        self._columns: dict[str, tuple[SharedRows, ...]] = {}

    @staticmethod
    def of(bodies: Sequence[Body], few: bool = False) -> StaticGeometry | None:
        """Return what is to be kept of bodies; None where sharing does not pay, below MANY facets, or FEW."""
        many = FEW if few else MANY
        moving = np.array([b.moves for b in bodies], bool)
        if not moving.any():
            return None
        count = np.array([len(b.geometry.faces) for b in bodies], np.int64)
        pays = count[~moving].sum() >= many or (count[moving] >= many).any()
        return StaticGeometry(moving, count, many) if pays else None

    def at(self, bodies: Sequence[Body]) -> StaticGeometry:
        """Return the same with the large moving bodies at their present poses."""
        now = copy(self)
        large = [(int(b), bodies[b]) for b in np.setdiff1d(self.moving, self.small)]
        now.instances = tuple(
            Instance(i, self._rows[i], b.geometry, b.motion.rotation(), b.motion.origin()) for i, b in large
        )
        return now

    def computed_once(self, name: str, make: Callable[[], T]) -> T:
        """Return what `make` returns, which does not depend on poses; called once for each name."""
        if name not in self._kept:
            self._kept[name] = make()
        found: T = self._kept[name]
        return found

    def columns(self, name: str, make: Callable[[Any], Arrays]) -> Arrays:
        """Return columns (n, ...) that `make` computes row by row: for all facets the first time, later only for those
        that move."""
        if not self.shares:
            return make(slice(None))
        if name not in self._columns:
            return self.keep(name, make(slice(None)))
        return self.copies(name, make(self.rows))

    def keep(self, name: str, columns: Arrays) -> Arrays:
        """Keep columns (n, ...) of all facets; return copies that share their memory."""
        self._columns[name] = tuple(SharedRows(x) for x in columns)
        return tuple(s.copy() for s in self._columns[name])

    def copies(self, name: str, parts: Arrays) -> Arrays:
        """Return copies of the columns that are kept, with new rows for the facets that move."""
        out = tuple(s.copy() for s in self._columns[name])
        for column, part in zip(out, parts, strict=True):
            for row, first, count in self._runs:
                column[row : row + count] = part[first : first + count]
        return out


def computed_once(static: StaticGeometry | None, name: str, make: Callable[[], T]) -> T:
    """Return what `make` returns, called once for each name if there is something to keep it in."""
    return make() if static is None else static.computed_once(name, make)


def columns(static: StaticGeometry | None, name: str, make: Callable[[Any], Arrays]) -> Arrays:
    """Return the columns that `make` computes for rows of facets, or kept ones with new rows for what moves."""
    return make(slice(None)) if static is None else static.columns(name, make)
