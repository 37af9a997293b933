"""Gridding: sources at any frequency onto a regular grid and back, by a Kaiser-Bessel kernel `width` cells wide.

Source: Jackson et al. 1991; Beatty, Nishimura & Pauly 2005 (the kernel and its shape); Barnett et al. 2019 (pieces of
polynomials).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0

from raychan.compile.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

OVER = 2.0
"""Grid cells per cell that is used: with it a kernel of 8 is good for 2e-7, one of 16 for 1e-14."""
_ROWS = 64  # chirps that are read at a time
_SHAPE = 0.99  # of the shape at which the kernel's transform reaches zero where the first alias begins


def transform(width: int, frequency: Floats) -> Floats:
    """Return the kernel's Fourier transform at frequencies [cycles per grid cell], up to 1 / (2 OVER)."""
    shape = _shape(width)
    root = np.sqrt(shape**2 - (np.pi * width * frequency) ** 2)
    return np.asarray(width * np.sinh(root) / (root * i0(shape)))


def kernel_pieces(width: int) -> Floats:
    """Return coefficients (d, width), highest power first, of the kernel's pieces, each over -1 to 1."""

    def kernel(x: Floats) -> Floats:
        at = (x + 1.0 + 2.0 * np.arange(width)) / width - 1.0
        return np.asarray(i0(_shape(width) * np.sqrt(1.0 - at * at)) / i0(_shape(width)))

    return _fitted(kernel, width // 2 + 4)


def target_factor(width: int) -> Floats:
    """Return coefficients (d,), highest power first, of 1 / `transform` over the square of its argument, the square
    going from 0 to its largest as -1 to 1."""
    return _fitted(lambda x: 1.0 / transform(width, np.sqrt(0.5 * (x + 1.0)) / (2.0 * OVER)), width // 2 + 6)[:, 0]


def _fitted(function: Callable[[Floats], Floats], degree: int) -> Floats:
    """Return coefficients (degree + 1, f), highest power first, of polynomials over -1 to 1 that follow functions
    (x, f) of a column of points."""
    knots = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    return np.ascontiguousarray(np.linalg.solve(np.vander(knots), function(knots[:, None])))


def _shape(width: int) -> float:
    return _SHAPE * math.pi * width * (1.0 - 0.5 / OVER)


@njit(cache=True, nogil=True, fastmath=True)
def spread(grid, flat, x, y, strengths, pieces):  # type: ignore[no-untyped-def]
    """Add sources to a grid (p, rows, columns), each over as many cells as the kernel is wide.

    Args: flat, the grid's real and imaginary parts in a row; x (n,) rows, y (n,) columns where they stand, at least
    half a kernel from the edge; strengths (n, p); pieces of the kernel, whose width is a multiple of 8. All of one
    precision, but for the places.
    """
    planes, rows, columns = grid.shape
    width = pieces.shape[1]
    over, along, part = np.empty(width, flat.dtype), np.empty(width, flat.dtype), np.empty(2 * width, flat.dtype)
    at = np.empty(2, flat.dtype)
    for i in range(x.size):
        row, column = math.ceil(x[i] - 0.5 * width), math.ceil(y[i] - 0.5 * width)
        at[0], at[1] = 2.0 * (row - x[i]) + width - 1.0, 2.0 * (column - y[i]) + width - 1.0
        at_x, at_y = at[0], at[1]
        for j in range(width):
            over[j] = along[j] = pieces[0, j]
        for d in range(1, len(pieces)):
            coefficients = pieces[d]
            for j in range(width):
                over[j] = over[j] * at_x + coefficients[j]
                along[j] = along[j] * at_y + coefficients[j]
        for p in range(planes):
            re, im = strengths[i, p].real, strengths[i, p].imag
            for j in range(width):
                part[2 * j], part[2 * j + 1] = along[j] * re, along[j] * im
            start = 2 * ((p * rows + int(row)) * columns + int(column))
            for k in range(width):
                weight = over[k]
                # Slices of a length known to the compiler: no test of each index, and the loop is laid out flat.
                for b in range(0, 2 * width, 16):
                    cells, some = flat[start + b : start + b + 16], part[b : b + 16]
                    for j in range(16):
                        cells[j] += weight * some[j]
                start += 2 * columns


@njit(cache=True, nogil=True, fastmath=True)
def fold(grid, margin):  # type: ignore[no-untyped-def]
    """Add the margins of a grid (p, rows, columns), which stand for its other end, to that."""
    planes, rows, columns = grid.shape
    period = columns - 2 * margin
    for p in range(planes):
        for r in range(rows):
            for c in range(margin):
                grid[p, r, c + period] += grid[p, r, c]
                grid[p, r, c + margin] += grid[p, r, c + margin + period]


@njit(cache=True, nogil=True, fastmath=True)
def exchange(out, rows, first, column, over, along):  # type: ignore[no-untyped-def]
    """Add rows (p, r, c) to out (p, s, l) with rows and columns exchanged, row r at (first + r) wrapped to l.

    Args: column, the one that s = 0 takes, wrapped; over (r,) and along (s,) factors.
    """
    planes, count, period = rows.shape
    length = out.shape[2]
    below = min(max(-first, 0), count)
    for p in range(planes):
        for low, high, to in ((0, below, first + length), (below, count, first)):
            for block in range(low, high, 8):
                end = min(block + 8, high)
                for s in range(len(along)):
                    c = column + s - (period if column + s >= period else 0)
                    line, some, factor = out[p, s, to + block : to + end], rows[p, block:end, c], over[block:end]
                    for r in range(end - block):
                        line[r] += some[r] * (factor[r] * along[s])


@njit(cache=True, nogil=True, fastmath=True)
def weigh(first, weight, place, pieces):  # type: ignore[no-untyped-def]
    """Write for places (m, s) the first of the cells under the kernel, and its values (m, s, width) there."""
    width = pieces.shape[1]
    value = np.empty(width)
    for m in range(place.shape[0]):
        for s in range(place.shape[1]):
            start = math.ceil(place[m, s] - 0.5 * width)
            at = 2.0 * (start - place[m, s]) + width - 1.0
            for j in range(width):
                value[j] = pieces[0, j]
            for d in range(1, len(pieces)):
                coefficients = pieces[d]
                for j in range(width):
                    value[j] = value[j] * at + coefficients[j]
            first[m, s] = start
            for j in range(width):
                weight[m, s, j] = value[j]


@njit(cache=True, nogil=True, fastmath=True)
def read(out, spectra, first, weight, factor):  # type: ignore[no-untyped-def]
    """Add to out (m, s) what spectra (p, s, l) hold under kernels (from `weigh`), times factors (p, m, s)."""
    planes, steps = spectra.shape[:2]
    width = weight.shape[2]
    # In blocks: what a column of a long frame steps over would otherwise come from memory again for each sample.
    for block in range(0, len(out), _ROWS):
        for s in range(steps):
            for m in range(block, min(block + _ROWS, len(out))):
                start, value = first[m, s], weight[m, s]
                total = 0j
                for p in range(planes):
                    some = spectra[p, s, start : start + width]
                    re, im = 0.0, 0.0
                    for j in range(width):
                        re += value[j] * some[j].real
                        im += value[j] * some[j].imag
                    total += complex(re, im) * factor[p, m, s]
                out[m, s] += total


@njit(cache=True, nogil=True)
def order_of(box, count):  # type: ignore[no-untyped-def]
    """Return the order (n,) that sorts whole numbers (n,) below `count`, equal ones as they come, and how many at most
    are equal."""
    start = np.zeros(count + 1, np.int64)
    for i in range(box.size):
        start[box[i] + 1] += 1
    most = start.max()
    for b in range(count):
        start[b + 1] += start[b]
    order = np.empty(box.size, np.int64)
    for i in range(box.size):
        order[start[box[i]]] = i
        start[box[i]] += 1
    return order, most
