"""As many unknowns as data: other sets of waves leave nothing of a cell either, so its directions are no sure ones."""

from __future__ import annotations

import numpy as np
import pytest
from support.arrays import noise, plane

from raychan.processing.angles import echoes_in
from raychan.processing.scan import Scan
from raychan.radar.aperture import Aperture

NOISE = 1e-5


@pytest.mark.parametrize(("rows", "columns", "most", "draws"), [(2, 2, 2, 40), (2, 3, 3, 20), (3, 3, 4, 6)])
def test_echoes_that_have_as_many_unknowns_as_an_array_has_data_are_unsure(rows, columns, most, draws):
    aperture = Aperture(plane(rows, columns), 1.0)
    scan, size, seen = Scan(aperture, "bartlett", 1e3), rows * columns, set()
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        at = rng.uniform(-0.65, 0.65, (most, 2))
        wave = np.exp(2j * np.pi * rng.random(most)) @ aperture.steering(at) + noise(rng, size) * np.sqrt(NOISE)
        held = echoes_in(wave, scan, 17.0 * NOISE / size, 1e6)
        count = len(held.power)
        seen.add(count)
        # Two cosines, an amplitude and a phase each, of two numbers by element.
        assert 4 * count < 2 * size or held.unsure(aperture).all()
    assert size % 2 or most in seen


@pytest.mark.parametrize("shape", [(2, 2), (2, 3), (3, 3)])
def test_a_lone_echo_is_sure(shape):
    aperture = Aperture(plane(*shape), 1.0)
    held = echoes_in(aperture.steering(np.array([[0.2, -0.1]]))[0], Scan(aperture, "bartlett", 1e3), NOISE, 1e6)
    assert len(held.power) == 1 and not held.unsure(aperture).any()
