"""Logged poses in place of a model: what the log says is where the ship is, and a log that cannot be is told."""

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.replay import read_poses
from raychan.run.ship.scene import read_ship_scene, ship_scene
from raychan.sensors.laser import SEA

HEAD = "t_s,x_m,y_m,heading_deg,roll_deg\n"


def replay(tmp_path, text, **scanner):
    file = tmp_path / "poses.csv"
    file.write_text(text)
    tables = {"replay": {"file": str(file)}, "sea": {"reflectivity": 1.0}, "scanner": scanner}
    return ShipLoop(ship_scene(tables))


def rolled(tmp_path, roll, **scanner):
    """Return the first frame of a ship that lies still, rolled by an angle [deg]."""
    return replay(tmp_path, f"{HEAD}0,0,0,0,{roll}\n1,0,0,0,{roll}\n", **scanner).step_scan()


def test_a_scanner_5_m_up_meets_the_sea_28_8_m_abeam_at_10_deg_of_roll_on_one_side_only(tmp_path):
    frame = rolled(tmp_path, -10.0, position=[0.0, 0.0, 5.0 / np.cos(np.radians(10.0))])
    assert frame.scan.range[-1] == pytest.approx(5.0 / np.sin(np.radians(10.0)), abs=1e-9)
    assert frame.scan.range[-1] == pytest.approx(28.8, abs=0.1)
    angle = np.arange(-90, 91)
    assert ((frame.scan.body == SEA) == (np.sin(np.radians(angle)) > 5.0 / 80.0 / np.sin(np.radians(10.0)))).all()


def test_pitch_and_height_of_a_log_count(tmp_path):
    text = "t_s,x_m,y_m,heading_deg,roll_deg,pitch_deg,z_m\n0,0,0,0,0,10,1\n1,0,0,0,0,10,1\n"
    frame = replay(tmp_path, text, position=[0.0, 0.0, 5.0]).step_scan()
    height = 1.0 + 5.0 * np.cos(np.radians(10.0))
    assert frame.pitch == pytest.approx(np.radians(10.0)) and frame.z == 1.0
    assert frame.scan.range[90] == pytest.approx(height / np.sin(np.radians(10.0)), abs=1e-9)


@pytest.mark.parametrize("optional", [("pitch_deg", "z_m"), ("z_m",), ()])
def test_the_csv_of_a_replay_has_the_columns_of_its_log_and_can_be_replayed_as_it_was(optional, tmp_path):
    log, scene = tmp_path / "log.csv", tmp_path / "ship.toml"
    names = ["t_s", "x_m", "y_m", "heading_deg", "roll_deg", *optional]
    rows = [[k / 75.0, 0.1 * k, 0.0, 10.0 + k, 3.0, 4.0 + 0.1 * k, 2.0 + 0.01 * k][: len(names)] for k in range(31)]
    log.write_text("\n".join(",".join(map(str, row)) for row in [names, *rows]))
    scene.write_text(f"[replay]\nfile = '{log}'\n[sea]\nreflectivity = 1.0\n")
    one, two = tmp_path / "one", tmp_path / "two"
    assert invoke(["ship", str(scene), "--out", str(one), "--no-pictures"]) == 0
    assert (one / "ship.csv").read_text().splitlines()[0].split(",")[7:] == list(optional)
    again = ["--set", f"replay.file={one / 'ship.csv'}"]
    assert invoke(["ship", str(scene), *again, "--out", str(two), "--no-pictures"]) == 0
    first, second = (read_poses(folder / "ship.csv", 1.0).pose for folder in (one, two))
    assert first[: len(second)] == pytest.approx(second, abs=1e-7)
    assert first[:, 2].any() == ("z_m" in optional) and first[:, 4].any() == ("pitch_deg" in optional)


def test_the_ship_is_where_the_log_has_it_and_turns_over_north_the_short_way(tmp_path):
    loop = replay(tmp_path, HEAD + "10,0,0,350,0\n11,8,-6,10,4\n12,16,-12,30,0\n")
    frames = [loop.step_scan() for _ in range(loop.scans)]
    assert loop.done and len(frames) == 150
    t = np.array([f.time for f in frames])
    assert [f.x for f in frames] == pytest.approx(8.0 * t) and [f.y for f in frames] == pytest.approx(-6.0 * t)
    assert np.degrees([f.heading for f in frames]) == pytest.approx((350.0 + 20.0 * t) % 360.0)
    assert np.degrees([f.roll for f in frames]) == pytest.approx(np.interp(t, [0, 1, 2], [0, 4, 0]))
    assert [f.speed for f in frames] == pytest.approx(np.full(150, 10.0))
    assert np.degrees(frames[3].yaw_rate) == pytest.approx(20.0)
    assert np.degrees(frames[3].roll_rate) == pytest.approx(4.0)
    with pytest.raises(ValueError, match="the logged poses end at 2 s"):
        loop.step_scan()
    with pytest.raises(ValueError, match="logged poses take no orders"):
        loop.order(rudder=0.1)


