"""77 GHz, and directions to infinitely far ends, for tests of the closed forms."""

from __future__ import annotations

import numpy as np
from truth import po

C0 = 299_792_458.0


K = 2 * np.pi * 77e9 / C0


LAM = C0 / 77e9


HEAD_ON = po.direction(0.0)


def sigma(s):
    """Return the radar cross-section [m^2] of an amplitude [m]."""
    return 4 * np.pi * np.abs(s) ** 2


def far(azimuth, elevation=0.0):
    """Return an infinitely far end in a direction [rad]."""
    return po.direction(azimuth, elevation), np.inf
