"""Whether two launches of tubes agree well enough to state an error of a detection."""

from __future__ import annotations

import math

import numpy as np

from raychan.channel.error import LARGEST_DB, stated_error


def figure(power: float, error: float) -> float:
    """Return the error [dB] to state of a power [W] when two launches differ by an error [W]; NaN where it is above
    LARGEST_DB, which means that it is unknown."""
    stated = stated_error(complex(np.sqrt(power)), float(np.sqrt(error)))
    return stated if stated <= LARGEST_DB else math.nan
