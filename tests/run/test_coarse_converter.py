"""A converter whose steps are large against the samples says so: echoes vanish in it."""

import numpy as np
import pytest

import raychan as rc
from raychan.units import db

WAVE = rc.Waveform(77e9, 500e6, 25.6e-6, 40e-6, n_chirps=32, n_samples=128)
BALL = rc.Body(
    name="ball", shape="sphere", params={"radius": 0.02, "max_sag": 0.002}, rcs_dbsm=30.0,
    position=(20.0, 0.0, 0.5), velocity=(1.3, 0.0, 0.0),
)  # fmt: skip


def run(bits=None, full_scale=None):
    impairments = rc.Impairments(converter=rc.Converter(bits, full_scale) if bits else None)
    radar = rc.Radar(WAVE, impairments=impairments)
    return rc.simulate(rc.Scene([BALL], radar=radar, model={"max_bounces": 1}), seed=1)


@pytest.mark.parametrize("bits, full_scale", [(8, -20.0), (10, -20.0), (12, -10.0)])
def test_a_step_that_hides_echoes_is_told(bits, full_scale):
    found = run(bits, full_scale)
    assert any(x.startswith("the converter's step of ") for x in found.warnings)


def test_a_step_that_the_samples_bear_leaves_levels_and_is_not_told():
    ideal = run()
    power = db(0.5 * float((np.abs(ideal.cube.samples) ** 2).mean())) + 30.0
    found = run(12, power + 20.0 * np.log10(1.2 * 2**11))
    assert not any(x.startswith("the converter's step of ") for x in found.warnings)
    assert db(found.detections.power.max() / ideal.detections.power.max()) == pytest.approx(0.0, abs=0.25)
    coarse = run(12, power + 20.0 * np.log10(1.5 * 2**11))
    assert any(x.startswith("the converter's step of ") for x in coarse.warnings)
