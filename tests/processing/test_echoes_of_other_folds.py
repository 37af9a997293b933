"""Echoes of one cell that are folded differently: each has its own place, rate, direction and level, as alone."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.slots import Slots
from raychan.radar.array import mimo_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

WAVE = Waveform(77e9, 436.8e6, 20e-6, repetition=25e-6, n_chirps=48, n_samples=128)
STEP = 0.5 * C0 / WAVE.middle


def found(radar, ranges, rates, levels_db, azimuth_deg):
    """Return the detections of echoes at ranges [m] at mid frame, of levels [dBW], sorted by their azimuths."""
    rates = np.asarray(rates)
    sent = echoes(ranges - rates * WAVE.centre, rates, 10.0 ** (np.asarray(levels_db) / 20.0), np.radians(azimuth_deg))
    seen = detections_in(map_of(synthesize(sent, radar), radar, radar.processing), radar, radar.processing)
    order = np.argsort(seen.azimuth)
    return seen.replace(**{name: getattr(seen, name)[order] for name in type(seen).__dataclass_fields__})


def made(many, receivers, multiplexing, slots=None, window="hann", pad=(2, 2)):
    settings = Processing(range_window=window, rate_window=window, pad=pad)
    return make_radar(
        WAVE, **mimo_array(many, receivers, STEP), multiplexing=multiplexing, ddm_slots=slots, processing=settings
    )


@pytest.mark.parametrize(
    ("radar", "below"),
    [
        (made(2, 6, "ddm"), 7.3),
        (made(3, 4, "ddm"), 6.0),
        (made(3, 5, "ddm", 3, "rect", (1, 1)), 8.7),
        (made(3, 5, "tdm", window="rect", pad=(1, 1)), 3.0),
    ],
)
def test_two_echoes_of_a_cell_and_of_other_folds_are_seen_as_alone(radar, below):
    span = C0 / (2.0 * WAVE.middle * radar.slots * WAVE.repetition)
    for folds, off in ((1, 0.39), (-1, 0.2), (1, 0.05)):
        ranges = 10.923 + np.array([0.0, off * WAVE.range_resolution])
        rates = -0.3 * span + folds * span * np.array([0.0, 1.0]) + np.array([0.0, 0.1])
        seen = found(radar, ranges, rates, [-95.0, -95.0 - below], [-29.0, -10.0])
        assert seen.range == pytest.approx(ranges, abs=0.04 * WAVE.range_resolution)
        assert seen.rate == pytest.approx(rates, abs=0.05 * WAVE.rate_resolution)
        assert np.degrees(seen.azimuth) == pytest.approx([-29.0, -10.0], abs=0.2)
        assert db(seen.power) == pytest.approx([-95.0, -95.0 - below], abs=0.1)


@pytest.mark.parametrize("slots", [3, 4])
def test_four_echoes_of_a_cell_and_of_one_fold_keep_it(slots):
    radar, azimuth = made(3, 6, "ddm", slots), np.array([-41.3, -29.3, 2.3, 23.7])
    ranges, rates = 9.9 + np.array([0.02, -0.03, 0.05, 0.0]), np.array([-2.92, -2.92, -2.85, -2.87])
    seen = found(radar, ranges, rates, np.array([-103.7, -102.6, -99.2, -105.5]), azimuth)
    assert np.degrees(seen.azimuth) == pytest.approx(azimuth, abs=0.3)
    assert seen.rate == pytest.approx(rates, abs=0.05 * WAVE.rate_resolution)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_slots_read_under_one_fold_more_after_another_are_read_under_their_sum(multiplexing):
    slots = Slots.of(made(3, 4, multiplexing), 3, "hann")
    rng = np.random.default_rng(2)
    wave = (rng.normal(size=(1, 12)) + 1j * rng.normal(size=(1, 12))).astype(complex)
    for more in range(slots.count):
        held = slots.waves(wave, [more])[0]
        own = slots.read_under(slots.read_under(held, 1), more - 1)
        assert own[:12] == pytest.approx(wave[0], rel=1e-6)
        assert not own[12:].any()
