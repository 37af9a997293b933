"""Levels of a frame that is traced once are those of its middle; the ledger tells how far they may be off the mean."""

import numpy as np
import pytest

import raychan as rc


def run(distance, speed, **model):
    """Return a run of 51 ms that sees one point drive away."""
    point = rc.Body(
        name="p",
        shape="sphere",
        params={"radius": 0.01},
        position=(distance, 0, 0.5),
        rcs_dbsm=10,
        velocity=(speed, 0, 0),
    )
    wave = rc.Waveform(77e9, 150e6, 50e-6, n_chirps=1024, n_samples=64)
    radar = rc.Radar(wave, position=(0, 0, 0.5), antenna=rc.IsotropicAntenna())
    return rc.simulate(rc.Scene(bodies=[point], radar=radar, model={"max_bounces": 1, "tolerance_db": 0.5} | model))


@pytest.mark.parametrize(("distance", "speed"), [(8.0, 20.0), (15.0, -20.0)])
def test_a_level_is_that_of_several_tracings_and_the_ledger_tells_how_far_it_may_be_off(distance, speed):
    once, often = run(distance, speed), run(distance, speed, retrace=9)
    entry, grown = once.ledger["intra-frame motion"], abs(speed) * 1024 * 50e-6 / distance
    # The mean of 1 / R^2 over the frame is that of its middle but for the square of the change.
    assert entry.level_db == pytest.approx(20.0 * np.log10(0.25 * grown**2), abs=1.5)
    changed = 10.0 * np.log10(once.detections.power.max() / often.detections.power.max())
    assert abs(changed) < 20.0 * np.log10(1.0 + 10.0 ** (entry.level_db / 20.0)) + 0.01
    assert not any("intra-frame motion at most" in line for line in once.warnings)


def test_a_level_that_hardly_changes_moves_no_line():
    still = run(15.0, -0.5)
    assert still.ledger["intra-frame motion"].level_db < -50.0
    assert not any("intra-frame motion" in line for line in still.warnings)