WRONG = {
    "": "poses.csv: is empty; allowed: columns t_s, x_m",
    HEAD: "poses.csv: too few rows",
    f"{HEAD}0,0,0,0,0\n": "too few rows",
    f"{HEAD}0,0,0,0,0\n1,0,0,0,0\n0.5,0,0,0,0\n": r"poses.csv:4: t_s = 0.5 after 1: time does not grow",
    f"{HEAD}0,0,0,0,0\n0,0,0,0,0\n": r"poses.csv:3: t_s = 0 after 0: time does not grow",
    f"{HEAD}0,0,0,0,0\n5,0,0,0,0\n": r"poses.csv:3: max_gap_s: t_s = 5 after 0: a gap of 5 s; allowed: at most 1 s",
    f"{HEAD}0,0,0,nan,0\n1,0,0,0,0\n": r"poses.csv:2: heading_deg = 'nan'; allowed: a finite number",
    f"{HEAD}0,0,0,0,0\n\n1,0,inf,0,0\n": r"poses.csv:4: y_m = 'inf'",
    f"{HEAD}0,0,0,0,x\n1,0,0,0,0\n": r"poses.csv:2: roll_deg = 'x'",
    f"{HEAD}0,0,0,0,0\n1,0,0,0,0,7\n": r"poses.csv:3: 6 fields in a file of 5 columns",
    f"{HEAD}2e11,0,0,0,0\n1,0,0,0,0\n": r"t_s = '2e11'; allowed: a finite number from -1e\+11 to 1e\+11",
    f"{HEAD}0,0,0,0\n1,0,0,0,0\n": r"poses.csv:2: roll_deg is missing",
    "t_s,x_m,y_m,roll_deg\n0,0,0,0\n": r"poses.csv:1: column heading_deg is missing",
    "t_s,x_m,y_m,headingdeg,roll_deg\n0,0,0,0,0\n": "did you mean 'headingdeg'",
    "t_s,x_m,x_m,y_m,heading_deg,roll_deg\n": "two columns have one name",
    "\x00\x00\n": "column t_s is missing|no CSV",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_log_that_cannot_be_is_told_with_line_and_value(text, tmp_path):
    file = tmp_path / "poses.csv"
    file.write_text(text)
    with pytest.raises(rc.SceneError, match=WRONG[text]):
        read_poses(file, 1.0)


def test_a_gap_of_a_log_is_told_by_the_key_of_the_scene_that_allows_none_so_long(tmp_path):
    (tmp_path / "poses.csv").write_text(f"{HEAD}0,0,0,0,0\n5,0,0,0,0\n")
    file = tmp_path / "mine.toml"
    file.write_text('[replay]\nfile = "poses.csv"\n')
    with pytest.raises(rc.SceneError, match=r"poses.csv:3: t_s = 5 after 0: a gap of 5 s; allowed: at") as told:
        read_ship_scene(file)
    assert (told.value.file, told.value.key) == (file, "replay.max_gap_s")


def test_a_log_that_is_no_text_is_told(tmp_path):
    file = tmp_path / "poses.csv"
    file.write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(rc.SceneError, match="cannot be read"):
        read_poses(file, 1.0)
    with pytest.raises(rc.SceneError, match="cannot be read"):
        read_poses(tmp_path, 1.0)


def test_a_log_in_unix_time_counts_from_its_first_row_and_says_when_that_was(tmp_path):
    loop = replay(tmp_path, HEAD + "1700000000.5,0,0,0,0\n1700000001.5,8,0,0,0\n")
    frames = [loop.step_scan() for _ in range(loop.scans)]
    assert frames[0].time == 0.0 and len(frames) == 75
    assert [f.x for f in frames] == pytest.approx([8.0 * f.time for f in frames], abs=1e-9)
    assert loop.scene.poses.start == 1700000000.5
    assert "the log ends after 1 s, before run.duration_s = 60" in loop.scene.ends_early[0]


@pytest.mark.parametrize("command", ["ship", "hil"])
def test_a_log_shorter_than_a_scan_is_told_with_its_file(command, tmp_path, capsys):
    log, scene = tmp_path / "log.csv", tmp_path / "ship.toml"
    scene.write_text("[replay]\nfile = 'log.csv'\n[run]\nduration_s = 0.5\n")
    options = {"ship": ["--out", str(tmp_path / "out"), "--no-pictures"], "hil": ["--no-realtime"]}[command]
    for last in (0.001, 0.006, 0.0133):
        log.write_text(f"{HEAD}0,0,0,0,0\n{last},0,0,0,0\n")
        assert invoke([command, str(scene), *options]) == 2
        said = capsys.readouterr().err.replace("\n", "")
        assert f"{log}: the log lasts {last} s" in said and "allowed: at least one scan, 0.01333 s" in said
    for last in (0.014, 0.02):
        log.write_text(f"{HEAD}0,0,0,0,0\n{last},0,0,0,0\n")
        assert invoke([command, str(scene), *options]) == 0
