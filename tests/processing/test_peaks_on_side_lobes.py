"""Peaks between cells: on side lobes of stronger echoes and at the end of the ranges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.detection import detect
from raychan.processing.range_doppler import range_doppler
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.signal.baseband import synthesize
from raychan.units import db

WAVE = Waveform(77e9, 300e6, 20e-6, 30e-6, 16, 64)
FINE = 16


def response(name, n, away):
    """Return the response in amplitude of a window over n samples at resolution cells from the peak."""
    taper = window(name, n)
    return abs(np.exp(2j * np.pi * away * np.arange(n) / n) @ taper) / taper.sum()


def shown_finely(cube, name, row, column):
    """Return power, rate and range of the peak that a map of cells sixteen times finer shows in and beside a cell."""
    fine = range_doppler(cube, WAVE, name, name, (FINE, FINE))
    rows, columns = (np.arange(-FINE // 4, FINE // 4 + 1) + x * FINE // 2 for x in (row, column))
    near = fine.power[np.ix_(rows % len(fine.rate), columns)]
    i, j = np.unravel_index(near.argmax(), near.shape)
    return near[i, j], fine.rate[rows[i] % len(fine.rate)], fine.range[columns[j]]


@pytest.mark.parametrize("name", ["rect", "hann", "taylor"])
@pytest.mark.parametrize("rate", [3.0, -7.9])  # in the middle of the rates, and over the last row but one
def test_an_echo_on_a_side_lobe_reads_what_a_map_of_finer_cells_shows(name, rate):
    rng, radar = np.random.default_rng(3), make_radar(WAVE)
    for _ in range(3):
        away = np.sign(rng.uniform(-1.0, 1.0)) * rng.uniform(3.0, 9.0)
        weak = 1.8 * response(name, 64, away) * np.exp(2j * np.pi * rng.uniform())
        rates = np.full(2, rate * WAVE.rate_resolution)
        reach = 15.2 * WAVE.range_resolution + np.array([0.0, away]) * WAVE.range_resolution
        cube = synthesize(echoes(reach - rates * WAVE.centre, rates, [1e-3, 1e-3 * weak]), radar)
        seen = detect(range_doppler(cube, WAVE, name, name), windows=(name, name), waveform=WAVE)
        k = int(np.abs(seen.range - reach[1]).argmin())
        power, peak_rate, peak_range = shown_finely(cube, name, *seen.cell[k])
        assert db(seen.power[k]) == pytest.approx(db(power), abs=0.04)
        assert abs(seen.range[k] - peak_range) < 0.06 * WAVE.range_resolution
        assert abs(seen.rate[k] - peak_rate) < 0.06 * WAVE.rate_resolution


@pytest.mark.parametrize("away", [0.1, 0.2, 0.3, 0.6])
def test_an_echo_just_before_the_end_of_real_sampling_reads_its_range_and_power(away):
    """The map ends half a resolution cell before the unambiguous range: the peak lies beyond its last cell."""
    real = replace(WAVE, complex_sampling=False)
    r = real.unambiguous_range - away * real.range_resolution
    start = r - 0.2 * real.unambiguous_rate * real.centre
    cube = synthesize(echoes([start], 0.2 * real.unambiguous_rate, 1e-3), make_radar(real))
    found = detect(range_doppler(cube, real), waveform=real)
    assert found.range[0] == pytest.approx(r, abs=0.05 * real.range_resolution)
    assert 10.0 * np.log10(found.power[0] / 1e-6) == pytest.approx(0.0, abs=0.1)
