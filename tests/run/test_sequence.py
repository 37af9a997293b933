"""Sequences: frame by frame the poses advance; frame 0 is the single run, frame k the run of the scene moved there."""

from __future__ import annotations

import csv
import subprocess
import sys

import numpy as np
import pytest
from support.results import assert_same
from support.scene_texts import PLATE

import raychan as rc
from raychan.cli import invoke
from raychan.run.sequence import Store, frames, overlap
from raychan.run.storage import load_result
from raychan.run.turning import moves_as_one

SCENE = f"""{PLATE}
[[bodies]]
name = "box"
shape = "box"
position = [6.0, 2.0, 0.0]
velocity_mps = [0.0, -4.0, 0.0]
turn_rate_dps = 90.0
spin_dps = [30.0, 0.0, 0.0]
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_frame_0_is_the_single_run_and_frame_k_the_run_of_the_scene_at_its_time(file):
    scene = rc.Scene.load(file)
    made = list(frames(scene, 3, 0.1, seed=7))
    assert [(f.number, f.time) for f in made] == [(0, 0.0), (1, 0.1), (2, 0.2)]
    assert_same(made[0].result, rc.simulate(scene, seed=7))
    assert_same(made[2].result, rc.simulate(scene.at(0.2), seed=9))


def test_frames_that_overlap_in_time_are_told_once(file, tmp_path, capsys):
    lasts = rc.Scene.load(file).radar.waveform.frame_duration
    command = ["run", str(file), "--no-pictures", "--out", str(tmp_path / "o"), "--max-bounces", "1"]
    for count, interval, lines in ((2, 0.5 * lasts, 1), (1, 0.5 * lasts, 0), (2, lasts, 0), (2, 2.0 * lasts, 0)):
        assert invoke([*command, "--frames", str(count), "--frame-interval", str(interval)]) == 0
        said = " ".join(capsys.readouterr().err.split())
        told = f"frames overlap in time: one lasts {lasts:g} s, and the next begins after {interval:g} s"
        assert said.count(told) == said.count("overlap in time") == lines, (count, interval, said)
    assert overlap(rc.Scene.load(file), 2, None) == []


def test_a_scene_moved_in_python_is_the_scene_written_there(file):
    moved = rc.Scene.load(file).at(0.5)
    place = "bodies.box.position=[6.0, 0.0, 0.0]"
    written = rc.Scene.load(file).override(["radar.position=[2.5, 0.0, 1.0]", place])
    body = moved.bodies[1].motion
    # Turned by 45 deg about the vertical, then by 15 deg about its own x.
    np.testing.assert_allclose(body.rotation() @ [1, 0, 0], np.array([1, 1, 0]) / np.sqrt(2), atol=1e-12)
    np.testing.assert_allclose((body.rotation() @ [0, 0, 1])[2], np.cos(np.radians(15.0)), atol=1e-12)
    np.testing.assert_allclose(moved.radar.position, written.radar.position)
    np.testing.assert_allclose(moved.bodies[1].motion.origin(), written.bodies[1].motion.origin(), atol=1e-12)
    np.testing.assert_allclose(moved.facets().vertices, rc.Scene.load(file).facets(0.5).vertices, atol=1e-12)
    np.testing.assert_allclose(moved.facets().spin, rc.Scene.load(file).facets(0.5).spin, atol=1e-12)


def test_what_moves_with_the_radar_is_traced_once_and_only_its_noise_differs(file):
    together = [f"bodies.{k}" for k in ("box.turn_rate_dps=0", "box.spin_dps=[0,0,0]")]
    together += [f"bodies.{b}.velocity_mps=[5, 0, 0]" for b in ("sign", "box")]
    scene = rc.Scene.load(file).override(together)
    assert moves_as_one(scene) and not moves_as_one(rc.Scene.load(file))
    first, second = (f.result for f in frames(scene, 2, 0.5, seed=3))
    assert first.stats["rays"] > 0 and second.stats["rays"] == 0
    traced = rc.simulate(scene.at(0.5), seed=4)
    # The same paths, found anew 2.5 m further on: all that differs is rounding.
    order = [np.lexsort((np.abs(r.paths.amplitude), r.paths.delay)) for r in (second, traced)]
    np.testing.assert_allclose(second.paths.delay[order[0]], traced.paths.delay[order[1]], rtol=1e-9)
    scale = np.abs(traced.rdmap.spectrum).max()
    np.testing.assert_allclose(second.rdmap.spectrum / scale, traced.rdmap.spectrum / scale, atol=2e-5)
    np.testing.assert_allclose(
        second.paths.vertices.max(axis=(0, 1)), traced.paths.vertices.max(axis=(0, 1)), atol=0.01
    )
    assert not np.array_equal(first.cube.samples, second.cube.samples)


@pytest.mark.parametrize("bad", [{"count": 0}, {"count": 2, "interval": 0.0}, {"count": 2, "interval": float("nan")}])
def test_bad_arguments_are_told_before_anything_is_computed(file, bad):
    with pytest.raises(ValueError, match=r"must lie between"):
        frames(rc.Scene.load(file), **bad)


def test_a_radar_that_will_run_into_a_body_is_told_before_the_first_frame(file, tmp_path, capsys):
    keys = ("box.position=[6, 0, 0]", "box.velocity_mps=[0, 0, 0]", "box.spin_dps=[0, 0, 0]")
    change = [word for key in keys for word in ("--set", f"bodies.{key}")] + ["--set", "radar.position=[0, 0, 0.5]"]
    command = ["run", str(file), "--out", str(tmp_path / "o"), "--frames", "3", "--frame-interval", "0.6", *change]
    assert invoke(command) == 2
    said = capsys.readouterr().err
    assert "radar is inside 'box' 1.2 s on" in said and not (tmp_path / "o").exists()


def test_the_command_writes_a_directory_a_frame_and_one_list_of_detections(file, tmp_path, capsys):
    out = tmp_path / "out"
    command = ["run", str(file), "--out", str(out), "--no-pictures", "--frame-interval", "0.1"]
    assert invoke([*command, "--frames", "3"]) == 0
    assert {p.name for p in out.iterdir()} == {"detections.csv", "frame_0000", "frame_0001", "frame_0002"}
    assert invoke(["run", str(file), "--out", str(tmp_path / "one"), "--no-pictures"]) == 0
    whole = list(csv.DictReader((out / "detections.csv").read_text().splitlines()))
    alone = list(csv.DictReader((tmp_path / "one" / "detections.csv").read_text().splitlines()))
    first = [{k: v for k, v in row.items() if k not in ("frame", "time_s")} for row in whole if row["frame"] == "0"]
    assert first == alone
    assert {(row["frame"], row["time_s"]) for row in whole} <= {(str(k), f"{0.1 * k:.6f}") for k in range(3)}
    sign = [float(row["range_m"]) for row in whole if row["bodies"] == "sign"]
    assert sign == pytest.approx([9.0, 8.5, 8.0], abs=0.1)
    # Each frame is a result of its own, at the poses of its time.
    later = load_result(out / "frame_0002")
    assert later.scene.radar.position[0] == pytest.approx(1.0)
    assert invoke(["explain", str(out / "frame_0002"), "--range", "8"]) == 0
    # A shorter sequence leaves no frame of the longer one behind.
    assert invoke([*command, "--frames", "1"]) == 0
    assert {p.name for p in out.iterdir()} == {"detections.csv", "frame_0000"}
    assert invoke(command) == 2
    assert "--frames" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name, said",
    [
        ("frame_0000", "frame_0000: is a file in the place of a directory"),
        ("frame_0001", "frame_0001: is a file in the place of a directory"),
        ("frame_0001/detections.csv", "frame_0001/detections.csv: exists"),
        ("detections.csv", "detections.csv: exists"),
    ],
)
def test_files_of_ones_own_in_the_place_of_frames_are_told_and_stay(name, said, file, tmp_path, capsys):
    mine = tmp_path / "out" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert invoke(["run", str(file), "--out", str(tmp_path / "out"), "--no-pictures", "--frames", "2"]) == 2
    told = capsys.readouterr().err
    assert said in told and "move it away or name another folder" in told
    assert [p for p in (tmp_path / "out").rglob("*") if p.is_file()] == [mine] and mine.read_text() == "mine"


def test_other_files_of_ones_own_beside_and_in_frames_stay(file, tmp_path):
    names = ("frame_0000/notes.txt", "frame_0001/notes.txt", "frame_0000.png", "frame_000")
    for name in names:
        (tmp_path / "out" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "out" / name).write_text("mine")
    assert invoke(["run", str(file), "--out", str(tmp_path / "out"), "--no-pictures", "--frames", "2"]) == 0
    assert [(tmp_path / "out" / name).read_text() for name in names] == 4 * ["mine"]
    assert (tmp_path / "out" / "frame_0001" / "result.nc").is_file()
    assert not list((tmp_path / "out").rglob("*.kept"))


_STOPPED = """
import os, signal, sys
import raychan.cli, raychan.run.sequence as s
# A job in the background starts deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
def one_then_stop(*a, **k):
    yield next(real(*a, **k))
    os.kill(os.getpid(), signal.SIGINT)
