"""The method of moments for a strip loses no energy: what it scatters is what it takes from the wave ahead."""

import numpy as np
import pytest

from truth.strip import strip


@pytest.mark.parametrize("along", ["E", "H"])
@pytest.mark.parametrize("width, arrival", [(3.0, 0.0), (3.0, 0.7), (10.0, 0.7)])
def test_scattered_power_is_what_the_forward_wave_loses(along, width, arrival):
    directions = np.linspace(0.0, 2.0 * np.pi, 145)[:-1]
    power = np.mean(np.abs(strip(width, arrival, directions, along)[0]) ** 2)
    forward = strip(width, arrival, -arrival, along)[0].real
    assert power == pytest.approx(4.0 * forward, rel=2e-3)
