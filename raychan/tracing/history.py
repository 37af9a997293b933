"""The interactions that tubes of one launch met so far: a table in which each row points to the one before it."""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_FIRST = 1000  # rows; they double when full


class History:
    """Rows of vertices that tubes share with the tubes they were cut from, so that subdividing copies none of them.

    Several threads may append: each reads the rows of its own tubes only.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._used = 0
        self._place = np.empty((_FIRST, 3))
        self._normal = np.empty((_FIRST, 3))
        self._facet = np.empty(_FIRST, np.int32)
        self._kind = np.empty(_FIRST, np.int8)
        self._before = np.empty(_FIRST, np.int32)

    def append(self, last: Ints, vertex: Floats, normal: Floats, facet: Ints, kind: int) -> Ints:
        """Add a vertex after each of the rows `last` (n,), -1 for none; return the new rows (n,)."""
        with self._lock:
            begin, end = self._used, self._used + len(last)
            if end > len(self._facet):
                room = max(end, 2 * len(self._facet)) - len(self._facet)
                for name in ("_place", "_normal", "_facet", "_kind", "_before"):
                    held = getattr(self, name)
                    setattr(self, name, np.concatenate([held, np.empty((room, *held.shape[1:]), held.dtype)]))
            self._place[begin:end], self._normal[begin:end] = vertex, normal
            self._facet[begin:end], self._kind[begin:end], self._before[begin:end] = facet, kind, last
            self._used = end
            return np.arange(begin, end, dtype=np.int32)

    def newest(self, last: Ints, kind: int) -> Ints:
        """Return the facets (n,) of the newest vertices of a kind, from the rows `last` (n,) backwards; -1: none."""
        at, facet = last.copy(), np.full(len(last), -1, np.int32)
        while True:
            rows = np.flatnonzero((at >= 0) & (facet < 0))
            if not len(rows):
                return facet
            here = at[rows]
            facet[rows] = np.where(self._kind[here] == kind, self._facet[here], -1)
            at[rows] = self._before[here]

    @property
    def rows(self) -> tuple[Floats, Floats, Ints, NDArray[np.int8], Ints]:
        """Places and normals (h, 3), facets, kinds and the rows before (h,) of all vertices, for kernels."""
        return self._place, self._normal, self._facet, self._kind, self._before
