"""Folds of several transmitters: right where a wrong one looks like no other direction, told as ambiguous where it
does, whatever the margin between the two beams."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

import raychan as rc
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of, noise_of_cell
from raychan.signal.baseband import synthesize
from raychan.units import C0, undb

WAVE = Waveform(77e9, 2e8, 20e-6, n_chirps=60, n_samples=64)
HALF = 0.5 * WAVE.wavelength


def line(many: int, **changes):
    return make_radar(WAVE, **rc.mimo_array(many, 4, HALF), noise=True, **changes)


def stacked(apart: float):
    """Return a radar with two transmitters above each other and a line of receivers."""
    above = np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]]) * apart * WAVE.wavelength
    elements = rc.uniform_array(8, HALF)
    return make_radar(WAVE, tx_elements=above, elements=elements, multiplexing="tdm", noise=True)


def found(radar, rate, azimuth, snr_db, elevation=0.0, seed=1):
    level = np.sqrt(undb(snr_db) * noise_of_cell(radar, radar.processing) / len(radar.virtual_elements))
    cube = synthesize(echoes([20.0], rate, level, azimuth, elevation), radar, np.random.default_rng(seed))
    return detections_in(map_of(cube, radar, radar.processing), radar, radar.processing)


def share_lost(radar, rate, azimuth) -> float:
    """Return the least share of an echo's power that a wrong fold takes from every beam, by Doppler division with as
    many slots as transmitters: it moves the values of each transmitter to the next."""
    many, look = len(radar.tx_elements), np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    wave = np.exp(2j * np.pi / (C0 / WAVE.middle) * (radar.virtual_elements @ look)).reshape(many, -1)
    sines = np.linspace(-1.0, 1.0, 4001)
    places = radar.virtual_elements[:, 1]
    beams = np.exp(-2j * np.pi / (C0 / WAVE.middle) * np.outer(sines, places)) / len(places)
    return 1.0 - max(float((np.abs(beams @ np.roll(wave, h, axis=0).ravel()) ** 2).max()) for h in range(1, many))


@pytest.mark.parametrize("many", [3, 4])
def test_without_an_empty_slot_rates_are_right_or_told_to_be_ambiguous(many):
    """Two beams that differ by 40 times the noise are clear: by 28 more than is asked for, three deviations."""
    radar, rng, clear = line(many, multiplexing="ddm", ddm_slots=many), np.random.default_rng(2), 0
    for seed in range(30):
        rate, azimuth, snr_db = rng.uniform(-45.0, 45.0), np.radians(rng.uniform(-60.0, 60.0)), rng.uniform(30.0, 48.0)
        seen = found(radar, rate, azimuth, snr_db, seed=seed)
        right = abs(seen.rate[0] - rate) < 0.3
        assert right or seen.ambiguous[0]
        if undb(snr_db) * share_lost(radar, rate, azimuth) > 40.0:
            assert right and not seen.ambiguous[0] and len(seen.rate) == 1
            clear += 1
    assert clear > 10


@pytest.mark.parametrize("rate", [30.0, 2.0])
@pytest.mark.parametrize("snr_db", [25.0, 40.0, 60.0])
def test_at_boresight_of_a_line_without_an_empty_slot_a_fold_is_open_and_the_slowest_is_given(rate, snr_db):
    radar = line(4, multiplexing="ddm", ddm_slots=4)
    seen = found(radar, rate, 0.0, snr_db)
    span = 2.0 * radar.waveform.unambiguous_rate / 4
    assert seen.ambiguous.all()
    assert seen.rate == pytest.approx([rate - span * np.rint(rate / span)], abs=0.1)
    spare = found(line(4, multiplexing="ddm"), rate, 0.0, snr_db)
    assert spare.rate == pytest.approx([rate], abs=0.1) and not spare.ambiguous.any()


@pytest.mark.parametrize("apart", [0.5, 1.0])
@pytest.mark.parametrize(
    ("rate", "azimuth", "elevation"), [(30.0, 2.0, 9.0), (-36.0, 10.0, -5.0), (40.0, 0.0, 2.0), (27.0, -1.0, -6.0)]
)
def test_transmitters_above_each_other_by_time_tell_rate_and_elevation_together_only(apart, rate, azimuth, elevation):
    radar = stacked(apart)
    seen = found(radar, rate, np.radians(azimuth), 38.0, np.radians(elevation))
    # Half a turn between the transmitters is a fold, or another elevation.
    other = np.sin(seen.elevation[0]) + np.array([-0.5, 0.0, 0.5]) / apart
    assert seen.ambiguous.all()
    assert abs(other - np.sin(np.radians(elevation))).min() < 0.05


def test_where_the_other_direction_is_no_real_one_a_fold_is_sure():
    """At 30 deg azimuth, half a wavelength apart: the other elevation would lie beyond the half space ahead."""
    seen = found(stacked(0.5), -15.0, np.radians(30.0), 37.0, np.radians(-2.0))
    assert seen.rate == pytest.approx([-15.0], abs=0.2) and not seen.ambiguous.any()


def test_lines_by_time_with_receivers_between_are_never_in_doubt():
    radar, rng = line(3, multiplexing="tdm"), np.random.default_rng(4)
    for seed in range(20):
        rate, azimuth = rng.uniform(-45.0, 45.0), rng.uniform(-0.8, 0.8)
        seen = found(radar, rate, azimuth, rng.uniform(25.0, 60.0), seed=seed)
        assert seen.rate == pytest.approx([rate], abs=0.3) and not seen.ambiguous.any()