real, s.frames = s.frames, one_then_stop
sys.exit(raychan.cli.invoke(["run", {scene!r}, "--out", {out!r}, "--frames", "9", "--no-pictures"]))
"""


def test_ctrl_c_keeps_the_frames_that_are_ready_and_says_so(file, tmp_path):
    code = _STOPPED.format(scene=str(file), out=str(tmp_path / "out"))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 130 and "1 of 9 frames is in" in done.stderr and "Traceback" not in done.stderr
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"detections.csv", "frame_0000"}


def test_memory_does_not_grow_with_the_number_of_frames(file, tmp_path):
    import gc
    import weakref

    store, seen = Store(tmp_path / "out"), []
    for frame in frames(rc.Scene.load(file), 4, 0.1):
        seen.append(weakref.ref(frame.result))
        store.add(frame)
        gc.collect()
        assert sum(ref() is not None for ref in seen) == 1, "only the frame at hand"


_READ_ONLY = """
import os, sys
allowed, os.access = os.access, lambda path, mode: False
import raychan
os.access = allowed
from raychan.signal.dechirp import beat_sum
import numpy as np
one = np.ones(1)
beat_sum(one + 0j, 1e-7 * one, 0.0 * one, 77e9, 1e13, 1e-5, 1e-7, 1, 4)
place = os.environ["NUMBA_CACHE_DIR"]
print(place, sum(len(files) for _, _, files in os.walk(place)))
"""


def test_where_no_place_for_compiled_loops_can_be_written_they_are_kept_for_the_process_only():
    import os

    free = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", _READ_ONLY], capture_output=True, text=True, timeout=120, check=False, env=free
    )
    assert done.returncode == 0, done.stderr
    place, kept = done.stdout.split()
    assert int(kept) > 0 and not os.path.exists(place), done.stderr


def test_warnings_on_bodies_that_stand_or_run_into_each_other_are_those_of_a_scene_made_there(file):
    """What was found of a pair that stands is kept; a pair of which one moves is looked at anew."""
    boxes = [
        rc.Body("stands", shape="box", position=(8.0, 3.0, 0.0)),
        rc.Body("leans", shape="box", position=(8.4, 3.4, 0.0)),
        rc.Body("comes", shape="box", position=(8.3, -2.3, 0.0), velocity=(0.0, 5.0, 0.0)),
    ]
    radar = rc.Scene.load(file).radar
    scene = rc.Scene(bodies=boxes, radar=radar)
    said = [[w for w in scene.at(t).warnings if "overlap" in w] for t in (0.0, 0.5, 1.0)]
    fresh = [[w for w in rc.Scene(bodies=boxes, radar=radar).at(t).warnings if "overlap" in w] for t in (0.0, 0.5, 1.0)]
    assert said == fresh
    assert [len(s) for s in said] == [1, 1, 3]
