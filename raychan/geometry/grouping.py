"""Equal rows of whole numbers, and connected pieces, in time linear in their number (numba kernels)."""

from __future__ import annotations

import numpy as np

from raychan.compile.jit import njit


@njit(cache=True, nogil=True)
def equal_rows(columns, count):  # type: ignore[no-untyped-def]
    """Return the stable order (n,) that sorts rows by the first column, among equals by the next, and so on, and the
    number (n,) of the run of equal rows to which each row in that order belongs.

    Args: columns (k, n) from 0 to count - 1.
    """
    n, last = columns.shape[1], len(columns) - 1
    order, other = np.arange(n), np.empty(n, np.int64)
    for i in range(last, -1, -1):
        at = np.zeros(count + 1, np.int64)
        for j in range(n):
            at[columns[i, j] + 1] += 1
        for j in range(count):
            at[j + 1] += at[j]
        for row in order:
            key = columns[i, row]
            other[at[key]] = row
            at[key] += 1
        order, other = other, order
    run = other
    for j in range(n):
        same = j > 0
        for i in range(last + 1):
            same = same and columns[i, order[j]] == columns[i, order[j - 1]]
        run[j] = 0 if j == 0 else run[j - 1] + (not same)
    return order, run


@njit(cache=True, nogil=True)
def connected(one, other, n):  # type: ignore[no-untyped-def]
    """Return the number (n,) of the connected piece of each of n nodes with links one (e,) to other (e,), pieces in the
    order of their first nodes."""
    root, out, count = np.arange(n), np.empty(n, np.int64), 0
    for e in range(len(one)):
        a, b = _root(root, one[e]), _root(root, other[e])
        root[max(a, b)] = min(a, b)
    for i in range(n):
        a = _root(root, i)
        if a == i:
            out[i] = count
            count += 1
        else:
            out[i] = out[a]
    return out


@njit(cache=True, forceinline=True)
def _root(root, i):  # type: ignore[no-untyped-def]
    """Return the first node of those known to be connected with node i; halves the path there."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i
