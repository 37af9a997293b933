"""Sweeps over a walker who steps out from behind a wall: closed forms for what is hidden and what returns."""

from __future__ import annotations

import csv
import subprocess
import sys

import numpy as np
import pytest
from support.scene_texts import ISOTROPIC, but_compiling, upright, walker
from truth import tworay

from raychan.cli import invoke
from raychan.report.sweep_figures import sweep_picture
from raychan.run.simulate import simulate
from raychan.study.sweep import Axis, sweep, write_csv
from raychan.study.visibility import visibility
from raychan.units import C0, K_BOLTZMANN
from raychan.world.errors import SceneError
from raychan.world.scene import Scene

WALL = 6.0
"""Distance of the screen, whose left edge stands straight ahead of the radar [m]."""
FACE = 13.5
"""Distance of the mirror behind the walker [m]."""
TEXT = f"""{ISOTROPIC}{upright("screen", WALL, -1.5)}{walker(10.0, -1.0)}
velocity_mps = [0.0, 2.0, 0.0]
"""
HOUSE = upright("house", FACE, 0.5)
F, N, M, FS = 77e9, 256, 32, 256 / 30e-6


@pytest.fixture(scope="module")
def scene():
    return Scene.from_text(TEXT)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "screen.toml"
    path.write_text(TEXT)
    return path


@pytest.fixture(scope="module")
def out_of_cover(scene):
    return sweep(scene, "walker", [Axis.of(f"bodies.walker.position.y={-1 - gone(scene)}:{1 - gone(scene)}:3")])


def gone(scene):
    """Return how far [m] the walker goes until the middle of the frame."""
    return 2.0 * scene.radar.waveform.centre


def reported(distance):
    """Margin [dB] of a target of 1 m2 in the clear over the weakest reported: radar equation, kTBF, Hann windows."""
    power = 1.0 * tworay.radar_power(distance, 1.0, C0 / F)
    noise = K_BOLTZMANN * 290.0 * FS * 10**1.5 / (N * M) * 1.5**2
    return 10 * np.log10(power / noise) - 20.0


@pytest.mark.parametrize(
    ("text", "key", "values", "changes"),
    [
        ("radar.power_dbm=0:10:3", "radar.power_dbm", (0, 5, 10), "radar.power_dbm=5"),
        ("a.position.y = -4:0:5", "a.position.y", (-4, -3, -2, -1, 0), "a.position.y=-3"),
        ("a.position=[12, 1:-1:3, 0]", "a.position.y", (1, 0, -1), "a.position=[12, 0, 0]"),
        ("a.position=[0:4:3, 1:2:3, 0]", "a.position.x", (0, 2, 4), "a.position=[2, 1.5, 0]"),
        ("a.rcs_dbsm=[[0, 1:3:2], [90, 0]]", "a.rcs_dbsm", (1, 3), "a.rcs_dbsm=[[0, 3], [90, 0]]"),
        ("model.tolerance_db=.5:5e-1:1", "model.tolerance_db", (0.5,), None),
    ],
)
def test_a_range_may_stand_for_any_number_of_a_value(text, key, values, changes):
    axis = Axis.of(text)
    assert (axis.key, axis.values) == (key, values)
    assert len(axis.changes) == len(values)
    assert changes is None or axis.changes[1] == changes


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("radar.power_dbm", "KEY=START:STOP:STEPS is wanted"),
        ("radar.power_dbm=3", "KEY=START:STOP:STEPS is wanted"),
        ("radar.power_dbm=1:3", "KEY=START:STOP:STEPS is wanted"),
        ("radar.power_dbm=1:3:2.5", "KEY=START:STOP:STEPS is wanted"),
        ("=1:3:2", "KEY=START:STOP:STEPS is wanted"),
        ("radar.power_dbm=1e400:2:2", "the range from 1e400 to 2 is not finite"),
        ("radar.power_dbm=-1e308:1e308:2", "the range from -1e308 to 1e308 is not finite"),
        ("radar.power_dbm=1:3:0", "1 to 100000 are allowed"),
        ("radar.power_dbm=1:3:1000000000", "1 to 100000 are allowed"),
        ("a.position=[0:1:2, 0:1:3, 0]", "same number of steps"),
    ],
)
def test_a_range_that_is_none_is_told(text, says):
    with pytest.raises(ValueError, match=says):
        Axis.of(text)


def test_labels_tell_the_unit_where_the_key_does():
    labels = [Axis.of(f"{k}=0:1:2").label for k in ("radar.power_dbm", "bodies.a.position.y", "bodies.a.params.length")]
    assert labels == ["radar.power_dbm [dBm]", "bodies.a.position.y [m]", "bodies.a.params.length"]
    assert Axis.time("0:3:4").label == "time [s]"


def test_a_walker_is_hidden_half_hidden_and_in_the_clear(out_of_cover):
    hidden, half, clear = (s.found.occlusion for s in out_of_cover.steps)
    assert (hidden.blocked, hidden.by[0][0], hidden.point) == (1.0, "screen", "screen")
    assert half.blocked == pytest.approx(0.5, abs=half.error)
    assert (clear.blocked, clear.by, clear.point) == (0.0, (), "")


