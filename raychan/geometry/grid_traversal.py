"""Which cells of a grid of edges a tube passes, layer by layer across one axis (numba kernels)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

BLOCK = 8  # cells a side of a block, which is skipped as a whole where it holds no edge; not measured
ALONG = 0.1  # cosine to the axis under which a ray counts as running along the layers; not measured
BESIDE = 0.25  # cells that a tube is taken to be wider: edges are sampled every half cell, so they may cross one unseen


@njit(cache=True, forceinline=True, uncounted=True)
def widths(points, ks):  # type: ignore[no-untyped-def]
    """Return how far a tube's corners lie from its centre [m], and how far its rays spread for each metre."""
    wide, spread = 0.0, 0.0
    for q in range(3):
        a, b = 0.0, 0.0
        for c in range(3):
            a += (points[q, c] - points[3, c]) ** 2
            b += (ks[q, c] - ks[3, c]) ** 2
        wide, spread = max(wide, a), max(spread, b)
    wide, spread = np.sqrt(wide), np.sqrt(spread)
    return wide, spread


@njit(cache=True, forceinline=True, uncounted=True)
def span_through_spheres(points, ks, wide, spread, reach, centre, radius):  # type: ignore[no-untyped-def]
    """Return from where to where [m] (at most `reach`) a tube passes through the spheres about bodies, centre (b, 3)
    and radius (b,) [m]; equal: nowhere."""
    begin, end = np.inf, 0.0
    for j in range(len(centre)):
        along, apart = 0.0, 0.0
        for c in range(3):
            d = centre[j, c] - points[3, c]
            along += d * ks[3, c]
            apart += d * d
        size = radius[j] + wide + spread * max(along, 0.0)
        room = size * size - (apart - along * along)
        if room <= 0.0:
            continue
        half = np.sqrt(room)
        if along + half <= 0.0:
            continue
        begin, end = min(begin, max(along - half, 0.0)), max(end, along + half)
    end = min(end, reach)
    return (begin, end) if begin < end else (0.0, 0.0)


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def layer_cells(points, ks, axis, at, count, near, far_off, grid):  # type: ignore[no-untyped-def]
    """Return the box of cells, from (3,) and to (3,), that a tube passes from `near` to `far_off` [m] along its rays in
    `count` layers across an axis, from layer `at` on, and how many cells it has in one layer."""
    low, cell, shape, cut_off = grid.low, grid.cell, grid.shape, grid.cut_off
    floor, thick = low[axis] + cell * (at - BESIDE), (count + 2.0 * BESIDE) * cell
    least_x, least_y, least_z, most_x, most_y, most_z = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
    for q in range(4):
        along, start, stop = ks[q, axis], near, far_off
        # A ray that runs along the layers counts whole.
        if abs(along) > ALONG:
            over = 1.0 / along
            one = (floor - points[q, axis]) * over
            other = one + thick * over
            # What is beyond a grid that is cut off belongs to its outermost layers.
            if cut_off and at <= 0:
                one = -math.copysign(np.inf, over)
            if cut_off and at + count >= shape[axis]:
                other = math.copysign(np.inf, over)
            start = min(max(min(one, other), near), far_off)
            stop = min(max(max(one, other), near), far_off)
        x, y, z = points[q, 0] + start * ks[q, 0], points[q, 1] + start * ks[q, 1], points[q, 2] + start * ks[q, 2]
        u, v, w = points[q, 0] + stop * ks[q, 0], points[q, 1] + stop * ks[q, 1], points[q, 2] + stop * ks[q, 2]
        least_x, least_y, least_z = min(least_x, min(x, u)), min(least_y, min(y, v)), min(least_z, min(z, w))
        most_x, most_y, most_z = max(most_x, max(x, u)), max(most_y, max(y, v)), max(most_z, max(z, w))
    per = 1.0 / cell
    a, b = _cells_between(least_x, most_x, low[0], per, shape[0], cut_off)
    c, d = _cells_between(least_y, most_y, low[1], per, shape[1], cut_off)
    e, f = _cells_between(least_z, most_z, low[2], per, shape[2], cut_off)
    first, last = max(at, 0), min(at + count, shape[axis])
    if axis == 0:
        return (first, c, e), (last, d, f), max(d - c, 0) * max(f - e, 0)
    if axis == 1:
        return (a, first, e), (b, last, f), max(b - a, 0) * max(f - e, 0)
    return (a, c, first), (b, d, last), max(b - a, 0) * max(d - c, 0)


@njit(cache=True, forceinline=True, uncounted=True)
def _cells_between(least, most, low, per, count, cut_off):  # type: ignore[no-untyped-def]
    """Return from which to which of an axis' `count` cells `least` to `most` [m] reach."""
    begin = max(int((least - low) * per - BESIDE), 0)
    end = min(int((most - low) * per + BESIDE) + 1, count)
    return (min(begin, count - 1), max(end, 1)) if cut_off else (begin, end)


@njit(cache=True, forceinline=True, uncounted=True)
def layer_range(points, ks, axis, near, far_off, grid):  # type: ignore[no-untyped-def]
    """Return the first and the last layer across an axis that a tube passes from `near` to `far_off` [m]."""
    low, cell, shape, cut_off = grid.low, grid.cell, grid.shape, grid.cut_off
    least, most = np.inf, -np.inf
    for q in range(4):
        x, y = points[q, axis] + near * ks[q, axis], points[q, axis] + far_off * ks[q, axis]
        least, most = min(least, x, y), max(most, x, y)
    first = max(int((least - low[axis]) / cell - BESIDE), 0)
    last = min(int((most - low[axis]) / cell + BESIDE), shape[axis] - 1)
    return (min(first, shape[axis] - 1), max(last, 0)) if cut_off else (first, last)


@njit(cache=True, forceinline=True, uncounted=True)
def any_occupied(occupied, begin, end):  # type: ignore[no-untyped-def]
    """Tell whether any block of a box of cells holds an edge."""
    for i in range(begin[0] // BLOCK, (end[0] + BLOCK - 1) // BLOCK):
        for j in range(begin[1] // BLOCK, (end[1] + BLOCK - 1) // BLOCK):
            for k in range(begin[2] // BLOCK, (end[2] + BLOCK - 1) // BLOCK):
                if occupied[i, j, k]:
                    return True
    return False
