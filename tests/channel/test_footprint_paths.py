"""Footprints long in range: one path where the noise hides the difference, else one for each corner."""

import numpy as np
import pytest

import raychan as rc
from raychan.channel.paths import join, paths_of
from raychan.run.receiver import quiet_map
from raychan.signal.baseband import synthesize


@pytest.mark.parametrize("speed", [0.0, 15.0], ids=["standing", "moving"])
def test_footprints_that_stay_one_path_change_no_cell_by_a_tenth_of_the_noise(speed):
    scene = rc.Scene(
        bodies=[rc.Body("car", shape="car", position=(12.0, 1.0, 0.0), yaw_deg=20.0, velocity=(speed, 0.0, 0.0))],
        radar={
            "position": [0.0, 0.0, 0.6],
            "waveform": {"bandwidth_mhz": 800.0, "chirp_us": 30.0, "chirps": 64, "samples": 256},
        },
        model={"max_bounces": 2, "tolerance_db": 1.0},
    )
    routes = rc.trace(scene)
    assert routes.noise > 0.0
    facets, radar, settings = routes.geometry.facets, scene.radar, scene.processing
    split, whole = (
        join([paths_of(batch, facets, radar, radar.waveform.carrier, noise) for batch in routes.batches])
        for noise in (0.0, routes.noise)
    )
    # Of most footprints that the noise hides no route is left.
    assert len(whole.length) < 0.95 * len(split.length)
    apart = synthesize(split, radar).samples - synthesize(whole, radar).samples
    power = quiet_map(apart, radar, settings)
    assert np.sqrt(power.max() / radar.power) < 0.1 * routes.noise
