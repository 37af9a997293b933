"""Routes carried on chirp by chirp from fewer instants: lengths and amplitudes interpolated in slow time.

A length bends by the acceleration of its body, which takes many chirps; an amplitude without its carrier phase turns
with the pose of its footprint. Both are cubics through the four nearest instants.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raychan.channel.slow_time import Poses, extrapolated
from raychan.records import Routes
from raychan.units import C0

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


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
    parts = np.flatnonzero((amplitudes != 0.0).any(axis=0))
    length, amplitude = (x.reshape(count, -1)[:, parts] for x in (lengths, amplitudes))
    weights, k = _cubic(knots, chirps), 2.0 * np.pi * frequency / C0
    # From the first length on: float64 would lose phase in weighted sums of whole lengths.
    grown = length - length[:1]
    envelope = weights @ (amplitude * np.exp(1j * k * grown))
    grown = weights @ grown
    shape = (len(chirps), *lengths.shape[1:])
    out, turned = np.empty(shape), np.zeros(shape, np.complex128)
    out[...] = lengths[:1]
    out.reshape(len(chirps), -1)[:, parts] += grown
    turned.reshape(len(chirps), -1)[:, parts] = envelope * np.exp(-1j * k * grown)
    return out, turned


def _cubic(knots: Floats, at: Floats) -> Floats:
    """Return weights (t, k) that interpolate at places (t,) from values at even knots (k,), by Lagrange's cubics."""
    place = (at - knots[0]) / (knots[1] - knots[0])
    first = np.clip(np.floor(place).astype(np.int64) - 1, 0, len(knots) - 4)
    x, out = place - first, np.zeros((len(at), len(knots)))
    for i in range(4):
        others = [j for j in range(4) if j != i]
        out[np.arange(len(at)), first + i] = np.prod([(x - j) / (i - j) for j in others], axis=0)
    return out
