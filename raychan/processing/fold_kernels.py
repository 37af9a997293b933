"""Kernels of beams that explain a cell together (see processing.fold_beams): where each is strongest on what the others
leave, and what all leave."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.radar.aperture import SAME_EDGE

RIDGE = 1e-6  # of a beam's weight: beams that come to lie on each other have amplitudes nevertheless (not measured)


@njit(cache=True, nogil=True)
def point_beam(weights, places, u, w):  # type: ignore[no-untyped-def]
    """Write the weights (a,) of a beam towards cosines u and w along y and z, of elements at places (a, 3) [waves]."""
    ahead = math.sqrt(max(1.0 - u * u - w * w, 0.0))
    for i in range(len(places)):
        turns = places[i, 0] * ahead + places[i, 1] * u + places[i, 2] * w
        # Sines of single precision, of less than a turn, take two fifths of the time of exact ones.
        phase = np.float32(-2.0 * math.pi * (turns - round(turns)))
        weights[i] = np.complex64(complex(math.cos(phase), math.sin(phase)))


@njit(cache=True, nogil=True)
def seen_power(values, weights):  # type: ignore[no-untyped-def]
    """Return the power that a beam of weights (a,) sees of values (a,)."""
    seen = 0j
    for i in range(len(values)):
        seen += values[i] * weights[i]
    return seen.real**2 + seen.imag**2


@njit(cache=True, nogil=True)
def solve_in_place(gram, right):  # type: ignore[no-untyped-def]
    """Replace right (k,) by the solution of gram (k, k) x = right; gram is Hermitian, positive, and overwritten."""
    count = len(right)
    for j in range(count):
        for i in range(j + 1, count):
            share = gram[i, j] / gram[j, j]
            for m in range(j, count):
                gram[i, m] -= share * gram[j, m]
            right[i] -= share * right[j]
    for j in range(count - 1, -1, -1):
        for m in range(j + 1, count):
            right[j] -= gram[j, m] * right[m]
        right[j] /= gram[j, j]


@njit(cache=True, nogil=True)
def leave(rest, values, weights, own, gram, right):  # type: ignore[no-untyped-def]
    """Write what plane waves from the beams of weights (k, a), fitted by least squares, leave of values (a,); the wave
    of beam `own` is left as well (none if -1). Scratch: gram (k, k), right (k,)."""
    count, many = weights.shape
    for j in range(count):
        right[j] = 0.0
        for i in range(many):
            right[j] += weights[j, i] * values[i]
        for m in range(count):
            gram[j, m] = RIDGE * many if j == m else 0.0
            for i in range(many):
                gram[j, m] += weights[j, i] * weights[m, i].conjugate()
    solve_in_place(gram, right)
    for i in range(many):
        left = complex(values[i])
        for j in range(count):
            if j != own:
                left -= weights[j, i].conjugate() * right[j]
        rest[i] = left


@njit(cache=True, nogil=True)
def canonical(u, w, period, skewed):  # type: ignore[no-untyped-def]
    """Return the cosines nearest to boresight that look like u and w along y and z, as Aperture.canonical does. Args:
    period (2,), infinite where the array's beams do not repeat; skewed (l, 2)."""
    if abs(u) > 0.5 * period[0]:
        u -= period[0] * np.rint(u / period[0])
    if abs(w) > 0.5 * period[1]:
        w -= period[1] * np.rint(w / period[1])
    best_u, best_w, least = u, w, u * u + w * w - SAME_EDGE
    for i in range(len(skewed)):
        other_u, other_w = u - skewed[i, 0], w - skewed[i, 1]
        size = other_u * other_u + other_w * other_w
        if size < least:
            best_u, best_w, least = other_u, other_w, size
    return best_u, best_w


@njit(cache=True, nogil=True)
def make_visible(at, period, skewed):  # type: ignore[no-untyped-def]
    """Replace cosines (2,) by those of a real wave that look alike, or else by the nearest at the edge, as
    Aperture.visible does; arguments as of `canonical`."""
    u, w = canonical(at[0], at[1], period, skewed)
    if u * u + w * w <= 1.0:
        at[0], at[1] = u, w
    size = math.sqrt(at[0] * at[0] + at[1] * at[1])
    if size > 1.0:
        at[0], at[1] = at[0] / size, at[1] / size


