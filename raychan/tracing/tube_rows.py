"""Rows of the columns of tubes (numba kernels)."""

from __future__ import annotations

import numpy as np

from raychan.compile.jit import njit
from raychan.tracing.tubes import TubeColumns
from raychan.vectors import copy_to


@njit(cache=True, nogil=True)
def rows_of(column, rows):  # type: ignore[no-untyped-def]
    """Return the rows (m,) of a column (n, ...)."""
    return _rows_of_both(column, rows, column, rows[:0])


@njit(cache=True, nogil=True)
def _rows_of_both(one, rows, other, more):  # type: ignore[no-untyped-def]
    """Return the rows (m,) of one column, then the rows `more` of another."""
    n, m = len(rows), len(more)
    out = np.empty((n + m, *one.shape[1:]), one.dtype)
    if n + m and out.size:
        width = out.size // (n + m)
        _copy_rows(one.ravel(), rows, width, out.ravel()[: n * width])
        _copy_rows(other.ravel(), more, width, out.ravel()[n * width :])
    return out


@njit(cache=True, nogil=True, uncounted=True)
def _copy_rows(column, rows, width, out):  # type: ignore[no-untyped-def]
    """Write the rows (m,) of a column, each `width` numbers."""
    for i in range(len(rows)):
        for j in range(width):
            out[i * width + j] = column[rows[i] * width + j]


@njit(cache=True, nogil=True)
def gathered(tubes, rows, others, more):  # type: ignore[no-untyped-def]
    """Return the columns of the tubes `rows` (m,), then those of the tubes `more` of others."""
    return TubeColumns(
        _rows_of_both(tubes.points, rows, others.points, more),
        _rows_of_both(tubes.k, rows, others.k, more),
        _rows_of_both(tubes.length, rows, others.length, more),
        _rows_of_both(tubes.normals, rows, others.normals, more),
        _rows_of_both(tubes.facet, rows, others.facet, more),
        _rows_of_both(tubes.spread, rows, others.spread, more),
        _rows_of_both(tubes.strength, rows, others.strength, more),
        _rows_of_both(tubes.flat, rows, others.flat, more),
        _rows_of_both(tubes.bary, rows, others.bary, more),
        _rows_of_both(tubes.slots, rows, others.slots, more),
        _rows_of_both(tubes.bounces, rows, others.bounces, more),
        _rows_of_both(tubes.caustics, rows, others.caustics, more),
        _rows_of_both(tubes.last, rows, others.last, more),
    )


@njit(cache=True, nogil=True)
def grown(column, count, size):  # type: ignore[no-untyped-def]
    """Return room for `size` rows of a column, with its first `count`."""
    out = np.empty((size, *column.shape[1:]), column.dtype)
    if count and out.size:
        copy_to(out.ravel()[: count * (out.size // size)], column.ravel()[: count * (out.size // size)])
    return out


@njit(cache=True, nogil=True)
def with_room(tubes, count, size):  # type: ignore[no-untyped-def]
    """Return room for the columns of `size` tubes, with the first `count`."""
    return TubeColumns(
        grown(tubes.points, count, size),
        grown(tubes.k, count, size),
        grown(tubes.length, count, size),
        grown(tubes.normals, count, size),
        grown(tubes.facet, count, size),
        grown(tubes.spread, count, size),
        grown(tubes.strength, count, size),
        grown(tubes.flat, count, size),
        grown(tubes.bary, count, size),
        grown(tubes.slots, count, size),
        grown(tubes.bounces, count, size),
        grown(tubes.caustics, count, size),
        grown(tubes.last, count, size),
    )
