"""How long steps of a refinement and what follows them take, by what steps took so far; a step that takes too long."""

import math

import numpy as np
import pytest

import raychan as rc
from raychan.run.clock import Clock
from raychan.run.refinement import seconds as refinement_seconds
from raychan.run.refinement.seconds import Pace, StepRays
from raychan.run.scene_channel import channel_of
from raychan.run.simulate import result_of
from raychan.tracing.shooting import Wanted
from raychan.tracing.sources import source_of
from raychan.tracing.stats import Further, Stats

WAVEFORM = {"bandwidth_mhz": 300, "chirp_us": 30, "chirps": 8, "samples": 64}


def scene(**model):
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.3}, position=(8.0, 0.0, 0.6))
    box = rc.Body(
        "box", shape="box", params={"length": 0.5, "width": 0.5, "height": 0.5}, position=(9.0, 1.5, 0.6), yaw_deg=20.0
    )
    ground = rc.Body("ground", shape="ground", material="asphalt")
    radar = {"waveform": WAVEFORM, "position": (0.0, 0.0, 0.6), "power_dbm": 20.0}
    return rc.Scene(bodies=[ball, box, ground], radar=radar, model={"max_rays": 10**9, "tolerance_db": 0.02} | model)


def launch(depth, rays):
    """Return a further launch from the first two of four facets, over leg 0."""
    return Further(None, [], Stats(rays=rays), [(0, Wanted(np.arange(4) < 2, depth, frozenset({0})), rays)])


def sources(depth, *facets):
    return np.array([int(source_of(np.array(0), np.array(0), np.array(depth), np.array(i))) for i in facets])


def test_a_step_is_foreseen_by_the_rays_that_each_facet_took_at_its_bounce(monkeypatch):
    """600 and 10,000 rays of two facets: one step on each takes four times as many, two steps on sixteen times."""
    monkeypatch.setattr(refinement_seconds, "_DEARER", 1.0)
    rays, own = StepRays(4), sources(2, 0)
    rays.learn([(1, launch(1, 600)), (1, launch(2, 10_000))])
    assert rays.of(own, np.array([2])) == pytest.approx(20_000)
    assert rays.of(own, np.array([3])) == pytest.approx(80_000)
    assert rays.of(sources(1, 0, 1), np.array([2, 2])) == pytest.approx(2_400)


def test_steps_that_took_more_rays_than_foreseen_make_the_next_ones_dearer():
    rays, own = StepRays(4), sources(2, 0, 1)
    rays.learn([(1, launch(2, 10_000))])
    assert rays.of(own, np.array([2, 2])) == pytest.approx(1.2 * 40_000)
    rays.learn([(2, launch(2, 120_000))])
    assert rays.of(own, np.array([3, 3])) == pytest.approx(3.0 * 480_000)


def test_what_follows_the_steps_is_kept_for_it(monkeypatch):
    """A million rays in 2 s brought 100,000 paths: of 10 s the first launch took 1 s, and the paths take 0.26 s."""
    now = [101.0]
    monkeypatch.setattr(refinement_seconds.time, "perf_counter", lambda: now[0])
    pace = Pace(10.0, 100.0, 0.0, 500, 0)
    now[0] = 103.0
    pace.stepped(1_000_500, 100_000)
    assert pace.end(0.0) == pytest.approx(109.74)
    assert pace.end(1e6) == pytest.approx(109.48)
    assert now[0] + 2e-6 * pace.rays == pytest.approx(pace.end(pace.rays))
    looked = Pace(10.0, 100.0, 0.5, 500, 0)
    assert looked.end(0.0) == pytest.approx(108.0)
    assert Pace(None, 100.0, 0.5, 500, 0).rays == math.inf


def test_a_step_that_takes_too_long_is_given_up_and_nothing_of_it_counts(monkeypatch):
    whole, once = (rc.simulate(scene(max_seconds=s)) for s in (1e6, 0.0))
    assert whole.stats["refinements"] > 1 and once.stats["refinements"] == 1
    monkeypatch.setattr(Pace, "end", lambda self, rays: math.inf if rays == 0.0 else -math.inf)
    found = rc.simulate(scene(max_seconds=1e6))
    assert found.stats["refinements"] == 1 and found.paths == once.paths and found.detections == once.detections
    assert any("refined once, ended by the budget of seconds (model.max_seconds): " in x for x in found.warnings)


def test_the_seconds_of_a_run_are_not_asked_where_none_are_given():
    free, ample = rc.simulate(scene()), rc.simulate(scene(max_seconds=1e6))
    assert free.paths == ample.paths and free.warnings == ample.warnings


def test_the_line_on_seconds_counts_what_follows_the_tracing():
    of, clock = scene(max_seconds=1e4, tolerance_db=3.0), Clock()
    channel = channel_of(of, None, None, clock)
    line = "the run took longer than the 10000 s allowed"
    assert not any(line in x for x in result_of(of, channel, 0, clock).warnings)
    clock.timings["check"] = 1e4
    assert any(line in x for x in result_of(of, channel, 0, clock).warnings)
