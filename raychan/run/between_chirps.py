"""Routes carried on chirp by chirp from fewer instants: lengths and amplitudes interpolated in slow time.

A length bends by the acceleration of its body, which takes many chirps; an amplitude without its carrier phase turns
with the pose of its footprint. Both are cubics through the four nearest instants. Footprints so large, or turning so
fast, that their corners drift apart by much phase from instant to instant are computed at every chirp.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raychan.channel.slow_time import Poses, extrapolated
from raychan.columns import take
from raychan.records import Routes
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_DRIFT = 1.0
"""rad of phase by which corners of a footprint may drift apart from one computed pose to the next. Beyond, the cubics
fail: a box of 1 m, poses 0.6 ms apart, is off by -69 dB at 1 rad, -41 at 2, -35 at 4, -10 at 8; ramps 50 us apart, 77
GHz, 90 to 720 degrees a second (`pytest tests/run/test_turning_flat_bodies.py -k poses` has two of these turns). CPU
time hardly differs."""


def carried_between(
    routes: Routes,
    strength: Complexes,
    poses: Callable[[Floats], Poses],
    chirps: Floats,
    every: float,
    frequency: float,
) -> tuple[Floats, Complexes]:
    """Return lengths [m] and amplitudes (t, n, 3) of routes at chirps (t,), computed about every so many chirps.

    Args: poses of bodies and radar at chirps; the rest and what is returned as of `channel.slow_time.extrapolated`.
    """
    count = max(4, 1 + int(np.ceil((chirps[-1] - chirps[0]) / every)))
    if count >= len(chirps):
        return extrapolated(routes, strength, poses(chirps), frequency)
    knots = np.linspace(chirps[0], chirps[-1], count)
    lengths, amplitudes = extrapolated(routes, strength, poses(knots), frequency)
    k = 2.0 * np.pi * frequency / C0
    fast = np.flatnonzero(k * _drift(lengths) > _DRIFT)
    amplitudes[:, fast] = 0.0
    parts = np.flatnonzero((amplitudes != 0.0).any(axis=0))
    length, amplitude = (x.reshape(count, -1)[:, parts] for x in (lengths, amplitudes))
    weights = _cubic(knots, chirps)
    # From the first length on: float64 would lose phase in weighted sums of whole lengths.
    grown = length - length[:1]
    envelope = weights @ (amplitude * np.exp(1j * k * grown))
    grown = weights @ grown
    shape = (len(chirps), *lengths.shape[1:])
    out, turned = np.empty(shape), np.zeros(shape, np.complex128)
    out[...] = lengths[:1]
    out.reshape(len(chirps), -1)[:, parts] += grown
    turned.reshape(len(chirps), -1)[:, parts] = envelope * np.exp(-1j * k * grown)
    if len(fast):
        out[:, fast], turned[:, fast] = extrapolated(take(routes, fast), strength[fast], poses(chirps), frequency)
    return out, turned


def _drift(lengths: Floats) -> Floats:
    """Return by how much (n,) [m] parts of routes with lengths (t, n, 3) [m] drift apart at most, from one instant to
    the next."""
    a, b, c = np.diff(lengths, axis=0).transpose(2, 0, 1)
    worst: Floats = np.maximum(np.maximum(np.abs(a - b), np.abs(b - c)), np.abs(c - a)).max(axis=0)
    return worst


def _cubic(knots: Floats, at: Floats) -> Floats:
    """Return weights (t, k) that interpolate at places (t,) from values at even knots (k,), by Lagrange's cubics."""
    place = (at - knots[0]) / (knots[1] - knots[0])
    first = np.clip(np.floor(place).astype(np.int64) - 1, 0, len(knots) - 4)
    x, out = place - first, np.zeros((len(at), len(knots)))
    for i in range(4):
        others = [j for j in range(4) if j != i]
        out[np.arange(len(at)), first + i] = np.prod([(x - j) / (i - j) for j in others], axis=0)
    return out
