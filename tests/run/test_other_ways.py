"""Routes the other way round: what a coarse launch finds one way only is looked for the other way."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

import raychan as rc
from raychan.channel.paths import of_trajectories, paths_of
from raychan.radar.dual_paths import scaled
from raychan.run.refinement.other_ways import OtherWays, last_facets
from raychan.run.rules import fine_rule
from raychan.tracing.solver import Launch
from raychan.tracing.sources import depth_of, facet_of, legs_of
from raychan.tracing.stats import Stats
from raychan.world.geometry import geometry_of

WAVE = rc.Waveform(77e9, 500e6, 40e-6, n_chirps=32, n_samples=64)


def bench_scene(tolerance, rx=None):
    """Return a bench whose legs and rail make corners: rays that start on the rail are mostly hidden."""
    bench = rc.Body(name="bench", shape="bench", position=(8.047, -1.778, 0.0), yaw_deg=-129.73)
    radar = rc.Radar(WAVE, position=(0.0, 0.0, 0.519), rx_position=rx, power=0.3)
    return rc.Scene(bodies=[bench], radar=radar, model={"max_bounces": 2, "tolerance_db": tolerance})


@pytest.mark.parametrize("tolerance", [1.0, 0.5])
def test_an_echo_of_corners_that_a_coarse_launch_sees_one_way_has_the_level_of_a_fine_run(tolerance):
    """Without the other way it is 1.1 dB too weak of 0.39 stated, at 0.5 dB."""
    found, fine = (rc.simulate(bench_scene(t)) for t in (tolerance, 0.05))
    off = abs(found.detections.snr[0] - fine.detections.snr[0])
    assert off < 0.25
    assert off < found.detections.error_db[0] + fine.detections.error_db[0]


@pytest.mark.parametrize("rx", [None, (0.2, 0.6, 0.8)])
def test_routes_turned_round_twice_have_their_own_source_and_are_those_of_a_fine_launch(rx):
    scene = bench_scene(0.1, rx)
    launch = Launch(geometry_of(scene), scene.points(0.0), fine_rule(scene.radar, scene.processing, scene.model))
    found = [(last_facets(b), s) for b, s in launch.whole(Stats(), lambda batch: batch)]
    last, source = (np.concatenate(x) for x in zip(*found, strict=True))
    deep = depth_of(source) == 2
    assert deep.sum() > 50
    source, last = source[deep], last[deep]
    turned = launch.turned_round(source, last)
    np.testing.assert_array_equal(facet_of(turned), last)
    np.testing.assert_array_equal(launch.turned_round(turned, facet_of(source)), source)
    many = len(launch.legs)
    if rx is None:
        np.testing.assert_array_equal(legs_of(turned)[0], legs_of(source)[1])
    else:
        assert ((legs_of(turned)[0] >= many) != (legs_of(source)[0] >= many)).all()
    # Rays reach the other surface at their ends only: a few routes have no other way.
    assert np.isin(turned, source).mean() > 0.9


def launched(scene):
    """Return a launch over a scene, and its first batch of deep routes: sources, last facets and paths."""
    launch = Launch(geometry_of(scene), scene.points(0.0), fine_rule(scene.radar, scene.processing, scene.model))
    found = ((b, s) for b, s in launch.whole(Stats(), lambda b: b) if (depth_of(s) > 1).any())
    batch, source = next(found)
    paths = paths_of(batch, launch.geometry.facets, scene.radar, scene.radar.waveform.carrier, 1e-12)
    return launch, source, last_facets(batch), paths


def test_missing_sources_are_those_that_a_slow_search_tells():
    launch, source, last, paths = launched(bench_scene(1.0))
    ways, amplitude = OtherWays(launch), defaultdict(float)
    ways.add(source, last, paths)
    for k, size in zip(paths.trajectory, np.abs(paths.amplitude), strict=True):
        amplitude[int(source[k]), int(last[k])] += size
    deep = np.unique(source[depth_of(source) > 1])
    wanted = deep[::3]
    lack, least = defaultdict(float), defaultdict(float)
    for (own, facet), size in amplitude.items():
        if own in wanted and own in deep:
            other = int(launch.turned_round(np.array([own]), np.array([facet]))[0])
            lack[other] += max(size - amplitude.get((other, own & 0x7FFFFFFF), 0.0), 0.0)
            least[other] = max(least[other], 0.1 * sum(x for (s, _), x in amplitude.items() if s == own))
    slow = {s for s in lack if lack[s] > least[s]} - set(wanted.tolist())
    absent, weak = slow - set(source.tolist()), slow & set(source.tolist())
    assert absent
    assert weak
    assert set(ways.missing(wanted).tolist()) == slow
    assert not len(ways.missing(wanted))
    assert not len(ways.missing(wanted[:0]))


def test_ways_that_bring_alike_both_ways_are_not_traced_again():
    """Each route is noted both ways, with one amplitude: nothing is missing; of a weaker way it is."""
    launch, source, last, paths = launched(bench_scene(1.0))
    rows = np.flatnonzero(depth_of(source) > 1)[:1]
    other = launch.turned_round(source[rows], last[rows])
    for share, missing in ((1.0, []), (0.95, []), (0.5, other.tolist())):
        ways, one = OtherWays(launch), of_trajectories(paths, np.arange(len(source)) == rows[0])
        ways.add(source[rows], last[rows], one)
        ways.add(other, facet_of(source[rows]).astype(np.int32), scaled(one, share))
        assert ways.missing(source[rows]).tolist() == missing


def test_a_way_round_that_a_coarse_launch_finds_weakly_has_the_level_of_a_fine_run():
    """A wall's image shows a slat of a bench to the radar in part: 1.1 dB too weak of 0.61 stated, by more rays, where
    only ways are looked for that are not found at all."""
    place, moves = (7.344935, -1.803932, 0.0), (-2.930655, -1.042961, 0.0)
    bench = rc.Body("bench", shape="bench", position=place, yaw_deg=-80.187264, velocity=moves)
    size = {"length": 8.63352, "height": 3.0}
    wall = rc.Body("wall", shape="wall", params=size, material="metal", position=(7.940345, -3.363581, 0.0))
    wave = rc.Waveform(24e9, 300e6, 40e-6, n_chirps=32, n_samples=64)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.98237), power=0.138129, noise_figure_db=15.0, noise=False)
    found, fine = (
        rc.simulate(rc.Scene(bodies=[bench, wall], radar=radar, model={"max_bounces": 3, "tolerance_db": t}))
        for t in (1.0, 0.25)
    )
    levels, errors = zip(*(_strongest_near(result, 8.5, 0.15) for result in (found, fine)), strict=True)
    assert abs(levels[0] - levels[1]) < sum(errors)


@pytest.mark.parametrize("tolerance", [1.0, 0.5])
def test_an_echo_over_the_ground_and_legs_seen_in_part_has_the_level_of_a_fine_run(tolerance):
    """A bar between the legs is hidden but for parts that each lie below the noise, and the back returns over the legs
    as found late: without either 1.1 and 1.3 dB too strong of 0.73 and 0.45 stated."""
    bench = rc.Body("bench", shape="bench", position=(25.9565, -3.7201, 0.0), yaw_deg=173.3324)
    radar = {
        "position": (0.0, 0.0, 1.1829), "yaw_deg": -2.1286, "velocity_mps": (2.5754, 0.0, 0.0), "polarization": "H",
        "power_dbm": 12.0,
        "waveform": {"carrier_ghz": 77.0, "bandwidth_mhz": 500.0, "chirp_us": 40.0, "chirps": 64, "samples": 256},
    }  # fmt: skip
    bodies = [rc.Body("ground", shape="ground"), bench]
    found, fine = (
        rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "tolerance_db": t}))
        for t in (tolerance, 0.2)
    )
    levels, errors = zip(*(_strongest_near(result, 26.94) for result in (found, fine)), strict=True)
    assert abs(levels[0] - levels[1]) < sum(errors)


def _strongest_near(result, distance, within=0.1):
    """Return the level that its paths have and the error [dB] of the strongest detection near a range, both [m]."""
    d = result.detections
    i = max(np.flatnonzero(np.abs(d.range - distance) < within), key=lambda k: d.power[k])
    return 10.0 * np.log10(result.provenance[i].predicted), d.error_db[i]
