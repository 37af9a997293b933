"""Launches too large to keep: samples, profile and stated error are those of all paths; the strongest explain them."""

import dataclasses

import numpy as np
import pytest

import raychan as rc
from raychan.run import path_stream, scene_channel
from raychan.run.clock import Clock
from raychan.run.path_stream import PathStream
from raychan.run.rules import check_rule, fine_rule
from raychan.run.simulate import result_of
from raychan.run.solver import solve_into

RADAR = {"waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 32, "samples": 64}}


def scene():
    bodies = [
        rc.Body("wall", shape="plate", params={"width": 3.0, "height": 2.0}, position=(8, 0, 0), yaw_deg=180.0),
        rc.Body("box", shape="box", params={"length": 1.0}, position=(12, 4, 0), velocity=(3, 0, 0)),
    ]
    return rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": 2})


def streamed(of, channel, rule):
    """Return what a launch brings where at most 100 routes are held and 40 are kept."""
    stream = PathStream(of.radar, of.processing.range_window, most=100, kept=40)
    solve_into(stream.add, channel.geometry, channel.points, of.radar, of.radar.waveform.carrier, rule)
    return stream.done()


@pytest.fixture
def both(monkeypatch):
    of = scene()
    monkeypatch.setattr(scene_channel, "_refined", lambda *_: None)  # as where there are too many paths to be held
    channel = scene_channel.channel_of(of, None, None, Clock(None))
    rules = [rule(of.radar, of.processing, of.model) for rule in (fine_rule, check_rule)]
    launched, others = (streamed(of, channel, rule) for rule in rules)
    few = dataclasses.replace(channel, launched=launched, others=others)
    return rc.simulate(of), result_of(of, few, 0, Clock(None))


def test_samples_profile_and_error_are_those_of_all_paths(both):
    every, some = both
    size = float(np.abs(every.cube.samples).max())
    assert some.cube.samples == pytest.approx(every.cube.samples, abs=1e-5 * size)
    assert some.profile.power == pytest.approx(every.profile.power, abs=1e-6 * every.profile.power.max())
    assert some.detections.range == pytest.approx(every.detections.range, abs=1e-6)
    strong = every.rdmap.power > 1e-3 * every.rdmap.power.max()
    assert 10 * np.log10(some.error.power[strong]) == pytest.approx(10 * np.log10(every.error.power[strong]), abs=0.5)


def test_the_strongest_paths_are_kept_and_it_is_told(both):
    every, some = both
    assert 0 < len(some.paths.delay) < len(every.paths.delay)
    assert len(some.paths.trajectories.kind) <= 40
    assert np.abs(some.paths.amplitude).max() == pytest.approx(np.abs(every.paths.amplitude).max())
    assert [*every.warnings] == [scene_channel._WHOLE] and f"{len(every.paths.delay):,} paths" in some.warnings[0]
    for a, b in zip(every.provenance, some.provenance, strict=True):
        assert (a.label, a.contributions[0].chain) == (b.label, b.contributions[0].chain)


def test_all_corners_of_the_ways_that_carry_most_are_kept():
    paths = rc.simulate(scene()).paths
    kept = path_stream.strongest(paths, 20)
    power = np.bincount(paths.trajectory, np.abs(paths.amplitude) ** 2)
    least = np.sort(power)[-20]
    rows = power[paths.trajectory] >= least
    assert kept.delay == pytest.approx(paths.delay[rows])
    assert kept.vertices == pytest.approx(paths.vertices[rows])
