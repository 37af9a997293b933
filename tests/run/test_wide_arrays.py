"""Turning bodies before arrays wide for their distance: the ledger says what corners alone lack."""

import numpy as np

import raychan as rc
from raychan.run.ledger.wide_arrays import WIDE


def _run(width):
    """Return a frame of a plate that turns slowly, traced three times, before elements over a width [m]."""
    wave = rc.Waveform(77e9, 150e6, 40e-6, n_chirps=12, n_samples=64)
    elements = [(0.0, y, 0.0) for y in np.linspace(-0.5 * width, 0.5 * width, 4)]
    size = {"width": 0.2, "height": 0.2}
    plate = rc.Body("plate", shape="plate", params=size, position=(3, 0, 1), yaw_deg=185.0, turn_rate_dps=0.5)
    radar = rc.Radar(wave, position=(0, 0, 1), elements=elements, power=0.1)
    return rc.simulate(rc.Scene(bodies=[plate], radar=radar, model={"max_bounces": 1, "retrace": 3}))


def test_what_corners_of_a_turning_plate_lack_is_told():
    found = _run(0.6)
    entry = found.ledger[WIDE]
    assert entry.kind == "estimate" and entry.level_db > -10.0
    assert "plate" in entry.how
    assert any(WIDE in line for line in found.warnings)


def test_nothing_is_lacking_before_a_narrow_array():
    found = _run(0.006)
    assert found.ledger[WIDE].level_db == "none"
    assert not any(WIDE in line for line in found.warnings)
