"""Error of physical optics at the terminator of a smooth body, where its currents end abruptly and true ones do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.poses import theta_phi

Floats = NDArray[np.float64]

TERMINATOR = 0.25
"""Of 1 / k: backwards, the amplitude of the terminator of a sphere of any radius, where currents of physical optics
end, against Mie's series."""
_FOCK = 0.25  # of the amplitude of Fock's belt: its error where PO currents end smoothly (not measured by itself)


def terminator_error(area: float, to_tx: Floats, to_rx: Floats, wavenumber: float, row: int, col: int) -> float:
    """Return the error [m] of a bistatic amplitude of a smooth convex body due to its terminator.

    The terminator is taken as a ring of radius a, that of a sphere of the body's area. Its two specular points scatter
    a sqrt(2 / (pi k a sin g)) D at an angle g off the forward direction, over a depth k D = 1 / (1 - cos g) that is at
    most Fock's belt of half-shadow, k a (2 / k a)^(1/3) (Fock 1946). In the bistatic plane PO currents end with full
    strength, of which sin g is seen, all of it false; across that plane they end smoothly.
    Args: area [m^2] of the body's surface; to_tx, to_rx (3,) from the body to the ends; wavenumber [1/m]; row, col
    polarisation (V, H) of receiver and transmitter.
    Source: Bowman, Senior, Uslenghi, Electromagnetic and Acoustic Scattering by Simple Shapes, 1969, ch. 10.
    """
    tx, rx = (np.asarray(x / np.linalg.norm(x), float) for x in (to_tx, to_rx))
    cosine = float(np.clip(-tx @ rx, -1.0, 1.0))
    sine = float(np.sqrt(1.0 - cosine**2))
    size = wavenumber * float(np.sqrt(area / (4.0 * np.pi)))
    ring = size * min(1.0, float(np.sqrt(2.0 / (np.pi * size * max(sine, 1e-12)))))
    depth = 1.0 / (1.0 - cosine + (0.5 / size**2) ** (1.0 / 3.0))
    within = 1.0
    if sine > 1e-6:
        across = np.cross(tx, rx) / sine
        for end, which in ((tx, col), (rx, row)):
            within *= float(np.linalg.norm(np.cross(theta_phi(end[None])[which][0], across)))
    smooth = _FOCK * 0.5 * (1.0 + cosine)
    return ring * depth * (within * sine + smooth) / wavenumber
