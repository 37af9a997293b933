"""Spurs in slots of Doppler division, of a converter that clips or is coarse, are not echoes of their target."""

import numpy as np
import pytest

import raychan as rc
from raychan.units import C0, db

LAMBDA = C0 / 77.15e9


def run(multiplexing, over_db, bits=10):
    """Return a run of one target, two transmitters and two receivers, whose converter's full scale is so far over the
    target's peak [dB]."""
    wave = rc.Waveform(77e9, 300e6, 20e-6, 24e-6, n_chirps=192, n_samples=64)
    body = rc.Body(
        name="t", shape="sphere", params={"radius": 0.01}, position=(12.0, 3.0, 0.5), velocity=(4.0, 1.0, 0.0),
        rcs_dbsm=20.0,
    )  # fmt: skip
    power = 0.02 * 4.0 * LAMBDA**2 * 100.0 / ((4.0 * np.pi) ** 3 * 153.0**2)
    scale = float(db(power) + 30.0 + over_db + (6.0 if multiplexing == "ddm" else 0.0))
    radar = rc.Radar(
        wave, power=0.02, multiplexing=multiplexing, impairments=rc.Impairments(converter=rc.Converter(bits, scale)),
        **rc.mimo_array(2, 2, LAMBDA / 2),
    )  # fmt: skip
    return rc.simulate(rc.Scene([body], radar=radar), seed=3)


@pytest.mark.parametrize("over_db", [3.0, 0.0, -2.0, -4.0, -6.0, -8.0, -10.0, -14.0])
@pytest.mark.parametrize("multiplexing", ["ddm", "tdm"])
def test_spurs_of_clipping_in_other_slots_are_clutter(multiplexing, over_db):
    result = run(multiplexing, over_db)
    assert [why.label for why in result.provenance].count("direct") == 1
    assert result.provenance[0].label == "direct" and result.provenance[0].bodies == "t"
    for why in result.provenance[1:]:
        assert (why.label, why.bodies, why.folded) == ("clutter", "noise", False)


@pytest.mark.parametrize("over_db, bits", [(10.0, 3), (15.0, 3), (15.0, 4)])
def test_spurs_of_coarse_steps_in_other_slots_are_clutter(over_db, bits):
    result = run("ddm", over_db, bits)
    slot = 2.0 * result.scene.radar.waveform.unambiguous_rate / 3.0
    others = [why.label for why in result.provenance if abs(why.rate - result.provenance[0].rate) > 0.4 * slot]
    assert result.provenance[0].label == "direct"
    assert others and set(others) == {"clutter"}
