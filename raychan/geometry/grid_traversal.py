"""Cells: which cells of a grid a tube passes between its mirror and its landing (numba)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

BLOCK = 8  # cells a side that are passed over at once where they hold no edge
ALONG = 0.1  # cosine to the axis under which rays do
BESIDE = 0.25  # cells that a tube is taken to be wider: edges are in the cells that they pass within half of one


@njit(cache=True, forceinline=True)
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


@njit(cache=True, forceinline=True)
def span(points, ks, wide, spread, reach, ball, radius):  # type: ignore[no-untyped-def]
    """Return from where to where (to `reach`) a tube passes through the balls about bodies; equal: nowhere."""
    begin, end = np.inf, 0.0
    for j in range(len(ball)):
        along, apart = 0.0, 0.0
        for c in range(3):
            d = ball[j, c] - points[3, c]
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


@njit(cache=True, forceinline=True, error_model="numpy")
def layer(points, ks, axis, at, count, near, far_off, low, cell, shape, cut_off, begin, end):  # type: ignore[no-untyped-def]
    """Write the box of cells that a tube passes from `near` to `far_off` along its rays in `count` layers of cells
    across an axis, from layer `at` on; return how many there are in one layer."""
    floor, room, per = low[axis] + cell * (at - BESIDE), 1, 1.0 / cell
    for c in range(3):
        begin[c], end[c] = shape[c], 0
    for q in range(4):
        along, start, stop = ks[q, axis], near, far_off
        # A ray that runs along the layers counts whole.
        if abs(along) > ALONG:
            over = 1.0 / along
            one = (floor - points[q, axis]) * over
            other = one + (count + 2.0 * BESIDE) * cell * over
            # What is beyond a grid that is cut off belongs to its outermost layers.
            if cut_off and at <= 0:
                one = -math.copysign(np.inf, over)
            if cut_off and at + count >= shape[axis]:
                other = math.copysign(np.inf, over)
            start = min(max(min(one, other), near), far_off)
            stop = min(max(max(one, other), near), far_off)
        for c in range(3):
            x, y = points[q, c] + start * ks[q, c], points[q, c] + stop * ks[q, c]
            begin[c] = min(begin[c], max(int((min(x, y) - low[c]) * per - BESIDE), 0))
            end[c] = max(end[c], min(int((max(x, y) - low[c]) * per + BESIDE) + 1, shape[c]))
            if cut_off:
                begin[c], end[c] = min(begin[c], shape[c] - 1), max(end[c], 1)
    begin[axis], end[axis] = max(at, 0), min(at + count, shape[axis])
    for c in range(3):
        room *= max(end[c] - begin[c], 0) if c != axis else 1
    return room


@njit(cache=True, forceinline=True)
def layers(points, ks, axis, near, far_off, low, cell, shape, cut_off):  # type: ignore[no-untyped-def]
    """Return the first and the last layer across an axis that a tube passes."""
    least, most = np.inf, -np.inf
    for q in range(4):
        x, y = points[q, axis] + near * ks[q, axis], points[q, axis] + far_off * ks[q, axis]
        least, most = min(least, x, y), max(most, x, y)
    first = max(int((least - low[axis]) / cell - BESIDE), 0)
    last = min(int((most - low[axis]) / cell + BESIDE), shape[axis] - 1)
    return (min(first, shape[axis] - 1), max(last, 0)) if cut_off else (first, last)


@njit(cache=True, forceinline=True)
def crowded(crowd, begin, end):  # type: ignore[no-untyped-def]
    """Tell whether any block of a box of cells holds an edge."""
    for i in range(begin[0] // BLOCK, (end[0] + BLOCK - 1) // BLOCK):
        for j in range(begin[1] // BLOCK, (end[1] + BLOCK - 1) // BLOCK):
            for k in range(begin[2] // BLOCK, (end[2] + BLOCK - 1) // BLOCK):
                if crowd[i, j, k]:
                    return True
    return False
