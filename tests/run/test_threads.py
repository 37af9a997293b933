"""A result does not depend on how many threads made it."""

from __future__ import annotations

import pytest
from support.facets import ball
from support.results import assert_same

import raychan as rc
from raychan import parallel


@pytest.fixture
def scene():
    """Return a scene with mirrors, curved surfaces, a layer and edges, in which rows are shared by threads."""
    bodies = [
        rc.Body(name="car", shape="car", position=(14.0, 2.0, 0.0), yaw_deg=30.0, velocity=(-3.0, 0.0, 0.0)),
        rc.Body(name="drum", mesh=ball((0.0, 0.0, 0.0), 1.2), position=(9.0, -3.0, 1.5), turn_rate_dps=50.0),
        rc.Body(name="pane", shape="plate", material="car_glass", position=(4.0, -1.0, 1.0), yaw_deg=200.0),
        rc.Body(name="ground", shape="ground", material="asphalt"),
    ]
    radar = {
        "position": [0.0, 0.0, 1.0],
        "waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 64},
    }
    return rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "tolerance_db": 3.0})


def test_one_two_three_and_eight_threads_give_the_same_bytes(scene):
    made = {}
    try:
        for threads in (1, 2, 3, 8):
            parallel.set_threads(threads)
            made[threads] = rc.simulate(scene.without_caches(), seed=4)
    finally:
        parallel.set_threads(None)
    assert len(made[1].detections.range) > 0
    for threads in (2, 3, 8):
        assert_same(made[threads], made[1])
        assert made[threads].stats["rays"] == made[1].stats["rays"]
