"""Phase monopulse: the direction of one echo from the phase between the two halves of a line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]


def monopulse(snapshots: Complexes, aperture: Aperture, steer: Floats) -> Floats:
    """Return the cosine (n,) of one echo a snapshot (n, a), from beams of both halves steered to cosines (n,).

    The phase between the halves' beams over the distance of their centres tells by how much the echo is off. Two
    echoes in a cell give a direction that is neither's. Its variance is 4/3 of the Cramer-Rao bound (halves of a
    uniform line; 1.25 dB).
    Raises: ValueError where the elements are no uniform line. Source: Sherman and Barton 2011, section 1.3.
    """
    if aperture.table is None or not aperture.uniform:
        raise ValueError("monopulse: the elements must be a uniform line along y or z")
    axis = 0 if aperture.scans[0] else 1
    line = aperture.table.ravel()
    place = aperture.elements[line, 1 + axis]
    wave = 2.0 * np.pi / aperture.wavelength
    flat = snapshots[:, line] * np.exp(-1j * wave * np.asarray(steer)[:, None] * place)
    half = len(line) // 2
    low, high = flat[:, :half].sum(axis=1), flat[:, -half:].sum(axis=1)
    apart = place[-half:].mean() - place[:half].mean()
    return np.asarray(steer + np.angle(high * low.conj()) / (wave * apart))
