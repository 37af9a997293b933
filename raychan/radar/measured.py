"""Which angles elements measure, how finely, and on which lattice they stand.

Along an axis over which they spread too little, noise alone would tell directions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SAME = 1e-3
"""Wavelengths: elements nearer than this along an axis share a coordinate; 6 mrad of phase."""
_WIDEST = 6.0  # cosine: the widest beam that tells directions, which span 2 (not measured)
_TIE = 1e-9
_LEAST = 1e-6  # wavelengths beside a line: 6e-6 of an amplitude
_PER_BEAM = 4  # beams tried per beam width: one between two reads at most 0.2 dB low (sinc(1/8))


def beam_width(places: Floats, wavelength: float) -> float:
    """Return the distance of the first null from a beam's peak, in the cosine along the axis of places (a,) [m];
    infinite for one row."""
    rows = len(np.unique(np.rint(places / (SAME * wavelength))))
    size = float(np.ptp(places)) * rows / (rows - 1) if rows > 1 else 0.0
    return wavelength / size if size > 0.0 else float(np.inf)


def measured(elements: Floats, wavelength: float) -> tuple[bool, bool]:
    """Return whether elements (a, 3) [m] measure the cosine along y, and that along z.

    Beside a line, slanted or not, they may stand by less than tells directions: they then measure the one along the
    axis, y or z, that is nearer to the line."""
    across = elements[:, 1:] - elements[:, 1:].mean(axis=0)
    beside, along = np.linalg.eigh(across.T @ across)[1].T
    # Depth tells a direction by the cosine ahead, which spans half of what others do.
    depth = 0.5 * _beside(elements[:, 0], across @ along)
    if min(beam_width(x, wavelength) for x in (across @ beside, depth)) <= _WIDEST:
        y, z = np.ptp(across, axis=0) > SAME * wavelength
        return bool(y), bool(z)
    axis = int(abs(along[1]) > abs(along[0]) * (1.0 + _TIE))
    told = beam_width(across[:, axis], wavelength) <= _WIDEST
    return told and axis == 0, told and axis == 1


def common_pitch(x: Floats, tolerance: float) -> float:
    """Return the greatest length of which all distances of numbers (n,) are multiples, by Euclid's algorithm."""
    ordered = np.unique(x)
    found = 0.0
    for step in (float(s) for s in np.diff(ordered) if s > tolerance):
        other = step
        while other > tolerance:
            found, other = other, abs(found - other * np.rint(found / other))
    return found


def beside_line(along: Floats, aside: Floats, extent: float) -> float:
    """Return the share of a wave's power that a beam of a line reads, at most, of what places beside the line make of
    the wave's phase.

    Args: places (a,) along the line's axis, and beside it; the line's extent; [wavelengths] all."""
    off = _beside(aside, along)
    if np.ptp(off) <= _LEAST:
        return 0.0
    # Of a wave from straight aside, to first order in the phase; in a beam so far away in the cosine.
    away = np.linspace(0.0, 2.0, int(np.ceil(2.0 * _PER_BEAM * extent)) + 1)
    read = np.exp(2j * np.pi * np.outer(away, along)) @ (2.0 * np.pi * off) / len(off)
    return float((read.real**2 + read.imag**2).max())


def _beside(places: Floats, along: Floats) -> Floats:
    """Return how far places (a,) stand off the line that fits them best, by their places (a,) along another axis."""
    own, other = places - places.mean(), along - along.mean()
    power = float(other @ other)
    return np.asarray(own - (float(other @ own) / power if power > 0.0 else 0.0) * other)
