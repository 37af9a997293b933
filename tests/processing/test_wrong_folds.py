"""Staggered ramps: the SNR told is that from which folds are right, wherever between two cells an echo lies."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

import raychan as rc
from raychan.processing.staggered import WRONG, least_snr, wrong_fold
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of, noise_of_cell
from raychan.signal.baseband import synthesize
from raychan.units import db, undb

FRAMES = 200


def radar_of(*stagger: float, **changes):
    wave = Waveform(77e9, 50e6, 30e-6, n_chirps=96, n_samples=64, stagger=tuple(1e-6 * t for t in stagger))
    return make_radar(wave, noise=True, processing=Processing(min_snr_db=15.0), **changes)


def wrong(radar, snr: float) -> float:
    """Return the share of wrong rates of fast echoes of some SNR, at random places between cells of 3 m."""
    rng, settings = np.random.default_rng(3), radar.processing
    level, top = np.sqrt(snr * noise_of_cell(radar, settings)), 0.97 * radar.waveform.resolved_rate
    off = []
    for seed in range(FRAMES):
        rate, place = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.0) * top, rng.uniform(60.0, 63.0)
        cube = synthesize(echoes([place], rate, level), radar, np.random.default_rng(seed))
        found = detections_in(map_of(cube, radar, settings), radar, settings)
        off.extend(abs(found.rate[:1] - rate) > 0.5 * radar.channel_waveform.unambiguous_rate)
    assert len(off) > 0.9 * FRAMES
    return float(np.mean(off))


@pytest.mark.parametrize("stagger", [(31.0, 34.0, 38.0), (30.0, 30.5)])
def test_from_the_snr_told_on_a_wrong_fold_is_rarer_than_1_in_100(stagger):
    radar = radar_of(*stagger)
    told = least_snr(radar)
    assert wrong(radar, told) <= WRONG
    # No needlessly high one is told: 0.7 dB are those of cells half beside an echo, 2 dB of rows between its rates.
    assert wrong(radar, told * undb(-5.0)) > WRONG


def test_more_noise_brings_more_wrong_folds_and_receivers_count_in_their_beam():
    radar, array = radar_of(40.0, 50.0), radar_of(40.0, 50.0, elements=np.arange(64.0)[:, None] * [0.0, 2e-3, 0.0])
    shares = [wrong_fold(undb(snr), radar) for snr in (20.0, 22.0, 24.0, 26.0)]
    assert shares == sorted(shares, reverse=True)
    # Noise against noise in the other receivers is all that the same SNR in a beam adds.
    assert 0.2 < db(least_snr(array) / least_snr(radar)) < 1.0


def test_a_wrong_fold_is_marked_as_folded_with_its_true_rate():
    wave = rc.Waveform(77e9, 300e6, 30e-6, n_chirps=96, n_samples=64, stagger=(30e-6, 30.5e-6))
    fast = rc.Body(
        "fast", shape="sphere", params={"radius": 0.05}, position=(15.0, 0.0, 0.5), velocity=(60.0, 0, 0), rcs_dbsm=8.0
    )
    for seed in range(2):
        found = rc.simulate(rc.Scene([fast], radar=rc.Radar(wave)), seed=seed).detections
        off = np.abs(found.rate - 60.0) > 1.0
        np.testing.assert_array_equal(found.folded, off)
        np.testing.assert_allclose(found.true_rate, 60.0, atol=0.1)
