"""Converged: whether the error that two launches of tubes state is a figure, and what a run tells of it."""

from __future__ import annotations

import math

import numpy as np

from raychan.channel.rcs import stated_error

SCATTER = math.sqrt(4.0 / math.pi - 1.0)
"""Standard deviation over mean of a Rayleigh variable: of the size of the difference of two launches, which is the sum
of many tubes' errors and so complex Gaussian."""

LARGEST = 0.6934
"""Of a value: the largest error x whose level error -20 log10(1 - x) dB is a figure. There x (1 +- SCATTER), which is
how well one difference tells x, moves the level error by as much as it is: SCATTER x / (1 - x) = -ln(1 - x). Beyond it
the level error runs off to infinity, which it reaches at x = 1, where the value may as well be 0."""

LARGEST_DB = -20.0 * math.log10(1.0 - LARGEST)
"""The same as a level error: 10.3 dB."""


def figure(power: float, error: float) -> float:
    """Return the error [dB] to state of a power [W] when two launches differ by an error [W]; NaN where that is no
    figure, for it is above LARGEST_DB."""
    stated = stated_error(complex(np.sqrt(power)), float(np.sqrt(error)))
    return stated if stated <= LARGEST_DB else math.nan
