"""raychan ship: files that say the same as the loop, and input that is wrong, without a traceback."""

import csv
import json

import h5netcdf
import numpy as np
import pytest
from PIL import Image

from raychan.cli import invoke
from raychan.run.ship import files as ship_files
from raychan.run.ship.files import CONTENTS, rounded_heading
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.scene import read_ship_scene
from raychan.world.scene_files.bundled import ship_names

SHORT = ["--set", "run.duration_s=9", "--set", "programme.headings=[[0,0],[1,90]]"]


def rows(folder):
    with (folder / "ship.csv").open() as file:
        return list(csv.reader(file))


def test_the_files_hold_what_the_loop_gives(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(ship_files, "_BLOCK", 100)  # 675 scans in 7 blocks
    out = tmp_path / "out"
    assert invoke(["ship", "ship_trial", *SHORT, "--out", str(out), "--no-pictures"]) == 0
    assert "675 scans of 181 beams over 9.0 s" in capsys.readouterr().out
    head, *body = rows(out)
    assert head == ["t_s", "x_m", "y_m", "heading_deg", "roll_deg", "rudder_deg", "speed_mps"]
    loop = ShipLoop(read_ship_scene("ship_trial", SHORT[1::2]))
    frames = [loop.step_scan() for _ in range(675)]
    table = np.array(body, float)
    assert table[:, 0] == pytest.approx([f.time for f in frames], rel=1e-8)
    assert table[:, 3] == pytest.approx(np.degrees([f.heading for f in frames]), rel=1e-8)
    assert table[:, 4] == pytest.approx(np.degrees([f.roll for f in frames]), rel=1e-8)
    with h5netcdf.File(out / "scan.nc") as file:
        assert dict(file.dimensions.items())["time"].size == 675 and file.variables["range_m"].shape == (675, 181)
        ranges, met = file.variables["range_m"][:], file.variables["body"][:]
        assert file.variables["time"][:] == pytest.approx([f.time for f in frames])
        assert {k: v.attrs["units"] for k, v in file.variables.items()} == {
            "angle_deg": "degree", "beam_time": "s", "time": "s", "range_m": "m", "body": "1",
        }  # fmt: skip
        assert "Sea trial" in file.attrs["scene"]
    expected = np.array([f.scan.range for f in frames])
    assert np.isfinite(expected).any()
    assert np.where(np.isnan(ranges), np.inf, ranges) == pytest.approx(expected, rel=1e-6)
    assert (met == [f.scan.body for f in frames]).all()
    told = json.loads((out / "summary.json").read_text())
    assert told["echoes"] == {"sea": int(np.isfinite(expected).sum())} and told["scans"] == 675
    assert told["nearest_m"]["sea"] == pytest.approx(expected.min())


def test_pictures_are_drawn_and_a_second_run_replaces_the_first_and_leaves_other_files(tmp_path, monkeypatch):
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    out = tmp_path / "out"
    command = ["ship", "ship_turn", "--set", "run.duration_s=20", "--out", str(out)]
    assert invoke(command) == 0
    first = rows(out)
    (out / "note.txt").write_text("mine")
    for name in ship_files.PICTURES:
        with Image.open(out / name) as picture:
            assert min(picture.size) > 500
    assert invoke([*command, "--seed", "3", "--no-pictures"]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["note.txt", "scan.nc", "ship.csv", "summary.json"]
    assert json.loads((out / "summary.json").read_text())["seed"] == 3
    assert rows(out) == first  # the seed moves ranges only: nothing disturbs this ship


def test_its_own_csv_can_be_replayed_and_gives_the_same_scans(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    changes = [*SHORT, "--set", "scanner.noise_m=0"]
    assert invoke(["ship", "ship_trial", *changes, "--out", str(one), "--no-pictures"]) == 0
    replay = ["--set", f"replay.file={one / 'ship.csv'}"]
    assert invoke(["ship", "ship_trial", *changes, *replay, "--out", str(two), "--no-pictures"]) == 0
    held = []
    for folder in (one, two):
        with h5netcdf.File(folder / "scan.nc") as file:
            held.append(np.nan_to_num(file.variables["range_m"][:], nan=0.0))
    assert len(held[1]) == 674  # the log ends at the start of the last scan
    both = (held[0][:-1] > 0.0) & (held[1] > 0.0)
    assert both.sum() > 10000 and (both == (held[0][:-1] > 0.0)).mean() > 0.999
    # Between two rows a log's roll moves evenly, the loop's by a cubic: 6e-4 of 5 deg apart in this sea.
    assert np.median(np.abs(held[0][:-1][both] / held[1][both] - 1.0)) < 2e-4
    told = json.loads((two / "summary.json").read_text())
    assert told["model"] == "replay" and told["log_start_s"] == 0.0


def test_ctrl_c_leaves_nothing_behind(tmp_path, monkeypatch, capsys):
    def stop(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(ShipLoop, "step_scan", stop)
    assert invoke(["ship", "--out", str(tmp_path / "out")]) == 130
    assert "nothing was written" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["ship"], "--out"),
        (["ship", "nowhere", "--out", "OUT"], "file not found"),
        (["ship", "urban", "--out", "OUT"], "is a scene of a radar, not of a ship; allowed: raychan run"),
        (["run", "ship_turn", "--out", "OUT"], "is a scene of a ship"),
        (["ship", "--seed", "-1", "--out", "OUT"], "seeds are whole numbers"),
        (["ship", "--set", "ship.model=raft", "--out", "OUT"], "ship.model: 'raft' is not possible"),
        (["ship", "--set", "replay.file=none.csv", "--out", "OUT"], "none.csv: file not found"),
        (
            [
                "ship",
                "ship_trial",
                "--set",
                "steering.noise.sway_mps2=1000",
                "--set",
                "ship.model=container",
                "--out",
                "OUT",
            ],
            "the ship cannot sail on after",
        ),
        (
            ["ship", "--set", "run.duration_s=1e5", "--set", "scanner.mirror_hz=1e4", "--out", "OUT"],
            "1,000,000,000 scans",
        ),
        (["ship", "--set", "run.duration_s=0.001", "--out", "OUT"], "run.duration_s"),
    ],
)
def test_wrong_input_is_told_in_a_line(arguments, said, tmp_path, capsys):
    assert invoke([str(tmp_path / "out") if a == "OUT" else a for a in arguments]) == 2
    told = capsys.readouterr().err
    assert said in told and "Traceback" not in told
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_no_result_is_not_overwritten(tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    (out / "ship.csv").write_text("mine")
    assert invoke(["ship", *SHORT, "--out", str(out), "--no-pictures"]) == 2
    assert "is not a folder of results" in capsys.readouterr().err
    assert (out / "ship.csv").read_text() == "mine"
    assert "scan.nc" in CONTENTS.signs


def test_a_window_without_a_display_is_refused_before_the_ship_sails(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert invoke(["ship", "--view", "--out", str(tmp_path / "out")]) == 2
    assert "there is no display" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_help_names_every_scene_that_comes_along(capsys):
    assert invoke(["ship", "--help"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in ship_names())


def test_a_heading_that_rounds_up_to_360_is_0():
    assert rounded_heading(359.96, ".1f") == "0.0" and rounded_heading(359.94, ".1f") == "359.9"
    assert rounded_heading(360.0 - 1e-9, ".9g") == "0"


def test_a_yacht_that_sinks_its_scanner_is_told_not_crashed(tmp_path, capsys):
    # A scanner below the water line meets nothing of the sea from below.
    out = tmp_path / "out"
    changes = [*SHORT, "--set", "scanner.position=[0,0,-2]"]
    assert invoke(["ship", "ship_trial", *changes, "--out", str(out), "--no-pictures"]) == 0
    assert json.loads((out / "summary.json").read_text())["echoes"]["sea"] == 0
    assert "2 m below the water line" in capsys.readouterr().err
