"""Sources spread onto a grid: all that is written lies within it, whatever the last digits of their rows."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.signal.nufft import kernel_polynomials, rows_under, spread


@pytest.mark.parametrize("width", [8, 16])
@pytest.mark.parametrize("row", [12.0, 24.0, 56.0, 20.5, 33.0])
@pytest.mark.parametrize("towards", [0.0, 1e9])
def test_sources_of_one_row_are_written_within_the_rows_that_they_are_given(width, row, towards):
    # Echoes of a scene where nothing moves: half a kernel above such a row the last digit is lost.
    x = np.full(3, np.nextafter(row, towards))
    y = np.array([0.5 * width, 0.5 * width + 3.3, 0.5 * width + 32.0])
    first, rows = rows_under(x, width)
    starts = np.ceil(x - first - 0.5 * width)
    assert starts.min() >= 0 and starts.max() + width <= rows
    cells = np.zeros((2, rows, 32 + width), complex)
    strength = np.ones((3, 2), complex) * [1.0, 2.0]
    spread(cells, cells.view(float).reshape(-1), x - first, y, strength, kernel_polynomials(width))
    wide = np.zeros((2, rows + 20, 52 + width), complex)
    spread(wide, wide.view(float).reshape(-1), x - first + 10, y + 10, strength, kernel_polynomials(width))
    np.testing.assert_allclose(cells[0], wide[0, 10 : 10 + rows, 10:-10], atol=1e-12)
    assert cells.sum() == pytest.approx(wide.sum(), rel=1e-12)


def test_rows_reach_from_the_first_sources_kernel_to_the_last_ones():
    x = np.random.default_rng(1).uniform(10.0, 40.0, 1000)
    first, rows = rows_under(x, 8)
    starts = np.ceil(x - 4.0)
    assert first == starts.min() and first + rows == starts.max() + 8
