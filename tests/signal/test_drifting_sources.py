"""Range rates at the elements of an array: each sees what crosses before it at a rate of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.echoes import SMALL, make_radar

import raychan as rc
from raychan.columns import take
from raychan.radar.array import Wavefronts
from raychan.records import POINT, REFLECT, Paths
from raychan.signal.baseband import synthesize
from raychan.units import C0

LINE = rc.uniform_array(9, 0.03)  # 0.24 m wide


def waves(n: int, seed: int) -> tuple[Wavefronts, np.ndarray]:
    """Return waves from points (n, 3) 0.5 to 20 m away that move, and these points."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3))
    points *= rng.uniform(0.5, 20.0, (n, 1)) / np.linalg.norm(points, axis=1, keepdims=True)
    far = np.linalg.norm(points, axis=1)
    look = points / far[:, None]
    drift = rng.normal(size=(n, 2, 3)) * 10.0
    return Wavefronts(look, far, look, far, np.zeros(n, bool), drift, np.zeros(n)), points


def test_rates_between_elements_are_those_of_the_distances():
    fronts, points = waves(200, 1)
    tx, rx, short = np.array([0.1, -0.2, 0.05]), np.array([-0.05, 0.3, 0.1]), 1e-6

    def far(end, off, time):
        return np.linalg.norm(points + time * fronts.drift[:, end] - off, axis=1)

    grown = sum(
        far(end, off, t) * sign / (2.0 * short) - far(end, 0.0, t) * sign / (2.0 * short)
        for end, off in enumerate((tx, rx))
        for t, sign in ((short, 1.0), (-short, -1.0))
    )
    np.testing.assert_allclose(fronts.faster(tx, rx), grown, atol=1e-6)


def test_no_element_sees_a_rate_further_off_than_the_bound():
    rng = np.random.default_rng(2)
    for seed in range(50):
        fronts, _ = waves(5, seed)
        tx, rx = rng.normal(size=(2, 3))
        tx, rx = tx * rng.uniform(0, 0.8) / np.linalg.norm(tx), rx * rng.uniform(0, 0.8) / np.linalg.norm(rx)
        most = fronts.fastest(float(np.linalg.norm(tx)), float(np.linalg.norm(rx)))
        assert np.abs(fronts.faster(tx, rx)).max() <= most * (1.0 + 1e-12)


def crossing(n: int, seed: int, instant: float) -> Paths:
    """Return paths over points that move, which stand where the vertices say at an instant [s]."""
    fronts, points = waves(n, seed)
    rng = np.random.default_rng(seed)
    drift = np.repeat(fronts.drift[:, :1], 2, axis=1)
    rate = 2.0 * (fronts.arrival * drift[:, 0]).sum(axis=1)
    return Paths.of(
        length=2.0 * fronts.radius - rate * instant,
        amplitude=rng.normal(size=(n, 2)) @ np.array([1.0, 1j]),
        length_rate=rate,
        departure=fronts.departure,
        arrival=fronts.arrival,
        body=np.zeros((n, 1), np.int16),
        part=np.zeros((n, 1), np.int16),
        kind=np.full((n, 1), POINT, np.int8),
        vertices=points[:, None],
        drift=drift,
        instant=np.full(n, instant),
        body_names=("point",),
        part_names=("",),
        tx=np.zeros(3),
        rx=np.zeros(3),
    )


@pytest.mark.parametrize("radar", [{}, {"tx_elements": [(0, -0.2, 0), (0, 0.2, 0.1)], "multiplexing": "tdm"}])
@pytest.mark.parametrize("instant", [0.0, 1e-3])
def test_the_fast_sum_is_the_exact_one(radar, instant):
    given = make_radar(SMALL, elements=LINE, **radar)
    paths = crossing(300, 3, instant)
    exact, fast = (synthesize(paths, given, method=method).samples for method in ("direct", "nufft"))
    assert np.abs(fast - exact).max() < 2e-6 * np.abs(paths.amplitude).sum() * np.sqrt(given.power)
    still = paths.replace(trajectories=paths.trajectories.replace(drift=np.zeros((300, 0, 3))))
    assert np.abs(synthesize(still, given).samples - exact).max() > 0.01 * np.abs(exact).max()


