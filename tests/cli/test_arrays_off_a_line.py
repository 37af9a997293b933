"""`raychan run` of receivers all but on a line along y: the echo is there, at its azimuth and level."""

from __future__ import annotations

import csv

import pytest

from raychan.cli import invoke

SCENE = """
[radar]
position = [0, 0, 0.5]
elements_mm = [[0, -5.84, {up}], [0, -3.89, 0], [0, -1.95, 0], [0, 0, 0], [0, 1.95, 0], [0, 3.89, 0], [0, 5.84, {down}]]
[radar.waveform]
bandwidth_mhz = 300.0
chirp_us = 20.0
chirps = 64
samples = 64
[[bodies]]
name = "t"
shape = "sphere"
params = {{ radius = 0.01 }}
position = [9.4, -3.4, 0.5]
rcs_dbsm = 10.0
"""


@pytest.mark.parametrize(("up", "down"), [(0.0, 0.0), (0.02, 0.0), (0.2, -0.2), (-0.4, 0.4)])
def test_receivers_a_little_off_a_line_detect_as_on_it(tmp_path, capsys, up, down):
    file, out = tmp_path / "thin.toml", tmp_path / "out"
    file.write_text(SCENE.format(up=up, down=down))
    code = invoke(["run", str(file), "--out", str(out), "--no-pictures"])
    assert code == 0, capsys.readouterr().err
    with (out / "detections.csv").open() as table:
        found = list(csv.DictReader(table))
    assert [round(float(row["azimuth_deg"])) for row in found] == [-20]
    assert float(found[0]["snr_db"]) == pytest.approx(41.9, abs=0.5)
