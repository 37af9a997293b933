"""Kernels of a non-uniform FFT: sources at any frequency are spread onto a regular grid, and values between the cells
of a transform are interpolated, both with a Kaiser-Bessel kernel `width` cells wide.

Sources: Jackson et al., IEEE Trans. Med. Imaging 10(3), 1991; Beatty, Nishimura, Pauly, IEEE Trans. Med. Imaging 24(6),
2005 (the kernel and its shape); Barnett, Magland, af Klinteberg, SIAM J. Sci. Comput. 41(5), 2019 (the kernel as
piecewise polynomials).
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
"""Oversampling: grid cells per cell that is used. At 2 a kernel of 8 cells errs by 2e-7, one of 16 by 1e-14."""
_ROWS = 64  # chirps that are interpolated at a time: their spectra stay in the cache (other sizes not measured)
_SHAPE = 0.99  # of the shape at which the kernel's transform reaches zero where the first alias begins


def kernel_transform(width: int, frequency: Floats) -> Floats:
    """Return the kernel's Fourier transform at frequencies [cycles per grid cell], up to 1 / (2 OVER)."""
    shape = _shape(width)
    root = np.sqrt(shape**2 - (np.pi * width * frequency) ** 2)
    return np.asarray(width * np.sinh(root) / (root * i0(shape)))