@pytest.mark.parametrize("retrace", [1, "auto"])
def test_a_crossing_target_has_at_each_element_the_rate_of_the_way_to_it(retrace):
    """Traced once with constant rates, else carried on."""
    sizes = {"repetition": 50e-6, "n_chirps": 256, "n_samples": 32}
    wave = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=40e-6, **sizes)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.0), elements=LINE, noise=False)
    place, velocity = np.array([4.0, 1.0, 0.3]), np.array([3.0, -8.0, 1.0])
    ball = rc.Body(name="ball", shape="sphere", params={"radius": 0.005}, rcs_dbsm=0.0)
    scene = rc.Scene(
        bodies=[replace(ball, position=tuple(place), velocity=tuple(velocity))], radar=radar, model={"retrace": retrace}
    )
    result = rc.simulate(scene)
    then = place + velocity * result.traced_at
    begun, ramp = wave.repetition * np.arange(256)[:, None], wave.chirp_duration / 32 * np.arange(32)
    time, slope = begun + ramp, wave.bandwidth / wave.chirp_duration

    def way(end):
        apart = then - end
        if retrace == "auto":
            return np.linalg.norm(apart + velocity * (time - result.traced_at)[..., None], axis=-1)
        far = np.linalg.norm(apart)
        return far + apart @ velocity / far * (time - result.traced_at)

    for samples, element in zip(result.cube.samples, radar.elements_world, strict=True):
        forth, back = way(np.zeros(3)), way(element)
        delay = (forth + back) / C0
        turns = wave.carrier * delay + slope * ramp * delay - 0.5 * slope * delay**2
        beat = np.exp(-2j * np.pi * turns) / (forth * back if retrace == "auto" else 1.0)
        share = np.vdot(beat, samples) / np.sqrt(np.vdot(beat, beat).real * np.vdot(samples, samples).real)
        assert abs(share) > 1.0 - 1e-5


def test_frames_traced_several_times_have_the_whole_way_to_each_element():
    sizes = {"repetition": 50e-6, "n_chirps": 128, "n_samples": 32}
    wave = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=40e-6, **sizes)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.0), elements=LINE, noise=False)
    place, velocity = np.array([6.0, 0.5, 0.0]), np.array([0.0, 10.0, 0.0])
    ball = {"name": "ball", "shape": "sphere", "params": {"radius": 0.005}, "rcs_dbsm": 0.0}
    body = rc.Body(**ball, position=tuple(place), velocity=tuple(velocity))
    samples = rc.simulate(rc.Scene(bodies=[body], radar=radar, model={"retrace": 9})).cube.samples
    ramp = wave.chirp_duration / 32 * np.arange(32)
    time = wave.repetition * np.arange(128)[:, None] + ramp
    then, slope = place + velocity * time[..., None], wave.bandwidth / wave.chirp_duration
    for row, element in zip(samples, radar.elements_world, strict=True):
        delay = (np.linalg.norm(then, axis=2) + np.linalg.norm(then - element, axis=2)) / C0
        beat = np.exp(-2j * np.pi * (wave.carrier * delay + slope * ramp * delay - 0.5 * slope * delay**2))
        share = np.vdot(beat, row) / np.sqrt(np.vdot(beat, beat).real * np.vdot(row, row).real)
        assert abs(share) > 1.0 - 1e-6


def test_sources_over_moving_mirrors_drift_as_their_images_do():
    """A wall that comes nearer, a target that passes it: images at two instants."""
    radar = rc.Radar(SMALL, position=(0.0, 0.0, 1.0), velocity=(2.0, 0.5, 0.0), elements=LINE, noise=False)
    wall = rc.Body(
        name="wall", shape="plate", params={"width": 6.0, "height": 4.0}, position=(3.0, -3.0, 1.0), yaw_deg=90.0,
        velocity=(0.0, 1.5, 0.0), role="mirror",
    )  # fmt: skip
    ball = rc.Body(
        name="ball", shape="sphere", params={"radius": 0.005}, rcs_dbsm=10.0, position=(5.0, 0.5, 1.2),
        velocity=(-4.0, 3.0, 1.0),
    )  # fmt: skip
    paths = rc.simulate(rc.Scene(bodies=[wall, ball], radar=radar)).paths
    # The wall's own return is of no interest.
    paths = take(paths, np.flatnonzero((paths.kind == POINT).any(axis=1)))
    kinds = [tuple(k[k > 0]) for k in paths.kind]
    assert {(POINT,), (POINT, REFLECT), (REFLECT, POINT)} <= set(kinds)
    target, mirror, own = np.array(ball.velocity), np.array(wall.velocity), np.array(radar.velocity)
    shown = target - 2.0 * (target - mirror)[1] * np.array([0.0, 1.0, 0.0])
    for kind, drift in zip(kinds, paths.drift, strict=True):
        at = kind.index(POINT)
        there, back = (shown if REFLECT in side else target for side in (kind[:at], kind[at:]))
        np.testing.assert_allclose(drift, [there - own, back - own], atol=1e-5)


def test_a_result_read_from_disk_gives_the_same_samples(tmp_path):
    radar = rc.Radar(SMALL, elements=LINE, noise=False)
    ball = {"name": "ball", "shape": "sphere", "params": {"radius": 0.05}}
    body = rc.Body(**ball, position=(4.0, 1.0, 0.0), velocity=(0.0, -8.0, 0.0))
    result = rc.simulate(rc.Scene(bodies=[body], radar=radar))
    rc.save_result(result, tmp_path)
    paths = rc.load_result(tmp_path).paths
    assert paths.drift.shape[1] == 2 and paths.instant.any()
    assert (paths.drift == result.paths.drift).all() and (paths.instant == result.paths.instant).all()
    assert (rc.synthesize(paths, radar).samples == rc.synthesize(result.paths, radar).samples).all()
