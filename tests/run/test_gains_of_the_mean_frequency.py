"""Echoes of wide ramps have the level of the ramp's middle, whatever the frequency at which it begins."""

import dataclasses

import numpy as np
import pytest

import raychan as rc

C0 = 299_792_458.0
NARROW = rc.Waveform(carrier=76.5e9, bandwidth=5e7, chirp_duration=40e-6, n_chirps=16, n_samples=256)


def run(wave, *bodies, **radar):
    """Return a run without noise; the radar stands at a height of 0.5 m."""
    mount = rc.Radar(position=(0, 0, 0.5), waveform=wave, power=1e3, noise=False, **radar)
    return rc.simulate(rc.Scene(radar=mount, bodies=bodies), tolerance_db=0.25)


def wide(middle, bandwidth):
    """Return a ramp of a bandwidth about a frequency [Hz]."""
    swept = 0.5 * bandwidth * (1.0 - 1.0 / 256)
    return dataclasses.replace(NARROW, carrier=middle - swept, bandwidth=bandwidth)


def strongest_db(result):
    return 10.0 * np.log10(result.detections.power.max())


@pytest.mark.parametrize("middle, bandwidth", [(1.25e9, 5e8), (26e9, 4e9), (60.5e9, 7e9), (79e9, 4e9)])
def test_a_point_target_returns_what_the_radar_equation_has_at_the_middle_of_the_ramp(middle, bandwidth):
    target = rc.Body(name="target", shape="box", rcs_dbsm=0.0, rcs_point=(0, 0, 0), position=(8.0, 0.0, 0.5))
    found = run(wide(middle, bandwidth), target, antenna=rc.IsotropicAntenna())
    (gain,) = np.abs(found.paths.amplitude)
    assert gain == pytest.approx(C0 / middle / ((4.0 * np.pi) ** 1.5 * 64.0), rel=1e-6)


def test_a_pane_returns_with_a_wide_ramp_what_it_returns_with_a_narrow_one_at_its_middle():
    pane = rc.Body(
        name="pane", shape="plate", params={"width": 0.1, "height": 0.1}, position=(8, 0, 0.5), material="car_glass"
    )
    for middle in (76.5e9, 78.5e9):
        levels = [strongest_db(run(wide(middle, b), pane)) for b in (5e7, 5e8)]
        assert levels[0] == pytest.approx(levels[1], abs=0.05)


def test_phases_are_those_of_the_carrier_for_points_mirrors_corners_and_bodies_that_turn():
    """Between elements and chirps all goes on as before: a target's cell stays where its range and rate are."""
    wave = wide(78e9, 2e9)
    for moving in ({}, {"turn_rate_dps": 40.0}):
        box = rc.Body(
            name="box", shape="box", params={"length": 0.4, "width": 0.4, "height": 0.4}, position=(9, 0, 0.5)
        )
        found = run(wave, dataclasses.replace(box, velocity=(3.0, 0.0, 0.0), **moving))
        row, column = np.unravel_index(found.rdmap.power.argmax(), found.rdmap.power.shape)
        assert found.rdmap.range[column] == pytest.approx(8.8, abs=wave.range_resolution)
        assert found.rdmap.rate[row] == pytest.approx(3.0, abs=0.6 * found.rdmap.rate_resolution)
