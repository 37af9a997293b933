"""Local maxima above a threshold, against a filter that looks at every cell."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from raychan.processing.peaks import maxima


@pytest.mark.parametrize("shape", [(64, 128), (5, 40), (1, 30), (2, 2)])
@pytest.mark.parametrize("levels", [1, 4, None])
def test_maxima_are_the_cells_that_no_neighbour_exceeds_both_axes_wrapped(shape, levels):
    """With few levels many neighbours are equal: all cells of such a plateau are maxima."""
    rng = np.random.default_rng(3)
    power = rng.random(shape) if levels is None else rng.integers(levels, size=shape).astype(float)
    for least in (-1.0, 0.6, 2.0, 9.0):
        expected = np.argwhere((power >= maximum_filter(power, size=3, mode="wrap")) & (power > least))
        np.testing.assert_array_equal(maxima(power, least), expected)
