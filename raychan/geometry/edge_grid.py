"""Edges of meshes in a grid of cubes, for tubes that search the edges along their way.

Edges are packed in the order of the cells, so that edges that lie together are read together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_OUTLIERS = 0.05  # share of the edges on either side that does not count for the bounds of most edges; not measured
_MARGIN = 2.0  # widths of most edges by which a grid that is cut off reaches beyond them; not measured
_CUT_OFF = 50.0  # times the width of such a grid by which edges must spread before it is used; not measured


class EdgeGrid(NamedTuple):
    """Edges in a grid of cubes.

    Fields: edges (e, 2, 3) [m] both ends; planes (e, 2, 4) normal and offset of both faces; edges entries[first[i] :
    first[i + 1]] pass cell i; low (3,) [m] corner, cell [m] side and shape (3,) of the grid; cut_off whether edges lie
    beyond it, which then belong to the outermost cells; occupied (x, y, z) blocks of cells that hold an edge.
    """

    edges: Floats
    planes: Floats
    first: Ints
    entries: Ints
    low: Floats
    cell: float
    shape: NDArray[np.int64]
    cut_off: bool
    occupied: NDArray[np.bool_]


def grid_bounds(middle: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, bool]:
    """Return the bounds of a grid for edges of these middles (n, 3) and bounds low, high (3,), and whether it is cut
    off where few edges are: a spike of a kilometre must not leave a body of a metre in one cell."""
    if len(middle) == 0:
        return low, high, False
    first, last = np.quantile(middle, (_OUTLIERS, 1.0 - _OUTLIERS), axis=0)
    width = float((last - first).max())
    if not 0.0 < (1.0 + 2.0 * _MARGIN) * width * _CUT_OFF < float((high - low).max()):
        return low, high, False
    return np.maximum(low, first - _MARGIN * width), np.minimum(high, last + _MARGIN * width), True


@njit(cache=True, inline="always")
def _cell_number(at, count):  # type: ignore[no-untyped-def]
    """Return the number of a cell along an axis, the outermost for what is beyond."""
    return int(min(max(at, 0.0), count - 1.0))


@njit(cache=True)
def restore_starts(first):  # type: ignore[no-untyped-def]
    """Set the start of each cell's entries again, after filling has moved each to its end."""
    for at in range(len(first) - 1, 0, -1):
        first[at] = first[at - 1]
    first[0] = 0


@njit(cache=True, nogil=True)
def fill_grid(ends, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return the edges in each cell as (first, index), see `EdgeGrid`: edges are sampled in steps of half a cell."""
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
                i = _cell_number((a[0] + t * (b[0] - a[0]) - low[0]) / cell, shape[0])
                j = _cell_number((a[1] + t * (b[1] - a[1]) - low[1]) / cell, shape[1])
                k = _cell_number((a[2] + t * (b[2] - a[2]) - low[2]) / cell, shape[2])
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
    restore_starts(first)
    return first, index


@njit(cache=True, nogil=True)
def pack_edges(index, ends, faces, normal):  # type: ignore[no-untyped-def]
    """Return both ends (e, 2, 3) [m] of edges and the planes (e, 2, 4) of their faces (normal, offset; opposite ones at
    a boundary edge), in the order in which the cells hold them; renumber `index` (k,) so."""
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
