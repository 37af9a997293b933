"""Edge grid: edges in a grid of cubes, packed so that those that lie together are read together."""

from __future__ import annotations

import numpy as np

from raychan.channel.edges import starts_again
from raychan.kernels.jit import njit


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
                i = int((a[0] + t * (b[0] - a[0]) - low[0]) / cell)
                j = int((a[1] + t * (b[1] - a[1]) - low[1]) / cell)
                k = int((a[2] + t * (b[2] - a[2]) - low[2]) / cell)
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
