"""Fast sum of the beat signals of many moving echoes: two non-uniform transforms over a keystone time axis.

With T = M + t counted from the middle sample, M over chirps and t within one, an echo of delay tau and delay rate b
there has the beat phase [turns]

    S tau t + b T (F + S t - S off) - S b^2 T^2 / 2,    off = tau - tau_0,  F = carrier + S t_0 - S tau_0.

With its Doppler shift n = b (F - S off) this is (S tau + n) t + n u + B T t + A T^2, where u = M (1 + S t / F) +
S t^2 / F, B = S off b S / F and A = -S b^2 / 2. At a given sample u is the same for all echoes (the keystone transform,
Perry, DiPietro, Fante, IEEE Trans. AES 35(1), 1999), so one transform over beat frequencies and one over Doppler
shifts, read off at u, sum all echoes with their range migration. The rest, as a rule below 1e-2, is a series in B and
A, each term one more pair of transforms, cut where the tolerance allows.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from raychan.parallel import parallel_for, parallel_map
from raychan.radar.waveform import Waveform
from raychan.signal.echoes import Echoes
from raychan.signal.keystone_kernels import place_boxes, place_samples, place_sources
from raychan.signal.nufft import (
    OVER,
    add_transposed,
    counting_sort,
    deconvolution_polynomial,
    interpolate,
    kernel_polynomials,
    kernel_transform,
    kernel_weights,
    rows_under,
    spread,
    wrap_margins,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]

# Sizes trade memory against threads at work; other values were not measured.
_SINGLE = 1e-6  # tolerance down to which single precision and a kernel of 8 cells suffice
_STRIPES = 4  # parts of the echoes that are spread in parallel
_BLOCK = 64  # samples of a chirp whose transforms over Doppler shift are made at a time
ROOM = 1 << 28  # bytes of a grid: beyond, the echoes are split over several grids
CHUNK = 1 << 18  # echoes spread at a time
_BOX = 8, 8  # rows and columns of a box by which echoes are sorted, so that neighbours share cells in the cache
_READ, _READY = 4.0, 4  # cost of reading a sample off a plane, in cells transformed; planes that setting it up costs
_MANY = 20_000  # echoes or samples from which on a second thread pays (not measured)
_CROWD = 64  # echoes in a box up to which they are summed in single precision: it errs by 3e-7 of their sum


def middle(wave: Waveform) -> tuple[float, float, float]:
    """Return the time of the middle sample from the start of the frame and of its ramp, and the sample step [s]."""
    step = wave.chirp_duration / wave.n_samples
    t = (wave.n_samples // 2) * step
    return (wave.n_chirps // 2) * wave.repetition + t, t, step


class Keystone:
    """The grid of one set of echoes, and how samples are read off it; the same for all receivers."""

    def __init__(self, echoes: Echoes, wave: Waveform, tolerance: float, reach: float, sway: float = 0.0) -> None:
        """Size the grid. Args: echoes, one at least; tolerance relative to the sum of their |amplitude|; reach [s] and
        sway, the most by which delays, and delay rates, between two elements differ from those between the phase
        centres."""
        self.then, self.t, self.step = middle(wave)
        self.wave, slope = wave, wave.slope
        chirps, samples = wave.n_chirps, wave.n_samples
        self.single = tolerance >= _SINGLE
        self.width = 8 if self.single else 16
        self.delays = float(echoes.delay.min()), float(echoes.delay.max())
        self.delay_rates = float(echoes.delay_rate.min()), float(echoes.delay_rate.max())
        self.delay = 0.5 * sum(self.delays)
        self.frequency = wave.carrier + slope * (self.t - self.delay)
        self.stretch = slope / self.frequency

        off = echoes.delay - self.delay
        fastest, farthest = max(map(abs, self.delay_rates)) + sway, float(np.abs(off).max())
        shift = echoes.delay_rate * (self.frequency - slope * off)
        self.shift, span = _middle(shift, fastest * slope * reach + sway * (self.frequency + slope * farthest))
        far, far_span = _middle(
            echoes.delay_rate * off * (slope * self.stretch),
            (fastest * reach + sway * farthest) * slope * self.stretch,
        )
        late, late_span = _middle(-0.5 * slope * echoes.delay_rate**2, slope * fastest * sway)
        t, m = (samples // 2) * self.step, (chirps // 2) * wave.repetition
        far_turn, late_turn = 2.0 * np.pi * far_span * (m + t) * t, 2.0 * np.pi * late_span * (m + t) ** 2
        small = 0.3 * tolerance
        self.rest_turn = far_turn * (far_turn > small), late_turn * (late_turn > small)
        self.terms = _terms(*self.rest_turn, small)
        self.orders = int(self.terms.max()), len(self.terms) - 1
        self.planes = int(self.terms.sum()) + len(self.terms)
        spans = zip((far, late), (far_span, late_span), self.orders, strict=True)
        self.rest = np.array([[middle, 1.0 / half if n else 0.0, n, half] for middle, half, n in spans])

        longest = max(m * (1.0 + self.stretch * t) + self.stretch * t * t, self.step)
        self.dense = 2.0 * OVER * longest
        self.rows = 2 * math.ceil(span * self.dense + 0.5 * self.width + 2.0)
        self.length, self.columns = _fast(OVER * self.rows), _fast(max(OVER * samples, 2.0 * self.width))

    @property
    def turns(self) -> float:
        """Phase [rad] that the series in B and A must reproduce."""
        return sum(self.rest_turn)

    @property
    def cells(self) -> int:
        """Number of cells that are transformed."""
        return self.planes * (self.rows * self.columns + self.length * self.wave.n_samples)

    @property
    def work(self) -> float:
        """Approximate cost, in cells that are transformed."""
        return self.cells + _READ * float(self.planes + _READY) * self.wave.n_chirps * self.wave.n_samples

    @property
    def factors(self) -> int:
        """Number of factors that `prepared` writes."""
        return self.planes * self.wave.n_chirps * self.wave.n_samples

    def prepared(self, echoes: Echoes, buffer: Complexes) -> Echoes:
        """Return the echoes sorted by row, and set up how samples are read off; the `factors` go into the buffer."""
        wave, box, across = self.wave, np.empty(len(echoes.delay), np.int64), self.columns // _BOX[1] + 1
        grid = wave.slope, self.delay, self.frequency, self.shift, self.dense, 0.5 * self.rows, self.columns, self.step

        def boxed(at: slice) -> None:
            place_boxes(box[at], echoes.delay[at], echoes.delay_rate[at], grid, _BOX, across)

        # Sorted by boxes, so that neighbours add to cells that are in the cache: rows first, for the stripes.
        parallel_for(len(box), boxed, _MANY)
        order, most = counting_sort(box, (self.rows // _BOX[0] + 1) * across)
        # Where many echoes add up in one cell, single precision would round too coarsely.
        self.sort = np.complex64 if self.single and most <= _CROWD else np.complex128
        self.polynomials = kernel_polynomials(self.width)
        k, s = np.arange(self.rows) - self.rows // 2, np.arange(wave.n_samples) - wave.n_samples // 2
        # The sign moves the transform's middle to the middle of its length: nothing is read across its end.
        self.over = (1.0 - 2.0 * (k % 2)) / kernel_transform(self.width, k / self.length)
        self.along = 1.0 / kernel_transform(self.width, s / self.columns)
        shape = wave.n_chirps, wave.n_samples
        place, self.factor = np.empty(shape), buffer[: self.factors].reshape(self.planes, *shape)
        frame = np.array([wave.repetition, self.step, self.stretch, self.shift, self.dense, OVER, self.length])
        falloff, self.first = deconvolution_polynomial(self.width), np.empty(shape, np.int64)
        self.weight = np.empty((*shape, self.width), np.float32 if self.single else np.float64)

        def read(at: slice) -> None:
            place_samples(place, self.factor, (at.start, at.stop), frame, self.rest, self.terms, falloff)
            kernel_weights(self.first[at], self.weight[at], place[at], self.polynomials)

        parallel_for(wave.n_chirps, read, max(1, _MANY // wave.n_samples))
        return echoes.in_order(order)

    def add(self, out: Complexes, echoes: Echoes, elements: tuple[Floats, Floats], chunk: int = CHUNK) -> None:
        """Add to out (chirps, samples) the beat signal of the `prepared` echoes between two elements.

        Args: elements, positions (3,) [m] of transmitter and receiver; chunk, most echoes spread at a time.
        """
        count, samples, half = len(echoes.delay), self.wave.n_samples, self.width // 2
        ramp = np.array([self.wave.carrier, self.wave.slope, self.then, self.t, self.step])
        grid = np.array(
            [self.delay, self.frequency, self.shift, self.dense, 0.5 * self.rows, self.columns, float(half)]
        )

        def gridded(part: slice) -> tuple[int, NDArray[Any]]:
            some = echoes[part]
            later, faster, amplitude = some.between(*elements)
            (x, y), strength = np.empty((2, len(later))), np.empty((len(later), self.planes), self.sort)
            waves = amplitude, some.delay, some.delay_rate, later, faster
            place_sources(x, y, strength, *waves, ramp, grid, self.rest, self.terms)
            first, rows = rows_under(x, self.width)
            cells = np.zeros((self.planes, rows, self.columns + 2 * half), self.sort)
            flat = cells.view(cells.real.dtype).reshape(-1)
            spread(cells, flat, x - first, y, strength, self.polynomials.astype(flat.dtype))
            wrap_margins(cells, half)
            return first, scipy.fft.fft(cells[:, :, half:-half], axis=2, overwrite_x=True)

        stripes = min(count, max(_STRIPES, -(-count // chunk)))
        bounds = np.linspace(0, count, stripes + 1).astype(int)
        spectra_rows = parallel_map(gridded, [slice(a, b) for a, b in pairwise(bounds)])

        def read_block(start: int) -> None:
            end = min(start + _BLOCK, samples)
            spectra = np.zeros((self.planes, end - start, self.length), np.complex64 if self.single else np.complex128)
            real = spectra.real.dtype
            along, column = self.along[start:end].astype(real), (start - samples // 2) % self.columns
            for first, rows in spectra_rows:
                over = self.over[first : first + rows.shape[1]].astype(real)
                add_transposed(spectra, rows, first - self.rows // 2, column, over, along)
            spectra = scipy.fft.fft(spectra, axis=2, overwrite_x=True)
            part, factor = np.s_[:, start:end], self.factor[:, :, start:end]
            interpolate(out[part], spectra, self.first[part], self.weight[part], factor)

        parallel_map(read_block, range(0, samples, _BLOCK))


def keystones(
    echoes: Echoes, wave: Waveform, tolerance: float, reach: float, room: int = ROOM, sway: float = 0.0
) -> list[tuple[Keystone, Echoes]]:
    """Return grids, each with its own echoes: one for all, or several where these cost less, as for echoes whose delays
    or rates differ much, or where one takes more than `room` [bytes]."""
    grid = Keystone(echoes, wave, tolerance, reach, sway)
    large = 16 * grid.planes * grid.rows * grid.columns > room
    if not large and grid.turns <= 1.0:
        return [(grid, echoes)]
    spans = grid.delay_rates[1] - grid.delay_rates[0], grid.delays[1] - grid.delays[0]
    fastest = max(map(abs, grid.delay_rates))
    if large:
        by_rate = spans[0] * grid.frequency >= fastest * wave.slope * spans[1]
    else:
        by_rate = grid.rest_turn[1] >= grid.rest_turn[0]
    values, limits = (echoes.delay_rate, grid.delay_rates) if by_rate else (echoes.delay, grid.delays)
    below = values <= 0.5 * sum(limits)
    if below.all() or not below.any():
        return [(grid, echoes)]
    parts = [part for half in (below, ~below) for part in keystones(echoes[half], wave, tolerance, reach, room, sway)]
    # More terms of the series may cost less than reading every sample off one more grid.
    return parts if large or sum(part.work for part, _ in parts) < grid.work else [(grid, echoes)]


def _middle(values: Floats, margin: float) -> tuple[float, float]:
    """Return the middle of some values and half their range plus a margin."""
    low, high = float(values.min()), float(values.max())
    return 0.5 * (low + high), 0.5 * (high - low) + margin


def _terms(far: float, late: float, tolerance: float) -> Ints:
    """Return for each order (j,) of the series in A the last order of the series in B that goes with it.

    The series of exp(j turn x) in Chebyshev polynomials has terms 2 J_n(turn) < 2 (turn / 2)^n / n! (Jacobi-Anger,
    Abramowitz & Stegun 9.1.44 and 9.1.62); the products of two that are left out add up to less than the tolerance.
    """
    sizes = [_sizes(turn, tolerance) for turn in (late, far)]
    products = np.outer(*sizes)
    order = np.sort(products, axis=None)
    least = order[np.searchsorted(np.cumsum(order), tolerance)]
    last: Ints = (products >= least).sum(axis=1) - 1
    return last[last >= 0]


def _sizes(turn: float, tolerance: float) -> Floats:
    """Return bounds (n,) on the terms of a series, not increasing, down to where they are negligible."""
    found = [1.0]
    if turn > 0.0:
        while found[-1] > 1e-3 * tolerance or len(found) < turn:
            found.append(found[-1] * 0.5 * turn / len(found))
        found[1:] = [2.0 * x for x in found[1:]]
    falling = np.maximum.accumulate(np.array(found)[::-1])[::-1]
    return np.minimum(falling, 2.0) if turn > 0.0 else falling


def _fast(least: float) -> int:
    """Return the next even length whose transform is fast."""
    return 2 * int(scipy.fft.next_fast_len(math.ceil(0.5 * least)))
