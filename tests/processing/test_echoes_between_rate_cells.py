"""Strong echoes beside the rate cells of several transmitters' maps: plane waves at their own rates, seen once."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.staggered import ResolvedMap
from raychan.radar.array import mimo_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

WAVE = Waveform(77e9, 436.8e6, 20e-6, repetition=25e-6, n_chirps=48, n_samples=128)
NARROW = replace(WAVE, bandwidth=4e6)
"""A range cell so long that all elements see an echo at its place."""
STEP = 0.5 * C0 / WAVE.middle


def made(many, receivers, multiplexing, window="rect", pad=1, wave=WAVE):
    settings = Processing(range_window=window, rate_window=window, pad=(pad, pad))
    array = mimo_array(many, receivers, STEP)
    return make_radar(wave, **array, multiplexing=multiplexing, processing=settings, noise=True)


@pytest.mark.parametrize("window", ["rect", "hann", "taylor(30)"])
@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_what_slots_hold_of_an_echo_between_rate_cells_is_a_plane_wave_at_its_own_rate(multiplexing, window):
    radar, azimuth, part = made(3, 3, multiplexing, window, wave=NARROW), 0.4, 0.41
    rate = (2.0 + part) * radar.channel_waveform.rate_resolution
    map = map_of(synthesize(echoes(1000.0 - rate * WAVE.centre, rate, 1.0, azimuth), radar), radar, radar.processing)
    assert isinstance(map, ResolvedMap)
    v, r = np.unravel_index(map.power.argmax(), map.power.shape)
    held = map.read(v, r, map.fold[v, r] + part / len(map.rate))
    wave = np.exp(2j * np.pi * radar.virtual_elements[:, 1] * np.sin(azimuth) / (C0 / NARROW.middle))
    wave = np.concatenate([wave, np.zeros(len(held) - len(wave))])
    assert np.abs(held / (wave.conj() @ held / (wave.conj() @ wave)) - wave).max() < 2e-4


def lone(radar, seed):
    """Return the detections of a random echo 66 dB over the noise of all samples of one receiver, and its azimuth."""
    rng = np.random.default_rng(seed)
    rate, azimuth, place = rng.uniform(-0.9, 0.9) * radar.resolved_rate, rng.uniform(-1.0, 1.0), rng.uniform(5.0, 30.0)
    level = radar.noise_power / (3 * WAVE.n_chirps * WAVE.n_samples) * 10.0**6.6
    sent = echoes(place - rate * WAVE.centre, rate, np.sqrt(level), azimuth)
    return detections_in(
        map_of(synthesize(sent, radar, rng), radar, radar.processing), radar, radar.processing
    ), azimuth


@pytest.mark.parametrize(
    "radar", [made(3, 3, "ddm"), made(2, 5, "ddm", pad=2), made(3, 2, "tdm"), made(3, 2, "tdm", "taylor(40)", 2)]
)
def test_a_lone_strong_echo_is_seen_once_from_its_direction_wherever_it_lies_between_cells(radar):
    for seed in range(14):
        found, azimuth = lone(radar, seed)
        assert np.degrees(found.azimuth - azimuth) == pytest.approx([0.0], abs=0.06)


def test_side_lobes_along_rate_by_time_division_are_turned_as_their_echo_is():
    radar = made(2, 4, "tdm", "taylor(40)", 2)
    for seed in range(26, 42):
        assert len(lone(radar, seed)[0].range) == 1


@pytest.mark.parametrize(
    ("stagger", "window", "pad"),
    [((40e-6, 50e-6, 60e-6), "taylor(60)", 3), ((), "rect", 2), ((), "hann", 3)],
)
def test_an_echo_over_the_end_of_the_rates_has_the_level_and_rate_of_one_beside_it(stagger, window, pad):
    settings = Processing(range_window="rect", rate_window=window, pad=(1, pad))
    array = {} if stagger else {**mimo_array(2, 3, STEP), "multiplexing": "tdm"}
    wave = replace(WAVE, repetition=None if stagger else 40e-6, stagger=stagger)
    radar = make_radar(wave, **array, processing=settings, noise=True)
    cells, level = radar.channel_waveform, radar.noise_power / (WAVE.n_chirps * WAVE.n_samples) * 10.0**6
    for over, place in product(np.linspace(-1.5, 0.5, 9), 10.0 + WAVE.range_resolution * np.array([0.0, 0.5, 0.7])):
        rate = cells.unambiguous_rate + over * cells.rate_resolution
        sent = echoes(place - rate * wave.centre, rate, np.sqrt(level), 0.2)
        map = map_of(synthesize(sent, radar, np.random.default_rng(1)), radar, radar.processing)
        found = detections_in(map, radar, radar.processing)
        assert db(found.power / level) == pytest.approx([0.0], abs=0.02)
        assert (found.rate - rate) / cells.rate_resolution == pytest.approx([0.0], abs=0.02)
