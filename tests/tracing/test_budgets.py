"""Budgets: a mesh that hides itself a thousand times over ends in seconds, and that it was cut short is said."""

import signal
import subprocess
import sys
import time
import warnings
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import raychan as rc
from raychan.cli import app
from raychan.run.clock import Clock
from raychan.run.cross_section.single_body import facets_of
from raychan.run.messages.launches import uncut
from raychan.run.rules import demand, fine_rule
from raychan.run.scene_channel import channel_of
from raychan.run.simulate import result_of
from raychan.tracing.contributions import Contributions
from raychan.tracing.solver import launch_routes
from raychan.tracing.stats import Stats
from raychan.tracing.tubes import Refinement
from raychan.world.geometry import Geometry


def tangle(count: int, seed: int) -> trimesh.Trimesh:
    """Random facets through each other on few corners."""
    rng = np.random.default_rng(seed)
    return trimesh.Trimesh(rng.normal(0.0, 0.4, (60, 3)), rng.integers(0, 60, (count, 3)), process=False)


def test_a_launch_cuts_as_often_as_it_may_and_counts_the_rest():
    geometry = Geometry(facets_of(trimesh.creation.box(), "pec", 77e9))
    facet = np.zeros(10, np.int32)
    found = Contributions(Refinement(wavenumber=1.0, max_cuts=7))
    every = np.ones(10, bool)
    assert found.budget.affords(geometry, facet[:4], every[:4]).all()
    assert found.budget.affords(geometry, facet, every).sum() == 3
    assert found.budget.spent(geometry)
    assert not found.budget.affords(geometry, facet, every).any()
    assert found.budget.uncut.tolist() == [17]


def test_a_mesh_of_facets_through_each_other_keeps_to_the_rays_that_it_may_cast():
    most = 20_000
    found = rc.rcs(tangle(300, 1), 77e9, 20.0, tolerance_db=1.0, max_bounces=2, max_rays=most)
    assert int(found.rays) < 3 * most
    assert np.isfinite(found.sigma)


_SCENE = """
[radar]
position = [0, 0, 0]
waveform = {bandwidth_mhz = 500.0, chirp_us = 20.0, chirps = 8, samples = 64}
[model]
tolerance_db = 6.0
max_bounces = 1
[[bodies]]
name = "knot"
mesh = "knot.ply"
material = "pec"
position = [4, 0, 0]
"""


def test_a_scene_whose_tubes_were_too_many_to_cut_names_the_body(tmp_path):
    tangle(60, 2).export(tmp_path / "knot.ply")
    file = tmp_path / "scene.toml"
    file.write_text(_SCENE)
    scene = rc.Scene.load(file)
    whole = channel_of(scene, None, None, Clock(None))
    told = []
    for cuts in (np.inf, 20.0):
        rule = fine_rule(scene.radar, scene.processing, scene.model)
        stats = Stats()
        limited = replace(rule, refinement=replace(rule.refinement, max_cuts=cuts))
        for _ in launch_routes(whole.geometry, whole.points, limited, stats):
            pass
        result = result_of(scene, replace(whole, warnings=uncut(whole.geometry, stats)), 0, Clock(None))
        told.append([w for w in result.warnings if "are coarser than" in w])
    assert whole.warnings == () and told[0] == []
    assert len(told[1]) == 1 and "'knot'" in told[1][0]


@pytest.mark.parametrize("size", [40, 400])
def test_an_stl_cut_short_says_how_many_bytes_are_missing(size, tmp_path):
    file = tmp_path / "box.stl"
    file.write_bytes(trimesh.creation.box().export(file_type="stl")[:size])
    ran = CliRunner().invoke(app, ["info", str(file)])
    assert isinstance(ran.exception, rc.SceneError)
    assert f"cut short, or no STL: {size} bytes there" in str(ran.exception)


def test_a_long_frame_of_fast_bodies_is_told_to_take_longer_than_one_that_stands():
    base = rc.Scene.load("occluded_pedestrian").override(["radar.waveform.chirps=100000", "radar.waveform.samples=16"])
    name = base.bodies[-1].name
    fast = base.override([f"bodies.{name}.velocity_mps=[30, 0, 0]"])
    faster = base.override([f"bodies.{name}.velocity_mps=[60, 0, 0]"])
    assert demand(faster).seconds > 1.5 * demand(fast).seconds


def test_corners_at_infinity_are_told_without_a_word_of_arithmetic(tmp_path):
    box = trimesh.creation.box()
    box.vertices[3, 1] = np.inf
    file = tmp_path / "far.stl"
    with np.errstate(all="ignore"):
        file.write_bytes(box.export(file_type="stl"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ran = CliRunner().invoke(app, ["info", str(file)])
    assert "hold NaN or infinity" in str(ran.exception)


_TOLD_TO_END = """
import time, raychan.run.simulate, raychan.cli
def trace(*a):
    print("ready", flush=True)
    time.sleep(60.0)
raychan.run.simulate.channel_of = trace
raychan.cli.main(["run", "occluded_pedestrian", "--out", {out!r}])
"""


def test_a_run_told_to_end_ends_with_143_and_leaves_nothing(tmp_path):
    code = _TOLD_TO_END.format(out=str(tmp_path / "out"))
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen([sys.executable, "-c", code], **pipes)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 143, said
    assert said.endswith("raychan: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == []
