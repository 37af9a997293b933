"""Echoes at the last ranges of staggered ramps with real sampling: cells beside stand under folds of noise."""

import numpy as np
import pytest

import raychan as rc
from raychan.units import db

WAVE = rc.Waveform(
    77e9, 400e6, 25.6e-6, stagger=(40e-6, 50e-6), n_chirps=96, n_samples=128, complex_sampling=False
)  # fmt: skip
END, CELL = WAVE.unambiguous_range, WAVE.range_resolution


@pytest.mark.parametrize("elements", [1, 4])
@pytest.mark.parametrize("cells", [-0.8, -0.3])
@pytest.mark.parametrize("seed", [40, 41, 42, 43])
def test_a_lone_echo_near_the_end_is_no_stronger_than_it_is(elements, cells, seed):
    """Up to 25 dB too strong, named `clutter`, while what is beyond the last cell was told by cells of other folds. It
    moves, so that its mirror image lies at another rate."""
    processing = rc.Processing(range_window="hann", rate_window="hann")
    array = {} if elements == 1 else {"elements": rc.uniform_array(elements, 0.5 * WAVE.wavelength)}
    radar = rc.Radar(WAVE, processing=processing, **array)
    distance, velocity = END + cells * CELL, -31.0
    body = rc.Body(
        name="ball", shape="sphere", params={"radius": 0.02, "max_sag": 0.002}, rcs_dbsm=28.0,
        position=(distance - velocity * WAVE.centre, 0.0, 0.5), velocity=(velocity, 0.0, 0.0),
    )  # fmt: skip
    found = rc.simulate(rc.Scene([body], radar=radar, model={"max_bounces": 1}), seed=seed)
    # Ahead the antenna has 3 dB.
    true = db(4.0 * radar.power * WAVE.wavelength**2 * 10.0**2.8 / ((4.0 * np.pi) ** 3 * distance**4))
    level = db(found.detections.power)
    assert len(level) and (np.abs(level - true) < 0.5).all()
    assert {x.label for x in found.provenance} == {"direct"}