@njit(cache=True, nogil=True)
def climb(at, power, values, weights, tried, places, period, skewed, step, shrinks):  # type: ignore[no-untyped-def]
    """Move a beam's cosines at (2,) to the peak of the power that it sees of values (a,) next to it, and its weights
    (a,) along; return that power. `power` is seen before; step (2,), the first distance, 0 along an axis of one row,
    is halved `shrinks` times. Scratch: tried (a,)."""
    other = np.empty(2)
    for s in range(shrinks):
        for axis in range(2):
            aside = step[axis] * 0.5**s
            if aside == 0.0:
                continue
            over, along = (aside, 0.0) if axis == 0 else (0.0, aside)
            point_beam(tried, places, at[0] - over, at[1] - along)
            below = seen_power(values, tried)
            point_beam(tried, places, at[0] + over, at[1] + along)
            above = seen_power(values, tried)
            bend = below - 2.0 * power + above
            shift = 0.5 * (below - above) / bend if bend < 0.0 else np.sign(above - below)
            shift = min(max(shift, -1.0), 1.0)
            other[0], other[1] = at[0] + shift * over, at[1] + shift * along
            make_visible(other, period, skewed)
            point_beam(tried, places, other[0], other[1])
            value = seen_power(values, tried)
            if value > power:
                power = value
                at[:] = other
                weights[:] = tried
    return power


@njit(cache=True, nogil=True, error_model="numpy")
def fit_beams(power, at, values, places, period, skewed, step, turns, shrinks):  # type: ignore[no-untyped-def]
    """Move beams towards cosines at (c, k, 2) to where they explain most of values (c, a) together, each by turns
    refined on what the others leave, and write the power (c,) that they explain, by the scale of one beam.

    Args: places (a, 3) [waves]; period (2,), skewed (l, 2) of `make_visible`; step (2,), shrinks of `climb`."""
    cells, count = at.shape[:2]
    many = len(places)
    weights, tried = np.empty((count, many), np.complex64), np.empty(many, np.complex64)
    rest, held = np.empty(many, np.complex128), np.empty(many, np.complex128)
    gram, right = np.empty((count, count), np.complex128), np.empty(count, np.complex128)
    for c in range(cells):
        total = 0.0
        for i in range(many):
            held[i] = values[c, i]
            total += held[i].real ** 2 + held[i].imag ** 2
        for j in range(count):
            point_beam(weights[j], places, at[c, j, 0], at[c, j, 1])
        for _ in range(turns):
            for j in range(count):
                leave(rest, held, weights, j, gram, right)
                start = seen_power(rest, weights[j])
                climb(at[c, j], start, rest, weights[j], tried, places, period, skewed, step, shrinks)
        leave(rest, held, weights, -1, gram, right)
        for i in range(many):
            total -= rest[i].real ** 2 + rest[i].imag ** 2
        power[c] = total * many


@njit(cache=True, nogil=True, error_model="numpy")
def left_by(rest, at, values, places):  # type: ignore[no-untyped-def]
    """Write what plane waves from cosines at (c, k, 2), fitted by least squares, leave of values (c, a) at places
    (a, 3) [waves]."""
    cells, count = at.shape[:2]
    many = len(places)
    weights, gram = np.empty((count, many), np.complex64), np.empty((count, count), np.complex128)
    held, left, right = np.empty(many, np.complex128), np.empty(many, np.complex128), np.empty(count, np.complex128)
    for c in range(cells):
        held[:] = values[c]
        for j in range(count):
            point_beam(weights[j], places, at[c, j, 0], at[c, j, 1])
        leave(left, held, weights, -1, gram, right)
        rest[c] = left


@njit(cache=True, nogil=True)
def climb_all(power, at, values, places, period, skewed, step, shrinks):  # type: ignore[no-untyped-def]
    """Move lone beams towards cosines at (c, 2) to the peaks of power (c,) next to them that they see of values (c, a);
    arguments as of `fit_beams`."""
    many = len(places)
    weights, tried, held = np.empty(many, np.complex64), np.empty(many, np.complex64), np.empty(many, np.complex128)
    for c in range(len(at)):
        held[:] = values[c]
        power[c] = climb(at[c], power[c], held, weights, tried, places, period, skewed, step, shrinks)
