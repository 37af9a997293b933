"""Level and place of lone echoes between the cells of a map, and of echoes that merge."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.detection import detect
from raychan.processing.main_lobe import MainLobe
from raychan.processing.range_doppler import range_doppler
from raychan.radar.waveform import Waveform
from raychan.signal.baseband import synthesize
from raychan.units import db

WINDOWS = ("rect", "hann", "hamming", "blackman", "taylor", "taylor(20)", "chebyshev", "chebyshev(40)")
WAVE = Waveform(77e9, 300e6, 30e-6, 30e-6, 64, 128)


def _seen(paths, wave, window, pad):
    cube = synthesize(paths, make_radar(wave), np.random.default_rng(0))
    return range_doppler(cube, wave, window, window, pad)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("pad", [(1, 1), (2, 2), (1, 2), (4, 4)])
@pytest.mark.parametrize("real", [False, True])
def test_a_lone_echo_anywhere_between_cells_reads_its_power_range_and_rate(window, pad, real):
    wave = Waveform(77e9, 300e6, 30e-6, 30e-6, 64, 128, complex_sampling=not real)
    rng = np.random.default_rng(8)
    for _ in range(3):
        reach, rate = rng.uniform(12.0, 18.0), rng.uniform(-8.0, 8.0)
        found = detect(_seen(echoes([reach], rate, 1e-3), wave, window, pad), windows=(window, window), waveform=wave)
        # By real sampling an echo's image shows through the side lobes of some windows.
        near = 10.0 if real and window in ("rect", "taylor(20)", "chebyshev(40)") else 1.0
        assert db(found.power[0]) == pytest.approx(-60.0, abs=0.015 * near)
        assert abs(found.range[0] - reach - rate * wave.centre) < 1e-3 * near * wave.range_resolution
        assert abs(found.rate[0] - rate) < 0.01 * wave.rate_resolution


@pytest.mark.parametrize("chirps", [3, 4, 16])
def test_few_chirps_skew_a_lone_echo_between_range_and_rate_and_it_reads_its_power(chirps):
    wave = Waveform(77e9, 300e6, 30e-6, 30e-6, chirps, 128)
    for k in range(8):
        found = detect(_seen(echoes([14.0 + 0.07 * k], 0.0, 1e-3), wave, "hann", (2, 2)), waveform=wave)
        assert db(found.power[0]) == pytest.approx(-60.0, abs=0.03)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize(
    ("n", "pad"), [(n, pad) for n in (2, 3, 4, 5, 64, 1000) for pad in (1, 2, 3, 8) if n * pad > 2]
)
def test_offsets_and_levels_are_those_of_the_windows_response(window, pad, n):
    lobe, shift = MainLobe(window, n, pad), np.linspace(-0.499, 0.499, 99)
    off, gain = lobe.between(*(lobe(shift - step) for step in (-1.0, 0.0, 1.0)))
    assert np.abs(off - shift).max() < 0.01 and np.abs(lobe(shift) + gain).max() < 2e-3


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("pad", [1, 2])
def test_the_place_is_continuous_in_the_neighbours_whatever_they_are(window, pad):
    lobe, levels = MainLobe(window, 64, pad), np.linspace(-8.0, 0.0, 801)
    for below in (-6.0, -2.0, -0.5):
        off, gain = lobe.between(np.full(801, below), np.zeros(801), levels)
        assert np.abs(np.diff(off)).max() < 0.05 and np.abs(np.diff(gain)).max() < 0.05
