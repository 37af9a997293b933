"""Detections of what interferers send bear their names, in runs, in cells and in results read from disk."""

from __future__ import annotations

import math

import pytest

import raychan as rc
from raychan.units import C0

ANTENNA = {"kind": "cosine", "hpbw_h_deg": 60.0, "hpbw_v_deg": 30.0, "gain_dbi": 12.0}
RAMP = {"bandwidth_mhz": 300.0, "chirp_us": 25.6, "repetition_us": 30.0, "chirps": 64, "samples": 256}
AHEAD = 50.0  # m


def scene(*others, **radar):
    """Return a scene of a ball at 20 m and radars ahead, alike but for what is given."""
    alike = {"position": [AHEAD, 0.0, 0.5], "yaw_deg": 180.0, "antenna": ANTENNA, "waveform": RAMP, "locked": True}
    ball = {"name": "ball", "shape": "sphere", "params": {"radius": 0.3}, "position": [20.0, -1.0, 0.5]}
    given = {"position": [0.0, 0.0, 0.5], "antenna": ANTENNA, "waveform": RAMP} | radar
    named = [alike | {"name": f"radar_{k}"} | other for k, other in enumerate(others)]
    return rc.Scene.from_dict({"radar": given, "bodies": [ball], "model": {"max_bounces": 1}, "interferers": named})


def test_a_locked_radar_of_the_same_ramps_is_a_detection_of_its_name_where_its_delay_stands(tmp_path):
    late = 0.1e-6
    result = rc.simulate(scene({"start_us": late * 1e6}))
    first, second = result.provenance
    assert (first.label, first.bodies) == ("interference", "radar_0")
    assert first.range == pytest.approx(0.5 * (AHEAD + C0 * late), abs=0.05)
    assert math.isnan(first.true_range) and not first.contributions
    assert (second.label, second.bodies) == ("direct", "ball")
    assert any("1 of 2 detections is what another radar sends (number 1)" in line for line in result.warnings)
    rc.save_result(result, tmp_path / "result.nc")
    stored = rc.load_result(tmp_path / "result.nc")
    cell = rc.explain(stored, first.range, 0.0, cell=True)
    assert stored.provenance[0] == first and (cell.label, cell.bodies) == ("interference", "radar_0")


def test_two_radars_are_told_apart_and_an_echo_in_the_cell_of_one_keeps_its_name():
    result = rc.simulate(scene({}, {"start_us": 0.2, "power_dbm": -10.0}))
    assert sorted(why.bodies for why in result.provenance) == ["ball", "radar_0", "radar_1"]
    at = next(why.range for why in result.provenance if why.bodies == "ball")
    below = rc.simulate(scene({"position": [2.0 * at, 0.0, 0.5], "power_dbm": -90.0}))
    assert [why.bodies for why in below.provenance] == ["ball"]


def test_before_an_array_and_by_time_division_it_bears_its_name():
    array = {
        "elements_mm": [[0.0, y, 0.0] for y in (-1.0, 0.9)],
        "tx_elements_mm": [[0.0, y, 0.0] for y in (-2.0, 2.0)],
    }
    result = rc.simulate(scene({}, **array, multiplexing="tdm"))
    assert {why.bodies for why in result.provenance} == {"ball", "radar_0"}


def test_a_preview_names_it():
    found = scene({}).override(['model.mode="preview"'])
    assert {why.bodies for why in rc.simulate(found).provenance} == {"ball", "radar_0"}