def test_direct_level_is_the_radar_equation_over_thermal_noise(out_of_cover):
    hidden, _, clear = (s.found.levels["direct"] for s in out_of_cover.steps)
    assert (hidden.power, hidden.margin_db, hidden.range) == (0.0, -np.inf, None)
    distance = np.hypot(10.0, 1.0)
    assert clear.margin_db == pytest.approx(reported(distance), abs=0.3)  # at most 0.2 dB between cells
    assert clear.range == pytest.approx(distance, abs=0.05)


def test_what_is_detected_reads_its_level(out_of_cover):
    hidden, _, clear = out_of_cover.steps
    assert hidden.seen is None
    assert clear.seen.label == "direct"
    assert clear.seen.snr_db == pytest.approx(clear.found.levels["direct"].margin_db + 20.0, abs=1.0)
    assert clear.seen.range == pytest.approx(np.hypot(10.0, 1.0), abs=0.05)
    assert clear.seen.speed == pytest.approx(2.0 / np.hypot(10.0, 1.0), abs=0.1)


def test_just_behind_an_edge_a_quarter_of_the_field_returns(scene):
    # Half the field at the shadow's boundary (Sommerfeld), on the way in and on the way out: 12 dB.
    behind = visibility(simulate(scene.override([f"bodies.walker.position.y={-1e-4 - gone(scene)}"])), "walker")
    assert behind.levels["direct"].power == 0.0
    assert behind.levels["diffracted"].margin_db == pytest.approx(reported(10.0) - 12.04, abs=0.5)


def test_the_ghost_over_a_mirror_is_told_apart_from_the_direct_return():
    aside = ["bodies.walker.position.y=1", "bodies.screen.position.y=-60"]
    scene = Scene.from_text(TEXT + HOUSE).override(aside)
    found = sweep(scene, "walker").steps[0].found
    direct, image = np.hypot(10.0, 1.0), np.hypot(2 * FACE - 10.0, 1.0)
    assert found.levels["direct"].range == pytest.approx(direct, abs=0.05)
    assert found.levels["multipath"].range == pytest.approx(0.5 * (direct + image), abs=0.05)
    # One way over the mirror, the other straight: both orders add as waves, so 6 dB over one of them.
    one = reported(np.sqrt(direct * image)) + 20 * np.log10(2.0)
    assert found.levels["multipath"].margin_db == pytest.approx(one, abs=0.4)
    alone = sweep(scene.override(["model.max_bounces=1"]), "walker").steps[0].found
    assert alone.levels["multipath"].power == 0.0


def test_a_mesh_target_counts_with_all_its_parts_and_its_diffraction_is_unknown(scene):
    found = sweep(scene, "screen").steps[0]
    assert found.found.levels["direct"].margin_db > 0.0
    assert found.found.levels["diffracted"] is None
    assert found.seen.bodies.startswith("screen")


def test_time_moves_the_bodies_as_their_velocities_say(scene):
    by_time = sweep(scene, "walker", [Axis.time("0.25:0.5:2")])
    by_place = sweep(scene, "walker", [Axis.of("bodies.walker.position.y=-0.5:0:2")])
    for t, p in zip(by_time.steps, by_place.steps, strict=True):
        assert t.found.occlusion == p.found.occlusion
        assert [x.power for x in t.found.levels.values()] == pytest.approx([x.power for x in p.found.levels.values()])


def test_two_keys_make_a_grid_with_the_last_fastest(scene, tmp_path):
    axes = [Axis.of("bodies.walker.position.y=-1:1:2"), Axis.of("radar.power_dbm=0:30:2")]
    done = sweep(scene, "walker", axes)
    assert [s.values for s in done.steps] == [(-1, 0), (-1, 30), (1, 0), (1, 30)]
    assert [s.seen is not None for s in done.steps] == [False, False, False, True]
    weak, strong = (s.found.levels["direct"].margin_db for s in done.steps[2:])
    assert strong - weak == pytest.approx(30.0, abs=1e-6)
    assert sweep_picture(done, tmp_path / "grid.png").stat().st_size > 10_000
    with open(write_csv(done, tmp_path / "grid.csv"), newline="") as file:
        rows = list(csv.DictReader(file))
    assert [r["detected"] for r in rows] == ["no", "no", "no", "yes"]
    assert [float(r["radar.power_dbm"]) for r in rows] == [0, 30, 0, 30]
    assert rows[0]["blocked_by"] == "screen:1.00000" and rows[0]["direct_db"] == "-inf"


def test_the_ground_and_the_radars_own_carrier_are_no_targets():
    other = TEXT.replace('name = "walker"', 'name = "ego"') + '[[bodies]]\nname = "road"\nshape = "ground"\n'
    for target in ("ego", "road"):
        with pytest.raises(ValueError, match=f"'{target}' is the ground or the radar's own vehicle"):
            sweep(Scene.from_text(other), target)


