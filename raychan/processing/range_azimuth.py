"""Maps over direction: power against range and azimuth, and the beams of one cell."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import Record, column
from raychan.parallel import parallel_for
from raychan.processing.beams import BeamBank
from raychan.radar.aperture import Aperture
from raychan.records import RangeDoppler
from raychan.reprs import Plotted

Floats = NDArray[np.float64]

PER_BEAM = 8
"""Azimuths per beam width: a peak between two reads at most 0.06 dB low (closed form: sinc(1/16))."""

_BLOCK = 256  # ranges of which beams are made at a time: they stay in a cache
_DRAWN = 24  # beams per beam width of one cell's curve: smooth to the eye


@dataclass(frozen=True)
class RangeAzimuth(Record, Plotted):
    """Power against range and azimuth: of all range rates and elevations the strongest; a lone path's peak reads its
    received power."""

    range: Floats = column("r", unit="m")
    azimuth: Floats = column("b", unit="rad", doc="in the antenna's frame, evenly spaced in the sine")
    power: Floats = column("b r", unit="W")
    noise: float
    """Expected thermal noise of a beam in one cell of the range-Doppler map [W]; 0 when unknown."""


def range_azimuth(map: RangeDoppler, elements: Any, wavelength: float, taper: str = "rect") -> RangeAzimuth:
    """Return the range-azimuth map of a range-Doppler map.

    Args: elements (a, 3) [m] of the map's antennas, in the antenna's frame; wavelength [m]; taper, name of a window
    over a uniform line or rectangle. Where grating lobes repeat the view, its period about boresight is shown.
    Raises: ValueError where the elements measure no azimuth.
    """
    aperture = Aperture(np.asarray(elements, np.float64), float(wavelength))
    if not aperture.scans[0]:
        raise ValueError(
            "elements: too little spread along y, or a line nearer to z; such an array measures no azimuth"
        )
    bank = BeamBank(aperture, taper)
    sines = _sines(aperture)
    heights = aperture.grid(2).w
    power = np.zeros((len(sines), len(map.range)))
    for w in heights:
        look = np.stack([sines, np.full(len(sines), w)], axis=1)
        seen = (look**2).sum(axis=1) <= 1.0
        rows = (bank.weight * aperture.steering(look[seen]).conj()).astype(np.complex64)
        best = np.zeros((len(rows), len(map.range)), np.float32)
        parallel_for(-(-len(map.range) // _BLOCK), partial(_strongest_rate, rows, map.spectrum, best), 2)
        power[seen] = np.maximum(power[seen], best)
    return RangeAzimuth(map.range, np.arcsin(sines), power, map.noise * bank.noise_gain)


def _sines(aperture: Aperture) -> Floats:
    """Return the sines (b,) of a map's azimuths: where grating lobes join both ends, both are shown."""
    grid = aperture.grid(PER_BEAM)
    joined = grid.wraps[0] and len(grid.u) % 2 == 0
    return np.clip(np.append(grid.u, -grid.u[0]) if joined else grid.u, -1.0, 1.0)


def _strongest_rate(rows: Any, spectrum: Any, best: NDArray[np.float32], blocks: slice) -> None:
    """Write the power of beams of weights (b, a) in some blocks of ranges, of all rates the strongest, into (b, r)."""
    for at in (slice(k * _BLOCK, (k + 1) * _BLOCK) for k in range(blocks.start, blocks.stop)):
        own = best[:, at]
        for v in range(spectrum.shape[1]):
            wave = rows @ spectrum[:, v, at]
            np.maximum(own, wave.real**2 + wave.imag**2, out=own)


def beams_of(map: RangeDoppler, cell: Any, aperture: Aperture) -> tuple[Floats, Floats, Floats]:
    """Return the cosines along y (m,) and z (n,) and the power (m, n) [W] of beams in a map cell (rate, range)."""
    grid = aperture.grid(_DRAWN)
    power = np.full(grid.visible.shape, np.nan)
    steering = aperture.steering(grid.points).conj()
    wave = steering @ map.spectrum[:, cell[0], cell[1]] / len(aperture.elements)
    power[grid.visible] = wave.real**2 + wave.imag**2
    return grid.u, grid.w, power
