"""Side lobes of echoes that an array tells apart within cells, windows without taper: none is a detection."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.cfar import Grid
from raychan.processing.peaks import SideLobes
from raychan.radar.array import mimo_array, uniform_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

WAVE = Waveform(77e9, 436.8e6, 20e-6, repetition=25e-6, n_chirps=48, n_samples=128)
STEP = 0.5 * C0 / WAVE.middle
PLANE = {"elements": uniform_array(6, STEP), "tx_elements": uniform_array(2, STEP, "z")}


def made(array, multiplexing, pad=(2, 2)):
    settings = Processing(range_window="rect", rate_window="rect", pad=pad)
    return make_radar(WAVE, **array, multiplexing=multiplexing, processing=settings)


def found(radar, reach, rate, levels_db, azimuth_deg, elevation_deg=0.0):
    """Return the detections of echoes at so many resolution cells from 10.9 m and 0 m/s at mid frame, and the places of
    the echoes (n, 2) [m, m/s]."""
    step = C0 / (2.0 * WAVE.middle * WAVE.frame_duration)
    ranges, rates = 10.9 + np.array(reach) * WAVE.range_resolution, np.array(rate) * step
    levels, angles = 10.0 ** (np.array(levels_db) / 20.0), np.radians(azimuth_deg)
    sent = echoes(ranges - rates * WAVE.centre, rates, levels, angles, np.radians(elevation_deg))
    map = map_of(synthesize(sent, radar), radar, radar.processing)
    return detections_in(map, radar, radar.processing), np.stack([ranges, rates], axis=1)


@pytest.mark.parametrize(
    ("array", "multiplexing", "pad", "reach", "rate", "levels"),
    [
        (mimo_array(3, 4, STEP), "ddm", (2, 2), [0.0, -0.11], [0.63, 2.34], [-95.0, -99.6]),
        (mimo_array(3, 5, STEP), "tdm", (1, 1), [0.07, -0.13], [-4.8, -20.74], [-95.0, -98.0]),
    ],
)
def test_side_lobes_in_the_cell_of_a_peak_judged_before_their_own_echo_are_no_detections(
    array, multiplexing, pad, reach, rate, levels
):
    seen, places = found(made(array, multiplexing, pad), reach, rate, levels, [-29.0, -10.0])
    assert seen.range == pytest.approx(places[:, 0], abs=0.05 * WAVE.range_resolution)
    assert db(seen.power) == pytest.approx(levels, abs=0.1)


def test_what_an_echo_leaks_into_slots_of_doppler_division_is_no_echo_of_another_fold():
    args = [0.2, 0.65], [0.4, 1.53], [-95.0, -103.0], [11.6, -35.5], [8.5, 15.8]
    seen, places = found(made(PLANE, "ddm"), *args)
    assert seen.range == pytest.approx(places[:, 0], abs=0.05 * WAVE.range_resolution)
    assert db(seen.power) == pytest.approx([-95.0, -103.0], abs=0.1)


@pytest.mark.parametrize("off", [-7.3, -2.3, 0.4, 1.7, 6.6])
def test_shares_of_side_lobes_by_folds_bound_the_response_of_the_whole_frame(off):
    # Rates of all slots follow on one another: so many spans further, the response of all 48 chirps.
    lobes, away = SideLobes(Grid((1, 1), (16, 128)), ("rect", "rect"), 48), off + 16 * np.arange(3)
    exact = np.abs(np.sinc(away) / np.sinc(away / 48.0))
    bound = np.sqrt(lobes.at(np.array([off, 0.0]), np.zeros((1, 2)), 1.0, 0.0))
    share = lobes.by_fold(np.array([off]), np.array([0]))[:, 0]
    assert (share * bound >= exact).all()
    far = np.minimum(np.abs(away), 48 - np.abs(away)) > 4.0
    assert (share * bound <= 2.0 * (1.0 / (48.0 * np.sin(np.pi * np.abs(away) / 48.0))))[far].all()
