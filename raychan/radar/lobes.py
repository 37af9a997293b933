"""Grating lobes of a flat array: differences of directions that look alike to elements on any lattice, or on none.

To a flat array a wave from cosines c in a beam towards c' has a power that depends on d = c' - c alone. It is 1 where
exp(2 pi j d . (p_i - p_0) / wavelength) = 1 for all elements p_i: on the dual lattice of all differences of elements,
skewed where rows are shifted (Van Trees 2002, 4.1.2); without a lattice it has maxima below 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HALF = 0.5
"""Power of a lobe in the beam: the side lobes of filled arrays are lower, and no grating lobes."""
_REACH = 2.0  # the most that cosines of visible directions differ by
_PER_BEAM = 4  # points of the search per beam width: a maximum between them reads at most 1.4 dB low (cos^4(pi/8))
_START = 0.3  # of the power: HALF less that, and a margin
_ROUNDS = 12  # of Newton's method, each at most a point far: from half a point away three give rounding
_LEAST_BEND = 0.05  # of the curvature of the main lobe: flatter places are climbed by steps of a point
_BATCH = 1 << 21  # points of the search at once, 32 MB


@dataclass(frozen=True, eq=False)
class Lobes:
    """Grating lobes beside the main lobe, at least half as strong."""

    at: Floats
    """Differences (l, 2) of cosines along y and z, up to half a beam width beyond those of visible directions."""
    lost: Floats
    """Share (l,) of the power that a beam loses of a wave so far away."""


def on_rectangle(period: Floats, width: Floats) -> Lobes:
    """Return the lobes of elements that fill a line or rectangle, `period` (2,) apart in the cosines, inf: none."""
    count = [int((_REACH + _margin(width)) / x * (1.0 + 1e-9)) if np.isfinite(x) else 0 for x in period]
    axes = [np.arange(-n, n + 1) * (x if n else 0.0) for n, x in zip(count, period, strict=True)]
    at = np.stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")], axis=1)
    size = np.linalg.norm(at, axis=1)
    at = at[(size > 0.0) & (size <= _REACH + _margin(width))]
    return Lobes(at, np.zeros(len(at)))


def of_places(places: Floats, width: Floats) -> Lobes:
    """Return the lobes of elements at any places (a, 2) [wavelengths] along y and z, by a search.

    Args: width (2,), beam widths in the cosines; infinite along an axis that the elements do not measure."""
    reach, known = _REACH + _margin(width), np.isfinite(width)
    step = np.where(known, width / _PER_BEAM, 0.0)
    turns = 2.0 * np.pi * (places - places.mean(axis=0)) * known
    u, w = (np.arange(-n, n + 1) * s for n, s in zip(_points(reach, step), step, strict=True))
    columns, power = np.exp(1j * np.outer(turns[:, 1], w)), np.empty((len(u), len(w)), np.float32)
    for rows in np.array_split(np.arange(len(u)), -(-power.size // _BATCH)):
        wave = np.exp(1j * np.outer(u[rows], turns[:, 0])) @ columns / len(places)
        power[rows] = wave.real**2 + wave.imag**2
    m, n = _crests(power)
    at, value = _climbed(turns[:, known], np.stack([u[m], w[n]], axis=1)[:, known], step[known])
    out = np.zeros((len(at), 2))
    out[:, known] = at
    beside = (np.abs(out[:, known] / width[known]) > 0.5).any(axis=1) & (np.linalg.norm(out, axis=1) <= reach)
    kept = beside & (value >= HALF)
    return Lobes(out[kept], np.maximum(1.0 - value[kept], 0.0))


def _margin(width: Floats) -> float:
    """Return half the beam width, of the finer of two axes."""
    return 0.5 * min(1.0, float(width.min()))


def _points(reach: float, step: Floats) -> list[int]:
    return [int(np.ceil(reach / s)) if s > 0.0 else 0 for s in step]


def _crests(power: NDArray[np.float32]) -> tuple[Any, Any]:
    """Return the places of powers (m, n) that are strong and no less than all eight beside them."""
    m, n = np.nonzero(power >= _START)
    top = np.ones(len(m), bool)
    for i, k in np.ndindex(3, 3):
        beside = np.clip(m + i - 1, 0, len(power) - 1), np.clip(n + k - 1, 0, power.shape[1] - 1)
        top &= power[m, n] >= power[beside]
    return m[top], n[top]


def _climbed(turns: Floats, at: Floats, step: Floats) -> tuple[Floats, Floats]:
    """Return the maxima of the power next to places (l, k), and the power (l,) there.

    Args: turns (a, k) [rad per unit], what the phase of each element changes by along the axes."""
    bend = _LEAST_BEND * 2.0 * (turns**2).mean(axis=0).min(initial=np.inf)
    best, top = at, np.full(len(at), -1.0)
    for _ in range(_ROUNDS):
        phasor = np.exp(1j * at @ turns.T) / len(turns)
        wave = phasor.sum(axis=1)
        power = wave.real**2 + wave.imag**2
        better = power > top
        best, top = np.where(better[:, None], at, best), np.where(better, power, top)
        slope = 1j * phasor @ turns
        second = -np.einsum("la,ai,aj->lij", phasor, turns, turns, optimize=True)
        rise = 2.0 * (wave.conj()[:, None] * slope).real
        curve = 2.0 * (slope.conj()[:, :, None] * slope[:, None] + wave.conj()[:, None, None] * second).real
        values, vectors = np.linalg.eigh(-curve)
        along = np.einsum("lji,lj->li", vectors, rise) / np.maximum(values, bend)
        at = at + np.clip(np.einsum("lij,lj->li", vectors, along), -step, step)
    return best, top
