"""Side lobes of several like echoes in one range cell add in phase: no detections, against weak echoes there."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.peaks import MARGIN, SUMMED, together
from raychan.radar.array import uniform_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of, noise_of_cell
from raychan.signal.baseband import synthesize
from raychan.units import C0, undb

WAVE = Waveform(77e9, 3e8, 20e-6, 22e-6, n_chirps=64, n_samples=64)


def found(window, cells, levels_db, azimuth, rng):
    """Return the rates [resolution cells] of detections of echoes in one range cell, dB below 60 dB of SNR."""
    settings, elements = Processing(rate_window=window), uniform_array(4, 0.5 * C0 / 77e9)
    radar = make_radar(WAVE, elements=elements, processing=settings, noise=True)
    level = np.sqrt(undb(60.0 + np.asarray(levels_db)) * noise_of_cell(radar, settings) / 4)
    rates = np.asarray(cells) * WAVE.rate_resolution
    waves = level * np.exp(2j * np.pi * rng.uniform(size=len(cells)))
    sent = echoes(12.3 - rates * WAVE.centre, rates, waves, azimuth)
    return detections_in(map_of(synthesize(sent, radar, rng), radar, settings), radar, settings).rate / (
        WAVE.rate_resolution
    )


@pytest.mark.parametrize("window", ["hamming", "taylor(45)"])
def test_side_lobes_of_three_like_echoes_are_no_detections(window):
    rng = np.random.default_rng(11)
    for _ in range(25):
        cells = -22.0 + np.cumsum(rng.uniform(5.0, 12.0, 3))
        seen = found(window, cells, -rng.uniform(0.0, 1.0, 3), rng.uniform(-0.7, 0.7), rng)
        assert np.sort(seen) == pytest.approx(cells, abs=0.2)


@pytest.mark.parametrize("window", ["hann", "hamming", "taylor(45)"])
@pytest.mark.parametrize("weaker_db", [26.0, 33.0])
def test_a_weak_echo_beside_two_strong_ones_is_found(window, weaker_db):
    rng = np.random.default_rng(12)
    for _ in range(8):
        cells = np.array([-10.2, 3.0, rng.choice([-22.0, -4.0, 9.0, 20.0]) + rng.uniform()])
        seen = found(window, cells, [0.0, -0.5, -weaker_db], rng.uniform(-0.7, 0.7), rng)
        # Side lobes 10 dB below it move its peak by up to 0.51 cells (so does the map padded 16 times).
        assert abs(seen - cells[2]).min() < 0.52


def test_the_strongest_side_lobes_add_as_amplitudes_the_others_as_powers():
    alike = np.ones(SUMMED + 2)
    assert together(alike) == pytest.approx(SUMMED**2 + 2.0 * MARGIN)
    assert together(alike[:1]) == MARGIN
    assert together(alike[:2]) == pytest.approx(4.0)
    assert together(np.array([[4.0, 1.0], [1.0, 1.0], [1.0, 1.0]])) == pytest.approx([16.0, 9.0])
