"""Kernels of the point-spread function: contributions of many echoes to cells of a range-Doppler map, and their
sums."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.phasor import unit_phasor
from raychan.vectors import copy_to


@njit(cache=True, nogil=True, forceinline=True)
def _place(n, fine, cell):  # type: ignore[no-untyped-def]
    """Return the table index below `cell`, the weight of the next entry, and the sign."""
    period = math.floor(cell / n)
    at = (cell - period * n) * fine
    low = min(int(at), n * fine - 1)
    # One period on, the response of an even window, with its phase counted from the middle, changes sign.
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


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _stands(delay, rate, ramp):  # type: ignore[no-untyped-def]
    """Return the range [m] of an echo at mid frame, and its phasor there."""
    carrier, slope, centre, swept, _, _, _, light = ramp
    then = delay + 2.0 * rate * centre / light
    cosine, sine = unit_phasor(carrier * (then - delay) + swept * then - 0.5 * slope * then**2)
    return 0.5 * light * then, complex(cosine, sine)


@njit(cache=True, nogil=True, forceinline=True)
def _times(x, z):  # type: ignore[no-untyped-def]
    """Return the real number x times z: numba multiplies both as complex numbers, three times the work."""
    return complex(x * z.real, x * z.imag)


@njit(cache=True, nogil=True, forceinline=True)
def _between(a, b, share):  # type: ignore[no-untyped-def]
    """Return the complex number at a share of the way from a to b."""
    return a + _times(share, b - a)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _answer(at_range, rate, cell_range, cell_rate, ramp, sizes, across, along):  # type: ignore[no-untyped-def]
    """Return the response of both windows to an echo at a range [m] at mid frame."""
    _, slope, _, _, middle, repetition, resolution, light = ramp
    samples, chirps, fine = sizes
    tables, middles = along
    off = rate - cell_rate
    # Doppler is measured at the middle sample of the sweep.
    apart = 2.0 * middle / light * off * chirps * repetition
    # Each row of the map is corrected for its own Doppler within the ramp; other rates keep the difference.
    away = (at_range - cell_range + off * middle / slope) / resolution
    moved = rate * repetition / resolution
    total = 0j
    low, share, sign = _place(chirps, fine, apart)
    for k in range(len(middles)):
        # Within a part of the frame the range response is linear.
        at, part, turned = _place(samples, fine, away + moved * (middles[k] - 0.5 * (chirps - 1)))
        held = _between(tables[k, low, 0], tables[k, low + 1, 0], share)
        late = _between(tables[k, low, 1], tables[k, low + 1, 1], share)
        level = _between(across[at, 0], across[at + 1, 0], part)
        lean = _between(across[at, 1], across[at + 1, 1], part)
        total += _times(turned, level * held + _times(moved, lean) * late)
    return _times(sign, total)


@njit(cache=True, nogil=True, error_model="numpy")
def cell_waves(amplitude, delay, rate, cell, ramp, sizes, across, along):  # type: ignore[no-untyped-def]
    """Return the contributions (n,) of echoes to a cell, and their ranges (n,) [m] at mid frame.

    Args: cell range [m] and rate [m/s]; ramp carrier, slope, time of the frame's middle, swept half [Hz], middle
    frequency [Hz], repetition, range resolution [m], speed of light; sizes samples, chirps, fine; across (., 2) the
    range response and its derivative by cells; along (parts, ., 2) the rate response of each part of the frame with
    weights 1 and with weights of the chirp number from its middle, and these middles (parts,).
    """
    waves, ranges = np.empty(delay.size, np.complex128), np.empty(delay.size)
    for i in range(delay.size):
        ranges[i], turn = _stands(delay[i], rate[i], ramp)
        waves[i] = amplitude[i] * turn * _answer(ranges[i], rate[i], cell[0], cell[1], ramp, sizes, across, along)
    return waves, ranges


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _count(c, g, i, wave, at_range, rate, total, size, strongest, most):  # type: ignore[no-untyped-def]
    weight = wave.real * wave.real + wave.imag * wave.imag
    total[c, g] += wave
    size[c, 1, g] += weight
    size[c, 2, g] += weight * at_range
    size[c, 3, g] += weight * rate
    if weight > most[c, g]:
        strongest[c, g], most[c, g] = i, weight


@njit(cache=True, forceinline=True)
def _apart(cells, n):  # type: ignore[no-untyped-def]
    """Return the distance in cells from the nearest peak of a response of period n cells."""
    if cells > n:
        cells -= n * math.floor(cells / n)
    return min(cells, n - cells)


@njit(cache=True, nogil=True, error_model="numpy")
def sums_in_cells(  # type: ignore[no-untyped-def]
    group, amplitude, delay, rate, cells, least, beyond, total, size, strongest, most, ramp, sizes, across, along
):
    """Write the `cell_sums` (c, ...) of the contributions of echoes (n,) to several cells (c, 2), and the power `most`
    (c, g) of the strongest.

    Args: least (c,) contribution that counts; beyond (s,) and (2, m) upper bounds of the range and rate responses by
    cells from the peak; else as for `cell_waves` and `cell_sums`.
    """
    samples, chirps, _ = sizes
    _, slope, centre, _, middle, repetition, resolution, light = ramp
    over_ranges, over_rates = beyond
    per_rate = 2.0 * middle / light * chirps * repetition
    total[:], size[:], strongest[:], most[:] = 0.0, 0.0, -1, -1.0
    count = np.zeros(total.shape[1])
    for i in range(delay.size):
        count[group[i]] += 1.0
        at_range, moved = 0.5 * light * delay[i] + rate[i] * centre, abs(rate[i]) * repetition / resolution
        weight, largest, turn = abs(amplitude[i]), over_rates[0, 0] + moved * over_rates[1, 0], 0j
        for c in range(len(cells)):
            off = rate[i] - cells[c, 1]
            near = _apart(abs(at_range - cells[c, 0] + off * middle / slope) / resolution, samples)
            near = max(near - 0.5 * moved * chirps, 0.0)
            # Most are too far in range alone.
            if weight * over_ranges[int(near)] * largest < least[c]:
                continue
            slow = _apart(abs(off) * per_rate, chirps)
            held, late = over_rates[0, int(slow)], over_rates[1, int(slow)]
            if weight * over_ranges[int(near)] * (held + moved * late) < least[c]:
                continue
            if turn == 0j:
                turn = amplitude[i] * _stands(delay[i], rate[i], ramp)[1]
            wave = turn * _answer(at_range, rate[i], cells[c, 0], cells[c, 1], ramp, sizes, across, along)
            _count(c, group[i], i, wave, at_range, rate[i], total, size, strongest, most)
    for c in range(len(cells)):
        copy_to(size[c, 0], count)


@njit(cache=True, nogil=True)
def cell_sums(group, count, waves, ranges, rates):  # type: ignore[no-untyped-def]
    """Return, by groups, sums of waves (1, g); sizes (1, 4, g): count, power |wave|^2, and power times range and rate;
    and the strongest echo (1, g), -1 if there is none.

    Args: group (n,) of each echo, below `count`.
    """
    total, size = np.zeros((1, count), np.complex128), np.zeros((1, 4, count))
    strongest, most = np.full((1, count), -1), np.full((1, count), -1.0)
    for i in range(group.size):
        size[0, 0, group[i]] += 1.0
        _count(0, group[i], i, waves[i], ranges[i], rates[i], total, size, strongest, most)
    return total, size, strongest
