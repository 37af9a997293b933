"""The power-delay profile: lone paths, resolution, noise, and no side lobe among the peaks."""

import numpy as np
import pytest
from support.echoes import SMALL, WIDE, echoes

from raychan.radar.windows import NAMES
from raychan.signal.delay_profile import profile
from raychan.units import C0, db


@pytest.mark.parametrize("window", NAMES)
def test_a_lone_path_is_one_peak_with_its_received_power(window):
    at = 37.25 * SMALL.range_resolution
    p = profile(echoes([at], amplitudes=1e-3j), SMALL, 0.5, 0.0, window)
    assert len(p.peaks) == 1
    assert abs(p.range[p.peaks[0]] - at) < 1e-6 and abs(db(p.power.max() / 0.5e-6)) < 0.01


def test_profile_is_the_windowed_sum_over_the_band():
    rng = np.random.default_rng(1)
    paths = echoes(rng.uniform(0, 19, 30), 0.0, rng.normal(size=30) + 1j * rng.normal(size=30))
    p = profile(paths, SMALL, 2.0, 0.0, "rect")
    f = SMALL.bandwidth * np.arange(128) / 128
    response = np.exp(-2j * np.pi * f[:, None] * paths.delay) @ paths.amplitude
    slow = np.abs(np.exp(2j * np.pi * np.outer(2 * p.range / C0, f)) @ response / 128) ** 2 * 2.0
    assert np.allclose(p.power, slow, atol=1e-5 * slow.max())


def test_two_paths_two_hann_cells_apart_are_two_peaks_and_one_cell_apart_are_not():
    for cells, count in ((3.0, 2), (0.8, 1)):
        r = 5.0 + np.array([0.0, cells]) * WIDE.range_resolution
        p = profile(echoes(r, 0.0, np.exp(-2j * np.pi * np.array([0, 0.25]))), WIDE, 1.0)
        assert len(p.peaks) == count


def test_peaks_stand_above_the_noise_of_one_ramp_strongest_first():
    noise = 1e-12
    floor = noise * 1.5 / 128  # Hann: sum w^2 / (sum w)^2 is 3/2n for long windows
    paths = echoes([3.0, 9.0, 15.0], 0.0, np.sqrt(floor * np.array([100.0, 3.0, 1000.0])))
    p = profile(paths, SMALL, 1.0, noise, "hann")
    assert p.noise == pytest.approx(floor, rel=0.02)
    assert np.allclose(p.range[p.peaks], [15.0, 3.0], atol=0.5 * SMALL.range_resolution)


def test_no_paths_give_an_empty_profile():
    p = profile(echoes([]), SMALL, 1.0)
    assert not p.power.any() and not len(p.peaks)
