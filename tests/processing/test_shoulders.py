"""Shoulders of a map: echoes on the slope of a stronger one, against maps made by the windows' response."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.processing.cfar import Grid
from raychan.processing.peaks import SideLobes, maxima, strongest

PAD, COUNT = (2, 4), (16, 64)
SHAPE = PAD[0] * COUNT[0], PAD[1] * COUNT[1]


def _map(*echoes: tuple[float, float, complex]) -> np.ndarray:
    """Return the power of a map of echoes (rate, range [resolution cells], amplitude), both windows hann."""
    samples = np.zeros(COUNT, complex)
    for rate, reach, amplitude in echoes:
        turns = [np.exp(2j * np.pi * x * np.arange(n) / n) for x, n in zip((rate, reach), COUNT, strict=True)]
        samples += amplitude * turns[0][:, None] * turns[1]
    tapers = [np.hanning(n + 1)[:-1] for n in COUNT]
    return np.abs(np.fft.fft2(samples * tapers[0][:, None] * tapers[1], SHAPE)) ** 2


def _shoulders(power: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    grid = Grid(PAD, COUNT)
    peaks, cells = maxima(power, 0.1 * power.max()), strongest(power, grid)
    cells = cells[power[tuple(cells.T)] > 1e-6 * power.max()]
    return peaks, *SideLobes(grid, ("hann", "hann")).shoulders(power, PAD, peaks, cells)


def test_one_echo_alone_has_no_shoulder():
    for reach in (20.0, 20.3, 63.5):
        _, cells, _ = _shoulders(_map((5.0, reach, 1.0)))
        assert not len(cells)


@pytest.mark.parametrize("beside", [1.6, -1.6])
def test_an_echo_on_the_slope_of_a_stronger_one_is_a_shoulder(beside):
    power = _map((5.0, 20.0, 1.0), (5.0, 20.0 + beside, 0.35j * np.sign(beside)))
    peaks, cells, most = _shoulders(power)
    assert (len(peaks), len(cells)) == (1, 1)
    assert np.abs(cells[0] / PAD - (5.0, 20.0 + beside)).max() <= 0.75
    # It would have to exceed what lies within a resolution cell of it, and does not.
    rows, columns = ((cells[0][i] + np.arange(-PAD[i], PAD[i] + 1)) % SHAPE[i] for i in (0, 1))
    assert most[0] == power[np.ix_(rows, columns)].max() > power[tuple(cells[0])]


def test_the_strongest_cells_are_those_of_a_loop_over_all_resolution_cells():
    power = np.random.default_rng(1).random(SHAPE)
    found = {tuple(c) for c in strongest(power, Grid(PAD, COUNT)).tolist()}
    for i in range(COUNT[0]):
        for j in range(COUNT[1]):
            own = [(PAD[0] * i + a, PAD[1] * j + b) for a in range(PAD[0]) for b in range(PAD[1])]
            assert max(own, key=lambda c: power[c]) in found
    assert len(found) == COUNT[0] * COUNT[1]
