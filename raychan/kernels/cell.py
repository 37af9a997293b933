"""Cells: what each of many echoes brings to one cell of a range-Doppler map, and their sums."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from raychan.kernels.beat import wave
from raychan.kernels.jit import njit


@njit(cache=True, nogil=True, inline="always")
def _place(n, fine, cell):  # type: ignore[no-untyped-def]
    """Return the point of a table below `cell`, the share of the next one, and the sign."""
    period = math.floor(cell / n)
    at = (cell - period * n) * fine
    low = min(int(at), n * fine - 1)
    # One period on, a response counted from the middle of an even window has turned its sign.
    return low, at - low, 1.0 - 2.0 * ((int(period) * (n - 1)) & 1)


@njit(cache=True, nogil=True)
def periodic(table, n, fine, cells):  # type: ignore[no-untyped-def]
    """Return a window's response at `cells` (m,) cells from its peak, linear between `fine` points a cell.

    Args: table (n fine + 1,) one period of the response of n samples, its phase counted from their middle.
    """
    out = np.empty(len(cells), np.complex128)
    for i in range(len(cells)):
        low, share, sign = _place(n, fine, cells[i])
        out[i] = sign * (table[low] + share * (table[low + 1] - table[low]))
    return out


@njit(cache=True, parallel=True, error_model="numpy")
def cell_waves(amplitude, delay, rate, cell, ramp, sizes, across, along):  # type: ignore[no-untyped-def]
    """Return what echoes (n,) bring to a cell, and the ranges (n,) [m] at which they stand.

    Args: cell range [m] and rate [m/s]; ramp carrier, slope, time of the frame's middle, swept half [Hz], middle
    frequency [Hz], repetition, range resolution [m], speed of light; sizes samples, chirps, fine; across (., 2) the
    range response and its slope by cells; along (pieces, ., 2) the rate response of each piece of the frame and that
    of its chirps' numbers, counted from its middle chirp, and these middles (pieces,).
    """
    carrier, slope, centre, swept, middle, repetition, resolution, light = ramp
    samples, chirps, fine = sizes
    tables, middles = along
    waves, ranges = np.empty(delay.size, np.complex128), np.empty(delay.size)
    for i in prange(delay.size):
        then = delay[i] + 2.0 * rate[i] * centre / light
        ranges[i] = 0.5 * light * then
        cosine, sine = wave(carrier * (then - delay[i]) + swept * then - 0.5 * slope * then**2)
        off = rate[i] - cell[1]
        # Doppler is measured at the middle sample of the sweep.
        apart = 2.0 * middle / light * off * chirps * repetition
        # Each row of the map is freed of its own Doppler within the ramp, not of that of others.
        away = (ranges[i] - cell[0] + off * middle / slope) / resolution
        moved = rate[i] * repetition / resolution
        total = 0j
        low, share, sign = _place(chirps, fine, apart)
        for k in range(len(middles)):
            # Within a piece the range response runs along a straight line.
            at, part, turned = _place(samples, fine, away + moved * (middles[k] - 0.5 * (chirps - 1)))
            held = tables[k, low, 0] + share * (tables[k, low + 1, 0] - tables[k, low, 0])
            late = tables[k, low, 1] + share * (tables[k, low + 1, 1] - tables[k, low, 1])
            level = across[at, 0] + part * (across[at + 1, 0] - across[at, 0])
            lean = across[at, 1] + part * (across[at + 1, 1] - across[at, 1])
            total += turned * (level * held + moved * lean * late)
        total *= sign
        waves[i] = amplitude[i] * complex(cosine, sine) * total
    return waves, ranges


@njit(cache=True, nogil=True)
def cell_sums(group, count, waves, ranges, rates):  # type: ignore[no-untyped-def]
    """Return sums of waves (g,), sizes (4, g): how many, their |wave|, and that times range and rate, and which is the
    strongest (g,) of each group, -1 if there is none.

    Args: group (n,) of each echo, below `count`.
    """
    total, size = np.zeros(count, np.complex128), np.zeros((4, count))
    strongest, most = np.full(count, -1), np.full(count, -1.0)
    for i in range(group.size):
        g, weight = group[i], math.sqrt(waves[i].real ** 2 + waves[i].imag ** 2)
        total[g] += waves[i]
        size[0, g] += 1.0
        size[1, g] += weight
        size[2, g] += weight * ranges[i]
        size[3, g] += weight * rates[i]
        if weight > most[g]:
            strongest[g], most[g] = i, weight
    return total, size, strongest
