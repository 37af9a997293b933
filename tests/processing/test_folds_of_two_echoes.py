"""Folds by time division: of two like echoes in a cell that of both, of a lone echo on its slopes and side lobes its
own; and what a few beams explain."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.fold_beams import Beams, squared
from raychan.radar.array import mimo_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of, noise_of_cell
from raychan.signal.baseband import synthesize
from raychan.units import C0, undb

HALF = 0.5 * C0 / 77e9


def found(radar, place, rate, azimuth, amplitudes, snr_db, seed):
    """Return the detections of echoes in one cell at `place` [m] at mid frame, of an SNR in their beam."""
    level = np.sqrt(undb(snr_db) * noise_of_cell(radar, radar.processing) / len(radar.virtual_elements))
    start = place - rate * radar.waveform.centre
    sent = echoes([start] * len(amplitudes), rate, level * np.asarray(amplitudes), azimuth)
    map = map_of(synthesize(sent, radar, np.random.default_rng(seed)), radar, radar.processing)
    return detections_in(map, radar, radar.processing)


@pytest.mark.parametrize(("many", "receivers"), [(5, 4), (4, 8), (3, 7), (6, 5)])
def test_two_like_echoes_in_a_cell_have_their_own_rate(many, receivers):
    wave = Waveform(77e9, 3e8, 20e-6, 22e-6, n_chirps=16 * many, n_samples=64)
    radar = make_radar(wave, **mimo_array(many, receivers, HALF), multiplexing="tdm", noise=True)
    rng, width = np.random.default_rng(5), 2.0 / (many * receivers)
    for seed in range(6):
        rate, sine = rng.uniform(-40.0, 40.0), rng.uniform(-0.5, 0.2)
        azimuth = np.arcsin([sine, sine + rng.uniform(1.6, 4.0) * width])
        weaker = 10.0 ** (-rng.uniform(0.0, 6.0) / 20.0) * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi))
        seen = found(radar, 15.2, rate, azimuth, [1.0, weaker], 36.0, seed)
        assert len(seen.rate) == 2
        assert seen.rate == pytest.approx(np.full(2, rate), abs=0.7)


@pytest.mark.parametrize(
    ("many", "receivers", "windows", "pad", "snr_db"),
    [
        (5, 2, ("rect", "rect"), (3, 3), 60.0),
        (6, 8, ("rect", "hann"), (2, 3), 55.0),
        (8, 3, ("hann", "rect"), (2, 3), 42.0),
        (8, 6, ("rect", "hamming"), (3, 3), 50.0),
    ],
)
def test_side_lobes_and_slopes_under_another_fold_are_no_detections(many, receivers, windows, pad, snr_db):
    wave = Waveform(77e9, 2e8, 12e-6, 14e-6, n_chirps=32 * many, n_samples=128)
    settings = Processing(range_window=windows[0], rate_window=windows[1], pad=pad)
    radar = make_radar(wave, **mimo_array(many, receivers, HALF), multiplexing="tdm", processing=settings, noise=True)
    rng = np.random.default_rng(6)
    for seed in range(3):
        rate, place = rng.uniform(-45.0, 45.0), rng.uniform(8.0, 80.0)
        seen = found(radar, place, rate, [rng.uniform(-1.0, 1.0)], [1.0], snr_db, seed)
        assert seen.rate == pytest.approx([rate], abs=0.5)


def test_two_beams_explain_two_plane_waves_and_one_does_not():
    wave = Waveform(77e9, 2e8, 12e-6, n_chirps=64, n_samples=64)
    beams = Beams.of(make_radar(wave, **mimo_array(4, 4, HALF), multiplexing="tdm"))
    cosines = np.array([[-0.1, 0.0], [0.1, 0.0]])
    values = np.array([[1.0, 0.8j], [1.0, -0.5]]) @ beams.weights(cosines).conj()
    one, at = beams.strongest([values.T.astype(np.complex64)] * 2, 0.0)
    two, directions = beams.fitted_together(values, at[0][:, None])
    total = len(beams.places) * squared(values).sum(axis=1)
    assert (one[0] < 0.9 * total).all()
    assert two == pytest.approx(total, rel=1e-3)
    assert np.sort(directions[..., 0]) == pytest.approx(np.array([[-0.1, 0.1]] * 2), abs=0.005)


def test_the_strongest_of_all_beams_of_a_wide_area_is_found_and_few_are_held_at_once():
    """The weights of all 190,000 beams are 18 MB, and more while they are made."""
    places = np.random.default_rng(7).uniform(-0.16, 0.16, (6, 3)) * [0.0, 1.0, 1.0]
    wave = Waveform(77e9, 2e8, 12e-6, n_chirps=64, n_samples=64)
    senders = np.array([[0.0, 0.05, 0.0], [0.0, -0.03, 0.0]])
    beams = Beams.of(make_radar(wave, elements=places, tx_elements=senders, multiplexing="ddm"))
    values = beams.weights(np.array([[0.31, -0.22], [-0.05, 0.4], [0.9, 0.1]])).conj().T
    assert len(beams.at) > 190_000 and not len(beams.array.skewed)
    tracemalloc.start()
    power, at = beams.strongest([values, 0.5 * values], np.inf)
    held = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert held < 24e6
    level = squared(beams.weights(beams.at) @ values)
    assert power == pytest.approx(np.outer([1.0, 0.25], level.max(axis=0)), rel=1e-5)
    assert (at == beams.at[level.argmax(axis=0)]).all()
