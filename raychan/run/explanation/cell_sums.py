"""Kernels of the point-spread function: contributions of many echoes to cells of a range-Doppler map, and their
sums."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.phasor import unit_phasor
from raychan.vectors import copy_to

_BLOCK = 512  # echoes whose places are held at once, in a processor's nearest cache; others not measured
_NEXT = np.uint64(1)
# Where in one row of numbers each quantity of the echoes of a block begins: within one row the compiler sees that none
# overlaps another, and uses vector units.
_SECTIONS = 8
_RANGE, _RATE, _MOVED, _WEIGHT, _AWAY, _APART, _FAR, _SLOW = (i * _BLOCK for i in range(_SECTIONS))


@njit(cache=True, nogil=True, forceinline=True)
def _place(n, fine, cell):  # type: ignore[no-untyped-def]
    """Return the table index below `cell`, the weight of the next entry, and the sign."""
    period = np.floor(cell * (1.0 / n))
    at = (cell - period * n) * fine
    low = max(min(int(at), n * fine - 1), 0)
    # One period on, the response of an even window, with its phase counted from the middle, changes sign.
    sign = 1.0 if n & 1 else 1.0 - 2.0 * (period - 2.0 * np.floor(0.5 * period))
    # Without a sign, an index is not looked at from the table's end.
    return np.uint64(low), at - low, sign


@njit(cache=True, nogil=True)
def periodic(table, n, fine, cells):  # type: ignore[no-untyped-def]
    """Return a window's response at `cells` (m,) cells from its peak, linear between `fine` points a cell.

    Args: table (n fine + 1,) one period of the response of n samples, its phase counted from their middle.
    """
    out = np.empty(len(cells), np.complex128)
    for i in range(len(cells)):
        low, share, sign = _place(n, fine, cells[i])
        out[i] = sign * (table[low] + share * (table[low + _NEXT] - table[low]))
    return out


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _stands(delay, rate, ramp):  # type: ignore[no-untyped-def]
    """Return the range [m] of an echo at mid frame, and its phasor there."""
    carrier, slope, centre, swept, _, _, _, light = ramp
    then = delay + 2.0 * rate * centre / light
    cosine, sine = unit_phasor(carrier * (then - delay) + swept * then - 0.5 * slope * then**2)
    return 0.5 * light * then, complex(cosine, sine)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _scales(ramp, chirps):  # type: ignore[no-untyped-def]
    """Return the range [m] by which a m/s shifts an echo, and the cells of range in a metre, of rate in a m/s, and
    that an echo of a m/s moves in a ramp.

    Doppler is measured at the middle sample of the sweep. Each row of the map is corrected for its own Doppler within
    the ramp; other rates keep the difference.
    """
    _, slope, _, _, middle, repetition, resolution, light = ramp
    return middle / slope, 1.0 / resolution, 2.0 * middle / light * chirps * repetition, repetition / resolution


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _answer(away, apart, moved, sizes, across, tables, middles):  # type: ignore[no-untyped-def]
    """Return the response of both windows to an echo so many cells away in range and apart in rate, which moves by so
    many range cells in a ramp."""
    samples, chirps, fine = sizes
    # Real and imaginary parts apart: numba multiplies real by complex numbers as two complex ones.
    re, im = 0.0, 0.0
    low, share, sign = _place(chirps, fine, apart)
    for k in range(len(middles)):
        # Within a part of the frame the range response is linear.
        at, part, turned = _place(samples, fine, away + moved * (middles[k] - 0.5 * (chirps - 1)))
        level, next_level = across[at, 0].real, across[at + _NEXT, 0].real
        lean, next_lean = across[at, 1].real, across[at + _NEXT, 1].real
        held, next_held = tables[k, low, 0], tables[k, low + _NEXT, 0]
        late, next_late = tables[k, low, 1], tables[k, low + _NEXT, 1]
        level = turned * (level + part * (next_level - level))
        lean = turned * moved * (lean + part * (next_lean - lean))
        re += level * (held.real + share * (next_held.real - held.real))
        re += lean * (late.real + share * (next_late.real - late.real))
        im += level * (held.imag + share * (next_held.imag - held.imag))
        im += lean * (late.imag + share * (next_late.imag - late.imag))
    return complex(sign * re, sign * im)


@njit(cache=True, nogil=True, error_model="numpy")
def cell_waves(amplitude, delay, rate, cell, ramp, sizes, across, along):  # type: ignore[no-untyped-def]
    """Return the contributions (n,) of echoes to a cell, and their ranges (n,) [m] at mid frame.

    Args: cell range [m] and rate [m/s]; ramp carrier, slope, time of the frame's middle, swept half [Hz], middle
    frequency [Hz], repetition, range resolution [m], speed of light; sizes samples, chirps, fine; across (., 2) the
    range response, which is real, and its derivative by cells; along (parts, ., 2) the rate response of each part of
    the frame with weights 1 and with weights of the chirp number from its middle, and these middles (parts,).
    """
    waves, ranges = np.empty(delay.size, np.complex128), np.empty(delay.size)
    tables, middles = along
    shift, per_range, per_rate, per_ramp = _scales(ramp, sizes[1])
    for i in range(delay.size):
        ranges[i], turn = _stands(delay[i], rate[i], ramp)
        off = rate[i] - cell[1]
        away = (ranges[i] - cell[0] + off * shift) * per_range
        waves[i] = (
            amplitude[i] * turn * _answer(away, off * per_rate, rate[i] * per_ramp, sizes, across, tables, middles)
        )
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
    """Return the distance in cells, 0 or more, from the nearest peak of a response of period n cells."""
    cells = abs(cells)
    cells -= n * math.floor(cells * (1.0 / n))
    cells = cells if cells < n - cells else n - cells
    return cells if cells > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _far_off(held, some, cell, scales, sizes):  # type: ignore[no-untyped-def]
    """Write by how many cells the echoes of a block stand off a cell, and off its nearest peaks at least."""
    (at_range, at_rate), (shift, per_range, per_rate, _), (samples, chirps, _) = cell, scales, sizes
    for j in range(some):
        off = held[_RATE + j] - at_rate
        away, apart = (held[_RANGE + j] - at_range + off * shift) * per_range, off * per_rate
        far = _apart(away, samples) - 0.5 * abs(held[_MOVED + j]) * chirps
        held[_AWAY + j], held[_APART + j] = away, apart
        held[_FAR + j], held[_SLOW + j] = far if far > 0.0 else 0.0, _apart(apart, chirps)


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _that_count(held, near, some, enough, over_ranges, over_rates):  # type: ignore[no-untyped-def]
    """Write the numbers of the echoes of a block that may count, without a branch that nothing foretells; return how
    many there are."""
    found = 0
    for j in range(some):
        near[found] = j
        far, slow = np.uint64(held[_FAR + j]), np.uint64(held[_SLOW + j])
        late = over_rates[0, slow] + abs(held[_MOVED + j]) * over_rates[1, slow]
        found += 1 if held[_WEIGHT + j] * over_ranges[far] * late >= enough else 0
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def sums_in_cells(  # type: ignore[no-untyped-def]
    group, amplitude, delay, rate, cells, least, beyond, total, size, strongest, most, ramp, sizes, across, along
):
    """Write the `cell_sums` (c, ...) of the contributions of echoes (n,) to several cells (c, 2), and the power `most`
    (c, g) of the strongest.

    Args: least (c,) contribution that counts; beyond (s,) and (2, m) upper bounds of the range and rate responses by
    cells from the peak; else as for `cell_waves` and `cell_sums`.
    """
    scales = _scales(ramp, sizes[1])
    per_ramp = scales[3]
    # Taken out of the tuples once: each access counts a reference.
    (over_ranges, over_rates), (tables, middles) = beyond, along
    total[:], size[:], strongest[:], most[:] = 0.0, 0.0, -1, -1.0
    count, held, waves = np.zeros(total.shape[1]), np.empty(_SECTIONS * _BLOCK), np.empty(_BLOCK, np.complex128)
    near = np.empty(_BLOCK, np.int64)
    for first in range(0, delay.size, _BLOCK):
        some = min(_BLOCK, delay.size - first)
        for j in range(some):
            i = first + j
            count[group[i]] += 1.0
            held[_RANGE + j], turn = _stands(delay[i], rate[i], ramp)
            held[_RATE + j], held[_MOVED + j] = rate[i], rate[i] * per_ramp
            waves[j] = amplitude[i] * turn
            weight = amplitude[i].real * amplitude[i].real + amplitude[i].imag * amplitude[i].imag
            held[_WEIGHT + j] = math.sqrt(weight)
        for c in range(len(cells)):
            _far_off(held, some, (cells[c, 0], cells[c, 1]), scales, sizes)
            found = _that_count(held, near, some, least[c], over_ranges, over_rates)
            for k in range(found):
                j = near[k]
                i = first + j
                away, apart, moved = held[_AWAY + j], held[_APART + j], held[_MOVED + j]
                wave = waves[j] * _answer(away, apart, moved, sizes, across, tables, middles)
                _count(c, group[i], i, wave, held[_RANGE + j], rate[i], total, size, strongest, most)
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
