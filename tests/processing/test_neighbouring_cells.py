"""Two echoes whose cells overlap, of directions that an array tells apart: each is detected once, wherever it peaks."""

import numpy as np
import pytest
from support.arrays import line
from support.echoes import SMALL, echoes, make_radar

from raychan.processing.detection import detect
from raychan.processing.range_doppler import range_doppler
from raychan.signal.baseband import synthesize
from raychan.units import C0


@pytest.mark.parametrize("pad", [(1, 1), (2, 2), (1, 3)])
def test_two_echoes_part_of_a_cell_apart_are_two_whatever_the_map_shows_between_them(pad):
    rng, elements = np.random.default_rng(5), line(12) * C0 / SMALL.middle
    for _ in range(12):
        off, sign = rng.uniform(0.0, 1.0, 2), rng.choice([-1.0, 1.0], 2)
        ranges = 6.0 + rng.random() + np.array([0.0, sign[0] * off[0] * SMALL.range_resolution])
        rates = rng.uniform(-2.0, 2.0) + np.array([0.0, sign[1] * off[1] * SMALL.rate_resolution])
        sines = rng.uniform(-0.6, 0.1) + np.array([0.0, 0.5])
        amplitudes = 1e-3 * 10.0 ** (rng.uniform(-6.0, 0.0, 2) / 20.0) * np.exp(2j * np.pi * rng.random(2))
        paths = echoes(ranges, rates, amplitudes, np.arcsin(sines))
        cube = synthesize(paths, make_radar(SMALL, elements=elements, noise=True), rng)
        found = detect(range_doppler(cube, SMALL, pad=pad), waveform=SMALL, elements=elements)
        np.testing.assert_allclose(np.sort(np.sin(found.azimuth)), sines, atol=0.03)
        order = np.argsort(found.azimuth)
        # The range at the middle of the frame, as rates lead there.
        there = ranges + rates * SMALL.centre
        np.testing.assert_allclose(found.range[order], there, atol=0.3 * SMALL.range_resolution)
        np.testing.assert_allclose(found.rate[order], rates, atol=0.3 * SMALL.rate_resolution)
