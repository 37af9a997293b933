"""Of which time in the frame range, rate and azimuth of a detection are, as docs/conventions.md has it."""

import numpy as np
import pytest

import raychan as rc

WAVE = rc.Waveform(carrier=77e9, bandwidth=5e8, chirp_duration=40e-6, n_chirps=512, n_samples=128)
POST, SPEED = np.array([4.0, 4.0]), 30.0


def seen_at(time: float) -> tuple[float, float, float]:
    """Return range [m], rate [m/s] and azimuth [deg] of the post from a radar that passes it."""
    away = POST - [SPEED * time, 0.0]
    far = float(np.linalg.norm(away))
    return far, float(-SPEED * away[0] / far), float(np.degrees(np.arctan2(away[1], away[0])))


@pytest.mark.parametrize("tracings", [1, 5])
def test_range_rate_and_azimuth_are_of_the_middle_traced_once_or_often(tracings):
    post = rc.Body("post", shape="sphere", params={"radius": 0.01}, position=(*POST, 0.5), rcs_dbsm=0.0)
    line = rc.uniform_array(8, 0.5 * WAVE.wavelength)
    radar = rc.Radar(WAVE, position=(0.0, 0.0, 0.5), velocity=(SPEED, 0.0, 0.0), elements=line)
    found = rc.simulate(rc.Scene([post], radar=radar, model={"max_bounces": 1, "retrace": tracings})).detections
    far, rate, azimuth = seen_at(WAVE.centre)
    assert found.range == pytest.approx([far], abs=0.01)
    assert found.rate == pytest.approx([rate], abs=0.06)
    assert np.degrees(found.azimuth) == pytest.approx([azimuth], abs=0.15)
