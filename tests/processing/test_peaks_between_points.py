"""The greatest maximum of a spectrum may lie between points of the search, which show another one greater."""

from __future__ import annotations

import numpy as np
import pytest
from support.arrays import noise

import raychan as rc
from raychan.radar.aperture import Aperture, cosines

RIDGE = 1e-3
"""Of the power: of arrays with depth beams far aside are ridges along which a search ends a little early."""


def power(elements, wave, found) -> float:
    """Return the power of a beam towards directions found, over the noise in it."""
    beam = Aperture(elements, 1.0).steering(cosines(found.azimuth, found.elevation))
    return float(np.abs(beam.conj() @ wave)[0] ** 2) / len(elements)


@pytest.mark.parametrize("method", ["bartlett", "music", "capon"])
@pytest.mark.parametrize(("count", "half", "deep"), [(5, 2.0, 0.0), (6, 4.0, 0.0), (8, 8.0, 0.0), (6, 3.0, 3.0)])
def test_no_beam_of_thin_arrays_is_stronger_than_that_of_the_direction_given(count, half, deep, method):
    for seed in range(100 if method == "bartlett" else 20):
        rng = np.random.default_rng(seed)
        elements = rng.uniform(-1.0, 1.0, (count, 3)) * [deep, half, half]
        true = cosines(rng.uniform(-1.2, 1.2), rng.uniform(-0.6, 0.6))
        own = Aperture(elements, 1.0).steering(true)[0]
        wave = own * np.sqrt(10.0 ** rng.uniform(2.5, 5.0) / count) + noise(rng, 1, count)[0]
        found = rc.doa(wave, elements, 1.0, method, sources=1)
        least = (1.0 - RIDGE * (deep > 0.0)) * np.abs(own.conj() @ wave)[()] ** 2 / count - 12.0
        assert power(elements, wave, found) > least
