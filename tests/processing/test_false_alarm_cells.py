"""Of which cell the probability of false alarm is: what docs/theory.md says of padded maps."""

import numpy as np
import pytest
from support.echoes import make_radar

from raychan.processing.cfar import Grid, training
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import noisy

WAVE = Waveform(77e9, 300e6, 30e-6, n_chirps=64, n_samples=128)
PFA = 1e-3


def alarms(cfar: str, window: str, pad: int) -> float:
    """Return the detections of noise alone a resolution cell, over the probability of false alarm."""
    settings = Processing(range_window=window, rate_window=window, pad=(pad, pad), cfar=cfar, pfa=PFA, min_snr_db=-50.0)
    radar, frames = make_radar(WAVE, noise=True, processing=settings), 80
    quiet = Cube(samples=np.zeros((1, WAVE.n_chirps, WAVE.n_samples), np.complex64), noise_power=0.0)
    maps = (map_of(noisy(quiet, radar, np.random.default_rng(seed)), radar, settings) for seed in range(frames))
    found = sum(len(detections_in(one, radar, settings).range) for one in maps)
    return found / (frames * WAVE.n_chirps * WAVE.n_samples * PFA)


def test_padded_maps_have_more_false_alarms_a_resolution_cell_than_pfa_and_plain_ones_about_as_many():
    """At 1e-3 some 650 are expected: 4 % of deviation."""
    plain, ordered, averaged = alarms("os", "rect", 1), alarms("os", "hann", 2), alarms("ca", "hann", 2)
    assert 0.84 < plain < 1.16 < ordered < averaged < 2.2
    assert 0.25 < ordered / 4.0 < 0.56


@pytest.mark.parametrize(("even", "odd"), [(0, 1), (2, 3)])
def test_an_even_guard_is_the_same_as_the_odd_one_above(even, odd):
    one, other = (training(Grid((2, 2), (64, 128)), (n, n), (3, 3)) for n in (even, odd))
    np.testing.assert_array_equal(one.offsets, other.offsets)
