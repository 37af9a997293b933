"""Folds of weak echoes among the side lobes of a strong one of another fold: right, or told to be open."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.fold_beside import judged_beside
from raychan.processing.slots import Slots
from raychan.radar.aperture import Aperture
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0

WAVE = Waveform(77e9, 300e6, 20e-6, repetition=40e-6, n_chirps=96, n_samples=64)
HALF = 0.5 * C0 / WAVE.middle
PLACES = HALF * np.array([0.0, 0.7, 1.6, 2.1, 3.0])
RADAR = make_radar(
    WAVE, noise=True, multiplexing="tdm", elements=np.outer(PLACES, [0.0, 1.0, 0.0]),
    tx_elements=np.array([[0.0, -4.0 * HALF, 0.0], [0.0, 4.0 * HALF, 0.0]]),
    processing=Processing(range_window="rect", rate_window="hamming", pad=(3, 1)),
)  # fmt: skip


@pytest.mark.parametrize("fold", [0, 1])
def test_beside_a_known_wave_the_fold_is_that_of_the_other_one(fold):
    aperture, slots = Aperture(RADAR.virtual_elements, C0 / WAVE.middle), Slots.of(RADAR, 2, "rect")
    for seed in range(20):
        rng = np.random.default_rng(seed)
        cosines = np.stack([rng.uniform(-0.8, -0.1), rng.uniform(0.1, 0.8)])[:, None] * [1.0, 0.0]
        known, wave = (slots.waves(aperture.steering(x[None]), [h]) for x, h in zip(cosines, (0.3, fold), strict=True))
        turn = np.exp(2j * np.pi * rng.random())
        assert judged_beside(0.7 * turn * known[0] + wave[0], known, aperture, slots, 1e-3) == (fold, False)


def test_a_weak_echo_of_another_fold_among_range_side_lobes_is_not_taken_for_one_of_their_fold():
    span, right = 2.0 * RADAR.channel_waveform.unambiguous_rate, 0
    for seed in range(38, 51):
        rng = np.random.default_rng(seed)
        rates, azimuth = np.array([8.13, 8.6]) * WAVE.rate_resolution - [0.0, span], rng.uniform(-0.7, 0.7, 2)
        ranges = 8.0 - np.array([0.0, rng.uniform(2.8, 5.2)]) * WAVE.range_resolution
        level = RADAR.noise_power / (5 * 96 * 64) * 10.0 ** np.array([5.4, 3.4])
        sent = echoes(ranges - rates * WAVE.centre, rates, np.sqrt(level) * np.exp(6.3j * rng.random(2)), azimuth)
        found = detections_in(map_of(synthesize(sent, RADAR, rng), RADAR, RADAR.processing), RADAR, RADAR.processing)
        beside = np.abs(found.range - ranges[1]) < WAVE.range_resolution
        wrong = np.abs(found.rate - rates[1] - span) < 2.0 * WAVE.rate_resolution
        assert not (beside & wrong & ~found.ambiguous).any(), seed
        right += (beside & (np.abs(found.rate - rates[1]) < 0.5 * WAVE.rate_resolution)).any()
    assert right >= 10
