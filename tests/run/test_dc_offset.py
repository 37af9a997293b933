"""The receiver's DC offset in a map: a constant stands at range 0 and rate 0 with its power, and is named there."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.run.receiver_losses import near_field_losses
from raychan.units import dbm

DBM, WAVE = -75.0, {"bandwidth_mhz": 50.0, "chirp_us": 40.0, "chirps": 32, "samples": 64}  # cells of 3 m
ARRAY = {"elements_mm": [[0.0, y, 0.0] for y in (-1.0, 0.9)], "tx_elements_mm": [[0.0, y, 0.0] for y in (-2.0, 2.0)]}


def scene(at, offset=DBM, rcs=40.0, wave=WAVE, **radar):
    """Return a scene with one sphere at rest so far away [m], of a radar with a DC offset [dBm]."""
    given = {"waveform": wave, **radar, "impairments": {} if offset is None else {"dc_offset_dbm": offset}}
    body = {"name": "mark", "shape": "sphere", "params": {"radius": 0.1}, "position": [at, 0.0, 0.5], "rcs_dbsm": rcs}
    return rc.Scene.from_dict({"radar": given, "bodies": [body], "model": {"max_bounces": 1}})


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "radar",
    [{}, {"wave": WAVE | {"iq": False}}, ARRAY | {"multiplexing": "tdm"}],
    ids=["I/Q", "real", "array"],
)
def test_a_constant_stands_at_range_0_and_rate_0_with_its_power_and_is_named(radar, seed):
    result = rc.simulate(scene(60.0, **radar), seed)
    mirrored = not result.receiver.waveform.complex_sampling
    found, why = result.detections, result.provenance[0]
    assert (found.range[0], found.rate[0]) == pytest.approx((0.0, 0.0), abs=0.02)
    # With real sampling a constant is its own mirror image: twice the amplitude.
    assert dbm(found.power[0]) == pytest.approx(DBM + 6.02 * mirrored, abs=0.1)
    assert (why.label, why.bodies, why.folded) == ("dc", "dc offset", False)
    assert [why.label for why in result.provenance[1:]] == ["direct"]
    assert [x for x in result.warnings if x.startswith("1 of 2 detections is the receiver's DC offset (number 1)")]


def test_a_target_at_rest_within_the_main_lobe_of_the_offset_keeps_its_label():
    result = rc.simulate(scene(3.0))
    assert [why.bodies for why in result.provenance] == ["mark"] and result.provenance[0].label == "direct"


@pytest.mark.parametrize(
    ("offset", "range", "bodies"), [(None, 0.0, "noise"), (DBM, 120.0, "noise"), (DBM, 0.0, "dc offset")]
)
def test_a_cell_of_no_echo_is_noise_but_where_the_offset_brings_its_power(offset, range, bodies):
    why = rc.explain(rc.simulate(scene(60.0, offset)), range, 0.0, cell=True)
    assert (why.bodies, why.label) == (bodies, "dc" if bodies == "dc offset" else "clutter")


def test_explain_names_it(tmp_path, capsys):
    rc.save_result(rc.simulate(scene(60.0)), tmp_path)
    assert invoke(["explain", str(tmp_path), "--detection", "1"]) == 0
    assert "no path explains this cell: dc offset" in capsys.readouterr().out


@pytest.mark.parametrize("iq", [True, False])
@pytest.mark.parametrize("senders", [2, 3, 4])
def test_doppler_division_holds_it_in_the_slot_of_one_transmitter(senders, iq):
    places = [[0.0, 4.0 * k, 0.0] for k in range(senders)]
    given = {"elements_mm": ARRAY["elements_mm"], "tx_elements_mm": places, "multiplexing": "ddm"}
    result = rc.simulate(scene(60.0, wave=WAVE | {"chirps": 60, "iq": iq}, **given))
    row = [why.label for why in result.provenance].index("dc")
    found, slot = result.detections, 2.0 * result.scene.radar.waveform.unambiguous_rate / (senders + 1)
    level = DBM - 20.0 * np.log10(senders) + (0.0 if iq else 6.02)
    assert dbm(found.power[row]) == pytest.approx(level, abs=0.15)
    assert found.rate[row] / slot == pytest.approx(round(found.rate[row] / slot), abs=0.01)


@pytest.mark.parametrize("radar", [{}, {"multiplexing": "tdm"}])
def test_a_constant_is_not_near_an_array(radar):
    wide = {"elements_mm": [[0.0, 2.0 * k, 0.0] for k in range(8)]}
    if radar:
        wide["tx_elements_mm"] = [[0.0, 0.0, 0.0], [0.0, 16.0, 0.0]]
    result = rc.simulate(scene(10.0, offset=-95.0, wave=WAVE | {"bandwidth_mhz": 300.0}, **wide, **radar))
    assert "dc" in [why.label for why in result.provenance]
    # As a wave it is: from so near a beam loses 2 and 7 dB.
    assert near_field_losses(result.detections, result.scene.radar).max() > 1.0
    assert not [x for x in result.warnings if "near field" in x or "ranges that differ" in x]
