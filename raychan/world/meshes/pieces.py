"""Edges of facets, and connected pieces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.grouping import connected, equal_rows

Ints = NDArray[np.signedinteger[Any]]


def edges(vertex: Ints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the order that sorts the half edges 3 f + k of faces vertex (f, 3) by their ends, and the number of the
    edge of each half edge in that order."""
    end = np.roll(vertex, -1, axis=1)
    return grouped(np.minimum(vertex, end).ravel(), np.maximum(vertex, end).ravel())


def grouped(*columns: Ints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the stable order (n,) that sorts rows of numbers from 0 on by their columns (n,), the first one first, and
    the number of the run of equal rows to which each row in that order belongs."""
    table = np.array(columns, np.int32)
    return equal_rows(table, int(table.max(initial=0)) + 1)  # type: ignore[no-any-return]


def pieces(one: Ints, other: Ints, n: int) -> NDArray[np.int64]:
    """Return the number (n,) of the connected piece of each of n nodes with links one (e,) to other (e,), pieces in the
    order of their first nodes."""
    return connected(*(np.ascontiguousarray(x, np.int64) for x in (one, other)), n)  # type: ignore[no-any-return]
