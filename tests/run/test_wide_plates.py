"""Plates far wider than their distance return what a strip without ends does: what lies near is found on facets whose
middle lies kilometres off."""

from __future__ import annotations

import pytest

import raychan as rc

_SCENE = """
[radar]
position = [0.0, 0.0, 1.0]
power_dbm = 20.0
[radar.waveform]
bandwidth_mhz = 500.0
chirp_us = 30.0
chirps = 16
samples = 64
[model]
max_bounces = 1
tolerance_db = 1.0
[[bodies]]
name = "p"
shape = "plate"
params = { width = WIDTH, height = 1.0 }
position = [6.0, 0.0, 1.0]
yaw_deg = 180.0
"""


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    return _run(tmp_path_factory.mktemp("usual"), 200.0)


def _run(place, width):
    file = place / "plate.toml"
    file.write_text(_SCENE.replace("WIDTH", f"{width}"))
    return rc.simulate(rc.Scene.load(file))


def test_a_plate_20_km_wide_returns_what_a_narrower_one_does(usual, tmp_path):
    found = _run(tmp_path, 20_000.0)
    assert found.detections.range == pytest.approx([6.0], abs=0.01)
    error = found.detections.error_db[0] + usual.detections.error_db[0]
    assert abs(found.detections.snr[0] - usual.detections.snr[0]) < error < 0.5


def test_a_wide_plate_is_not_said_to_be_beyond_the_unambiguous_range(usual):
    assert usual.warnings == ()
