"""Edge grid: edges in a grid of cubes, packed so that those that lie together are read together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit

Floats = NDArray[np.float64]


_CROWD = 0.05  # of the edges on either side, which are not counted to where most are
_ROOM = 2.0  # widths of where most edges are, that a grid reaches beyond it
_SPREAD = 50.0  # times the width of such a grid that edges spread before it is used


def most_within(middle: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, bool]:
    """Return the bounds of a grid for edges of these middles (n, 3) and bounds low, high (3,), and whether it is cut
    off where few edges are: a spike of a kilometre must not leave a body of a metre in one cell.

    What is beyond such a grid belongs to its outermost cells.
    """
    if len(middle) == 0:
        return low, high, False
    first, last = np.quantile(middle, (_CROWD, 1.0 - _CROWD), axis=0)
    width = float((last - first).max())
    if not 0.0 < (1.0 + 2.0 * _ROOM) * width * _SPREAD < float((high - low).max()):
        return low, high, False
    return np.maximum(low, first - _ROOM * width), np.minimum(high, last + _ROOM * width), True


@njit(cache=True, inline="always")
def _held(at, count):  # type: ignore[no-untyped-def]
    """Return the number of a cell, the outermost for what is beyond."""
    return int(min(max(at, 0.0), count - 1.0))


@njit(cache=True)
def starts_again(first):  # type: ignore[no-untyped-def]
    """Put the starts of each cell's entries back in place after filling has moved each to its end."""
    for at in range(len(first) - 1, 0, -1):
        first[at] = first[at - 1]
    first[0] = 0


@njit(cache=True, nogil=True)
def fill_grid(ends, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return the edges in each cell as (first, index): edges are walked in steps of half a cell."""
    total = shape[0] * shape[1] * shape[2]
    first = np.zeros(total + 1, np.int32)
    index = np.zeros(0, np.int32)
    for fill in range(2):
        for e in range(len(ends)):
            a, b = ends[e, 0], ends[e, 1]
            size = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
            steps = int(2.0 * size / cell) + 1
            last = -1
            for s in range(steps + 1):
                t = s / steps
                i = _held((a[0] + t * (b[0] - a[0]) - low[0]) / cell, shape[0])
                j = _held((a[1] + t * (b[1] - a[1]) - low[1]) / cell, shape[1])
                k = _held((a[2] + t * (b[2] - a[2]) - low[2]) / cell, shape[2])
                at = (i * shape[1] + j) * shape[2] + k
                if at == last:
                    continue
                last = at
                if fill == 0:
                    first[at + 1] += 1
                else:
                    index[first[at]] = e
                    first[at] += 1
        if fill == 0:
            for at in range(total):
                first[at + 1] += first[at]
            index = np.empty(first[total], np.int32)
    starts_again(first)
    return first, index


@njit(cache=True, nogil=True)
def packed(index, ends, faces, normal):  # type: ignore[no-untyped-def]
    """Return both ends (e, 2, 3) of edges and the planes (normal, offset) of their faces (e, 2, 4), opposite ones at a
    rim, in the order in which the cells hold them: neighbours lie together. Renumbers `index` so."""
    n, count = len(ends), 0
    number, out, planes = np.full(n, -1, np.int32), np.empty((n, 2, 3)), np.empty((n, 2, 4))
    for at in range(len(index)):
        e = index[at]
        if number[e] < 0:
            number[e] = count
            for f in range(2):
                g = faces[e, f]
                offset = 0.0
                for c in range(3):
                    out[count, f, c] = ends[e, f, c]
                    planes[count, f, c] = normal[g, c] if g >= 0 else -normal[faces[e, 0], c]
                    offset += planes[count, f, c] * ends[e, 0, c]
                planes[count, f, 3] = offset
            count += 1
        index[at] = number[e]
    return out, planes