def test_noise_off_leaves_levels_without_a_threshold(scene):
    found = sweep(scene.override(["radar.noise=false", "bodies.walker.position.y=1"]), "walker").steps[0].found
    assert found.levels["direct"].power > 0.0
    assert found.levels["direct"].margin_db is None


def test_numbers_of_a_vector_go_by_their_letters(scene):
    moved = scene.override(["bodies.walker.position.x=8", "bodies.walker.position.z=0.2"])
    assert list(moved.facets().origin[1]) == [8.0, -1.0, 0.2]
    for change, says in (
        ("bodies.walker.position.w=1", "allowed: one of x, y, z"),
        ("bodies.walker.position.y.z=1", "bodies.walker.position.y: holds no keys"),
        ("radar.velocity_mps.x=1", r"radar\.velocity_mps: is not set; allowed: all three numbers"),
    ):
        with pytest.raises(SceneError, match=says):
            scene.override([change])


def test_what_cannot_be_swept_is_told(scene):
    with pytest.raises(ValueError, match="at most two"):
        sweep(scene, "walker", [Axis.of(f"radar.{k}=0:1:2") for k in ("power_dbm", "yaw_deg", "pitch_deg")])
    with pytest.raises(ValueError, match="varied twice"):
        sweep(scene, "walker", [Axis.of("radar.yaw_deg=0:1:2")] * 2)
    with pytest.raises(SceneError, match=r"radar is inside 'walker' \(step bodies\.walker\.position\.x = 0\)"):
        sweep(scene.override(["bodies.walker.position.y=0"]), "walker", [Axis.of("bodies.walker.position.x=9:0:2")])


def test_the_command_writes_a_table_and_a_figure_and_tells_the_steps(file, tmp_path, capsys):
    out = tmp_path / "out"
    vary = "bodies.walker.position.y=-1:1:2"
    assert invoke(["study", "sweep", str(file), "--target", "walker", "--vary", vary, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "walker is detected in 1 of 2 steps" in said
    assert "screen" in said and "none" in said
    assert {p.name for p in out.iterdir()} == {"sweep.csv", "sweep.png"}
    assert (out / "sweep.png").stat().st_size > 10_000
    lines = (out / "sweep.csv").read_text().splitlines()
    assert len(lines) == 3 and lines[0].startswith("bodies.walker.position.y,detected,label,range_m")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--target", "waker"], "no body 'waker'"),
        (["--target", "walker", "--vary", "bodies.walker.positon.y=0:1:2"], "did you mean 'position'"),
        (["--target", "walker", "--vary", "bodies.waker.position.y=0:1:2"], "did you mean 'walker'"),
        (["--target", "walker", "--vary", "bodies.walker.position.w=0:1:2"], "one of x, y, z"),
        (["--target", "walker", "--vary", "radar.power_dbm=3"], "START:STOP:STEPS"),
        (["--target", "walker", "--vary", "radar.waveform.chirps=-1:1:2"], "chirps"),
        (["--target", "walker", "--times", "now"], "START:STOP:STEPS in seconds"),
        (["--target", "walker", "--set", "radar.powr_dbm=3"], "power_dbm"),
        (["--vary", "radar.power_dbm=0:1:2"], "--target"),
    ],
)
def test_wrong_words_are_told_in_a_sentence_and_write_nothing(options, words, file, tmp_path, capsys):
    assert invoke(["study", "sweep", str(file), "--out", str(tmp_path / "out"), *options]) == 2
    said = capsys.readouterr().err
    assert words in said and "Traceback" not in said
    assert [p.name for p in tmp_path.iterdir()] == [file.name]


_STOPPED = """
import os, signal, sys
import raychan.study.visibility, raychan.cli
# A job in the background starts deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
raychan.study.visibility.occlusion = lambda *a, **k: os.kill(os.getpid(), signal.SIGINT)
sys.exit(raychan.cli.invoke(["study", "sweep", {scene!r}, "--target", "walker", "--out", {out!r}]))
"""


def test_ctrl_c_in_the_first_step_of_a_sweep_leaves_nothing(file, tmp_path):
    code = _STOPPED.format(scene=str(file), out=str(tmp_path / "out"))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (130, ""), done.stderr
    assert but_compiling(done.stderr) == "raychan: interrupted; nothing was written\n"
    assert [p.name for p in tmp_path.iterdir()] == [file.name]


def test_the_diffracted_level_of_a_walker_is_that_of_one_at_rest_where_it_is_at_mid_frame(scene):
    def level(velocity, y):
        changes = [f"bodies.walker.velocity_mps=[0, {velocity}, 0]", f"bodies.walker.position.y={y}"]
        return visibility(simulate(scene.override(changes)), "walker").levels["diffracted"].margin_db

    middle = level(0.0, -0.1)
    assert level(20.0, -0.1 - 10.0 * gone(scene)) == pytest.approx(middle, abs=0.05)
    assert level(0.0, -0.1 - 10.0 * gone(scene)) < middle - 1.0
