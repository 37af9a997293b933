"""What the edges of perfect conductors scatter beyond physical optics: the fringe field of wedges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# rad: both parts are singular at the boundaries of shadow and reflection, where they cancel: the mean of both sides is
# taken, odd so that no usual angle meets a boundary.
_ASIDE = 1.37e-3


def fringe(n: Floats, phi: Floats, phi0: Floats) -> tuple[Floats, Floats]:
    """Return the fringe functions (w,) of wedges for a field and for a magnetic field along the edge.

    An edge of length L seen broadside has an RCS of f^2 L^2 / pi beyond physical optics. They are 0 inside the wedge.
    Args: n (w,) exterior angles over pi, above 1 to 2; phi, phi0 (w,) angles [rad] from face 0, through the exterior,
    to the receiver and to the transmitter.
    Source: Ufimtsev, Fundamentals of the Physical Theory of Diffraction, 2007, ch. 3 (f - f0, g - g0).
    """
    outside = (phi >= 0.0) & (phi <= n * np.pi) & (phi0 >= 0.0) & (phi0 <= n * np.pi)
    sides = [_beside(n, phi + off, phi0) for off in (_ASIDE, -_ASIDE)]
    soft, hard = (np.where(outside, 0.5 * (a + b), 0.0) for a, b in zip(*sides, strict=True))
    return soft, hard


def _beside(n: Floats, phi: Floats, phi0: Floats) -> tuple[Floats, Floats]:
    """Return f - f0 and g - g0 (w,) off the boundaries."""
    opening, edge = n * np.pi, np.cos(np.pi / n)
    near, far = (1.0 / (edge - np.cos(x / n)) for x in (phi - phi0, phi + phi0))
    whole = np.sin(np.pi / n) / n
    soft, hard = whole * (near - far), whole * (near + far)
    for out, back in ((phi, phi0), (opening - phi, opening - phi0)):
        lit = (back > 0.0) & (back < np.pi)
        over = np.where(lit, 1.0 / (np.cos(out) + np.cos(back)), 0.0)
        soft, hard = soft - np.sin(back) * over, hard + np.sin(out) * over
    return soft, hard
