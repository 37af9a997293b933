"""Edges of facets, and connected pieces, by compiled code where there are so many that it pays to load it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from raychan.geometry.grouping import connected, equal_rows

Ints = NDArray[np.signedinteger[Any]]

_MANY = (
    60_000  # rows: half edges of 20,000 facets, from which on a mesh is simplified; fewer cost little (not measured)
)


def edges(vertex: Ints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the order that sorts the half edges 3 f + k of faces vertex (f, 3) by their ends, and the number of the
    edge of each half edge in that order."""
    end = np.roll(vertex, -1, axis=1)
    return grouped(np.minimum(vertex, end).ravel(), np.maximum(vertex, end).ravel())


def grouped(*columns: Ints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the stable order (n,) that sorts rows of numbers from 0 on by their columns (n,), the first one first, and
    the number of the run of equal rows to which each row in that order belongs."""
    n = len(columns[0])
    if not n:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    if n >= _MANY:
        table = np.array(columns, np.int32)
        return equal_rows(table, int(table.max()) + 1)  # type: ignore[no-any-return]
    order = np.lexsort(columns[::-1])
    new = np.zeros(n - 1, bool)
    for column in columns:
        new |= np.diff(column[order]) != 0
    return order, np.concatenate([[0], np.cumsum(new)])


def pieces(one: Ints, other: Ints, n: int) -> NDArray[np.int64]:
    """Return the number (n,) of the connected piece of each of n nodes with links one (e,) to other (e,), pieces in the
    order of their first nodes."""
    if n >= _MANY:
        return connected(*(np.ascontiguousarray(x, np.int64) for x in (one, other)), n)  # type: ignore[no-any-return]
    graph = coo_matrix((np.ones(len(one), np.int8), (one, other)), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)
