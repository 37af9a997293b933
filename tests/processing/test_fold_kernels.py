"""Kernels that fit beams to a cell: each step is that of its slow form, and no beam loses power as it climbs."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import make_radar

from raychan.processing.fold_beams import Beams, squared
from raychan.processing.fold_kernels import climb_all, fit_beams, left_by, make_visible
from raychan.radar.aperture import Aperture
from raychan.radar.array import mimo_array, virtual_elements
from raychan.radar.waveform import Waveform
from raychan.units import C0

WAVE = Waveform(77e9, 2e8, 12e-6, n_chirps=64, n_samples=64)
HALF = 0.5 * WAVE.wavelength


def plane(spacing, askew=0.0):
    """Return places in four rows, of which every second is moved by a share of the spacing."""
    row, column = np.indices((4, 4)).reshape(2, -1)
    return spacing * np.stack([0.0 * row, column + askew * (row % 2), row], axis=1)


LINE = mimo_array(3, 4, HALF)
ARRAYS = {
    "line": virtual_elements(LINE["tx_elements"], LINE["elements"]),
    "plane": plane(HALF),
    "wide plane": plane(2.5 * HALF),
    "askew": plane(2.0 * HALF, 0.5),
    "anywhere": np.random.default_rng(1).uniform(-3.0, 3.0, (9, 3)) * HALF,
}


@pytest.mark.parametrize("name", ARRAYS)
def test_directions_of_real_waves_are_those_of_the_aperture(name):
    array = Aperture(np.asarray(ARRAYS[name]), C0 / WAVE.middle)
    at = np.random.default_rng(2).uniform(-1.4, 1.4, (200, 2))
    expected = array.visible(at)
    period = np.where(array.wraps, array.period, np.inf)
    for one in at:
        make_visible(one, period, np.ascontiguousarray(array.skewed))
    # Of two that look alike and are as near to boresight either may be taken.
    assert np.isclose(np.hypot(*at.T), np.hypot(*expected.T), atol=1e-6).all()
    assert (np.abs(at - expected).max(axis=1) < 1e-9).mean() > 0.95


def beams_and_values(count):
    beams = Beams.of(make_radar(WAVE, **LINE, multiplexing="tdm"))
    rng = np.random.default_rng(count)
    values = rng.standard_normal((50, 12, 2)).view(complex)[..., 0].astype(np.complex64)
    at = np.stack([rng.permutation(np.linspace(-0.8, 0.8, 9)) for _ in range(50)])[:, :count]
    return beams, values, np.stack([at, 0.0 * at], axis=2)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_what_waves_leave_is_that_of_least_squares(count):
    beams, values, at = beams_and_values(count)
    rest = np.empty_like(values)
    left_by(rest, at, values, beams.places)
    for cell, towards, left in zip(values, at, rest, strict=True):
        waves = beams.weights(towards).conj().T
        slow = cell - waves @ np.linalg.lstsq(waves, cell, rcond=None)[0]
        assert left == pytest.approx(slow, abs=1e-4)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_beams_that_are_fitted_explain_what_they_leave_not_and_more_than_before(count):
    beams, values, at = beams_and_values(count)
    none, rest = np.zeros((0, 2)), np.empty_like(values)
    left_by(rest, at, values, beams.places)
    before = squared(values).sum(axis=1) - squared(rest).sum(axis=1)
    power = np.empty(len(values))
    fit_beams(power, at, values, beams.places, np.full(2, np.inf), none, beams.step, 4, 3)
    left_by(rest, at, values, beams.places)
    explained = squared(values).sum(axis=1) - squared(rest).sum(axis=1)
    assert power == pytest.approx(len(beams.places) * explained, rel=1e-5)
    assert (explained >= before * (1.0 - 1e-6)).all() and explained.mean() > 1.1 * before.mean()


def test_a_beam_climbs_to_the_peak_of_a_wave_in_noise_as_on_a_fine_grid():
    beams, noise, _ = beams_and_values(1)
    waves = beams.weights(np.stack([np.linspace(-0.9, 0.9, 50), np.zeros(50)], axis=1)).conj()
    values = waves + np.complex64(0.1) * noise
    level = squared(beams.weights(beams.at) @ values.T)
    at = beams.at[level.argmax(axis=0)].copy()
    power = level.max(axis=0)
    climb_all(power, at, values, beams.places, np.full(2, np.inf), np.zeros((0, 2)), beams.step, 3)
    fine = np.stack([np.linspace(-1.0, 1.0, 20001), np.zeros(20001)], axis=1)
    assert power == pytest.approx(squared(beams.weights(fine) @ values.T).max(axis=0), rel=1e-4)
