"""The Cramer-Rao bound: no unbiased estimate of direction has a smaller variance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_STEP = 1e-5  # of a cosine, for the derivative of the steering vector: an error of 1e-10 for 100 wavelengths


def cramer_rao(aperture: Aperture, cosines: Floats, amplitudes: Complexes, noise: float) -> Floats:
    """Return the least standard deviation (k, m) of the cosines that an array measures, m of y and z.

    Args: cosines (k, 2) of the echoes; amplitudes (n, k) [sqrt(W)] in n snapshots, unknown but not random; noise [W]
    of one receiver. For one echo on a uniform line of M elements d apart in one snapshot it is
    sqrt(6 / (snr M (M^2 - 1))) / (2 pi d / wavelength).
    Source: Stoica and Nehorai 1989, eq. 4.1; Van Trees 2002, eq. 8.106.
    """
    steering = aperture.steering(cosines).T
    axes = np.flatnonzero(aperture.scans)
    slopes = []
    for axis in axes:
        aside = np.zeros(2)
        aside[axis] = _STEP
        slopes.append((aperture.steering(cosines + aside) - aperture.steering(cosines - aside)).T / (2.0 * _STEP))
    slope = np.concatenate(slopes, axis=1)
    rest = slope - steering @ np.linalg.lstsq(steering, slope, rcond=None)[0]
    powers = np.tile(amplitudes.T @ amplitudes.conj(), (len(axes), len(axes)))
    fisher = 2.0 / noise * ((slope.conj().T @ rest) * powers.T).real
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(fisher))).reshape(len(axes), -1).T)