def kernel_polynomials(width: int) -> Floats:
    """Return coefficients (d, width), highest power first, of the kernel: a polynomial a cell, each over -1 to 1."""

    def kernel(x: Floats) -> Floats:
        at = (x + 1.0 + 2.0 * np.arange(width)) / width - 1.0
        return np.asarray(i0(_shape(width) * np.sqrt(1.0 - at * at)) / i0(_shape(width)))

    return _fitted(kernel, width // 2 + 4)


def deconvolution_polynomial(width: int) -> Floats:
    """Return coefficients (d,), highest power first, of 1 / `kernel_transform` as a polynomial of the squared
    frequency, scaled so that 0 to its largest value become -1 to 1."""
    return _fitted(lambda x: 1.0 / kernel_transform(width, np.sqrt(0.5 * (x + 1.0)) / (2.0 * OVER)), width // 2 + 6)[
        :, 0
    ]


def _fitted(function: Callable[[Floats], Floats], degree: int) -> Floats:
    """Return coefficients (degree + 1, f), highest power first, of the polynomials over -1 to 1 that interpolate f
    functions at Chebyshev points; `function` takes a column of points and returns (x, f)."""
    knots = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    return np.ascontiguousarray(np.linalg.solve(np.vander(knots), function(knots[:, None])))


def _shape(width: int) -> float:
    """Return the shape parameter of the Kaiser-Bessel kernel (Beatty et al. 2005, eq. 5, for wide kernels)."""
    return _SHAPE * math.pi * width * (1.0 - 0.5 / OVER)


@njit(cache=True, nogil=True, fastmath=True)
def spread(grid, flat, x, y, strengths, polynomials):  # type: ignore[no-untyped-def]
    """Add sources to a grid (p, rows, columns), each over as many cells as the kernel is wide.

    Args: flat, the grid's real and imaginary parts in one row; x (n,) rows and y (n,) columns of the sources, at least
    half a kernel from the edge; strengths (n, p); polynomials of the kernel, whose width is a multiple of 8. All but
    the places are of one precision.
    """
    planes, rows, columns = grid.shape
    width = polynomials.shape[1]
    over, along, part = np.empty(width, flat.dtype), np.empty(width, flat.dtype), np.empty(2 * width, flat.dtype)
    at = np.empty(2, flat.dtype)
    for i in range(x.size):
        row, column = math.ceil(x[i] - 0.5 * width), math.ceil(y[i] - 0.5 * width)
        at[0], at[1] = 2.0 * (row - x[i]) + width - 1.0, 2.0 * (column - y[i]) + width - 1.0
        at_x, at_y = at[0], at[1]
        for j in range(width):
            over[j] = along[j] = polynomials[0, j]
        for d in range(1, len(polynomials)):
            coefficients = polynomials[d]
            for j in range(width):
                over[j] = over[j] * at_x + coefficients[j]
                along[j] = along[j] * at_y + coefficients[j]
        for p in range(planes):
            re, im = strengths[i, p].real, strengths[i, p].imag
            for j in range(width):
                part[2 * j], part[2 * j + 1] = along[j] * re, along[j] * im
            start = 2 * ((p * rows + int(row)) * columns + int(column))
            for k in range(width):
                _add_row(flat, start, part, over[k], width)
                start += 2 * columns


@njit(cache=True, nogil=True, fastmath=True, forceinline=True)
def _add_row(flat, start, part, weight, width):  # type: ignore[no-untyped-def]
    """Add weight times one row of a source's kernel to the grid, from number `start` of its row of numbers on."""
    # Slices whose length the compiler knows: no test of each index, and the inner loop is unrolled.
    for b in range(0, 2 * width, 16):
        cells, some = flat[start + b : start + b + 16], part[b : b + 16]
        for j in range(16):
            cells[j] += weight * some[j]


def rows_under(x: Floats, width: int) -> tuple[int, int]:
    """Return the first row that `spread` writes to, and their number, for sources at rows x (n,) of at least half the
    kernel's width.

    The last row follows from the first one of the last source, as `spread` counts: x + width / 2 may round down.
    """
    first = math.ceil(x.min() - 0.5 * width)
    return first, math.ceil(x.max() - 0.5 * width) + width - first


@njit(cache=True, nogil=True, fastmath=True)
def wrap_margins(grid, margin):  # type: ignore[no-untyped-def]
    """Add the margins of a periodic grid (p, rows, columns) to the columns at its other end that they stand for."""
    planes, rows, columns = grid.shape
    period = columns - 2 * margin
    for p in range(planes):
        for r in range(rows):
            for c in range(margin):
                grid[p, r, c + period] += grid[p, r, c]
                grid[p, r, c + margin] += grid[p, r, c + margin + period]


@njit(cache=True, nogil=True, fastmath=True)
def add_transposed(out, rows, first, column, over, along):  # type: ignore[no-untyped-def]
    """Add rows (p, r, c) to out (p, s, l) with rows and columns exchanged; row r goes to (first + r) modulo l.

    Args: column, the one that s = 0 takes, columns being periodic; over (r,) and along (s,) factors.
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
def kernel_weights(first, weight, place, polynomials):  # type: ignore[no-untyped-def]
    """Write for places (m, s) the first of the cells under the kernel, and its values (m, s, width) there."""
    width = polynomials.shape[1]
    value = np.empty(width)
    for m in range(place.shape[0]):
        for s in range(place.shape[1]):
            start = math.ceil(place[m, s] - 0.5 * width)
            at = 2.0 * (start - place[m, s]) + width - 1.0
            for j in range(width):
                value[j] = polynomials[0, j]
            for d in range(1, len(polynomials)):
                coefficients = polynomials[d]
                for j in range(width):
                    value[j] = value[j] * at + coefficients[j]
            first[m, s] = start
            for j in range(width):
                weight[m, s, j] = value[j]


@njit(cache=True, nogil=True, fastmath=True)
def interpolate(out, spectra, first, weight, factor):  # type: ignore[no-untyped-def]
    """Add to out (m, s) the spectra (p, s, l) interpolated by `kernel_weights`, times factors (p, m, s)."""
    planes, steps = spectra.shape[:2]
    width = weight.shape[2]
    # In blocks of chirps, so that what neighbouring samples share of a long frame is still in the cache.
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
def counting_sort(box, count):  # type: ignore[no-untyped-def]
    """Return the order (n,) that sorts whole numbers (n,) below `count`, equal ones in the order given, and how many
    are equal at most."""
    start = np.zeros(count + 1, np.int64)
    for i in range(box.size):
        start[box[i] + 1] += 1
    most = 0
    for b in range(count):
        most = max(most, start[b + 1])
        start[b + 1] += start[b]
    order = np.empty(box.size, np.int64)
    for i in range(box.size):
        order[start[box[i]]] = i
        start[box[i]] += 1
    return order, most
