"""Patches of rough surfaces are small against all that a radar tells apart: their mean returns are the integral over
the surface, in range, under narrow beams, and by range rate, whichever side moves."""

import numpy as np
import pytest

import raychan as rc
from raychan.em.diffuse import Diffuse
from raychan.records import DIFFUSE
from raychan.run.clutter import laws_of, patch_size, share_of_distance
from raychan.tracing import diffuse_patches
from raychan.tracing.diffuse_patches import visible_patches
from raychan.world.geometry import geometry_of

LEVEL = 0.1
STONE = rc.Material(eps_r=4.0, diffuse=Diffuse("constant", -10.0))
ALL_ROUND, AHEAD = rc.IsotropicAntenna(), np.array([1.0, 0.0, 0.0])


def made(antenna=ALL_ROUND, bandwidth=150e6, chirps=2, samples=64, **radar):
    wave = rc.Waveform(77e9, bandwidth, 20e-6, n_chirps=chirps, n_samples=samples)
    return rc.Radar(wave, position=(0.0, 0.0, 1.5), antenna=antenna, noise=False, **radar)


def wall(length, velocity=(0.0, 0.0, 0.0), **pose):
    """Return a wall 4 m high 5 m to the left, from abreast of the radar on unless `pose` says otherwise."""
    at = {"position": (0.5 * length, 5.0, 0.0)} | pose
    size = {"length": length, "height": 4.0}
    return rc.Body("wall", shape="wall", params=size, material=STONE, velocity=velocity, **at)


def ground(size, velocity=(0.0, 0.0, 0.0)):
    return rc.Body("ground", shape="ground", params={"size": size}, material=STONE, velocity=velocity)


def patches_of(radar, body):
    """Return the patches of a body that a radar sees: middles from the radar (n, 3) [m], and areas (n,) [m^2]."""
    geometry = geometry_of(rc.Scene(bodies=[body], radar=radar))
    laws, which = laws_of(geometry.facets), np.array([True] * len(geometry.facets.materials.kind))
    found = visible_patches(geometry, radar.position, which, patch_size(radar, share_of_distance(laws, which)))
    return found.point - radar.position, found.area


def returned(radar, way, area):
    """Return ranges (n,) [m], directions (n, 3), and mean returns (n,) of pieces, but for the wavelength."""
    away = np.linalg.norm(way, axis=1)
    look = way / away[:, None]
    gain = (np.abs(radar.tx_field(look)) ** 2).sum(axis=1) ** 2
    return away, look, gain * LEVEL * area / away**4


def fine(u, v, point):
    """Return middles (n, 3) and areas (n,) of cells of two coordinates' edges [m], `point` of which is a place."""
    a, b = (0.5 * (x[1:] + x[:-1]) for x in (u, v))
    return np.stack(point(*(x.ravel() for x in np.meshgrid(a, b, indexing="ij"))), axis=1), np.outer(
        np.diff(u), np.diff(v)
    ).ravel()


def db(got, asked):
    return 10.0 * np.log10(got / asked)


@pytest.mark.parametrize("length", [60.0, 150.0, 400.0])
def test_a_wall_returns_what_lies_within_the_unambiguous_range_however_long_it_is(length):
    radar = made()
    reach = radar.waveform.unambiguous_range
    way, area = patches_of(radar, wall(length))
    away, _, power = returned(radar, way, area)
    assert away.max() < reach
    far, _, asked = returned(
        radar, *fine(np.linspace(0.0, length, 4001), np.linspace(-1.5, 2.5, 41), lambda x, z: (x, 0.0 * x + 5.0, z))
    )
    for low, high in ((5.0, 8.0), (8.0, 20.0), (20.0, min(0.97 * reach, 0.9 * length))):
        inside, wanted = (x[(r > low) & (r < high)].sum() for r, x in ((away, power), (far, asked)))
        assert db(inside, wanted) == pytest.approx(0.0, abs=0.15)


@pytest.mark.parametrize("turned", [{"yaw_deg": 0.0}, {"yaw_deg": 1.0}, {"pitch_deg": 20.0}], ids=str)
@pytest.mark.parametrize("columns", [(64, 4), (4, 64)], ids=["wide", "high"])
def test_ground_under_a_narrow_beam_returns_the_integral_over_it(columns, turned):
    radar = made(rc.ArrayAntenna(*columns, 0.5, 0.5), bandwidth=50e6, samples=16, **turned)
    away, _, power = returned(radar, *patches_of(radar, ground(40.0)))
    middle = np.linspace(2.0, 18.0, 401)
    turn = np.linspace(-np.pi, np.pi, 1201)
    way, _ = fine(middle, turn, lambda r, a: (r * np.cos(a), r * np.sin(a), 0.0 * r - 1.5))
    area = np.hypot(way[:, 0], way[:, 1]) * (middle[1] - middle[0]) * (turn[1] - turn[0])
    far, _, asked = returned(radar, way, area)
    # Rings end where they end: what is between is off by a part of one at either side.
    inside, wanted = (x[(r > 2.6) & (r < 17.5)].sum() for r, x in ((away, power), (far, asked)))
    assert db(inside, wanted) == pytest.approx(0.0, abs=0.25)


@pytest.mark.parametrize("yaw", [0.0, 3.0])
def test_a_wall_in_a_narrow_beam_returns_the_integral_over_it(yaw):
    radar = made(rc.ArrayAntenna(32, 16, 0.5, 0.5), bandwidth=75e6, yaw_deg=yaw)
    across = wall(10.0, position=(4.0, 0.0, 0.0), yaw_deg=-90.0)
    *_, power = returned(radar, *patches_of(radar, across))
    grid = np.linspace(-5.0, 5.0, 1001), np.linspace(-1.5, 2.5, 401)
    *_, asked = returned(radar, *fine(*grid, lambda y, z: (0.0 * y + 4.0, y, z)))
    assert db(power.sum(), asked.sum()) == pytest.approx(0.0, abs=0.05)


def over_rate(look, power, speed, cell):
    """Return the mean power in each cell of range rate [m/s] of a Hann window, of what stands beside a radar."""
    rate = -speed * look[:, 0]
    off = np.arange(-speed, speed, cell)[:, None] - rate
    answer = np.sinc(off / cell) + 0.5 * (np.sinc(off / cell - 1.0) + np.sinc(off / cell + 1.0))
    return answer**2 @ power


def test_a_wall_beside_a_driving_radar_returns_the_integral_at_each_rate():
    speed, radar = 20.0, made(chirps=256, bandwidth=75e6, velocity=20.0 * AHEAD)
    cell = radar.waveform.rate_resolution
    _, look, power = returned(radar, *patches_of(radar, wall(8.0, position=(0.0, 3.0, 0.0))))
    got = over_rate(look, power, speed, cell)
    grid = np.linspace(-4.0, 4.0, 401), np.linspace(-1.5, 2.5, 21)
    _, look, power = returned(radar, *fine(*grid, lambda x, z: (x, 0.0 * x + 3.0, z)))
    asked = over_rate(look, power, speed, cell)
    strong = asked > 0.03 * asked.max()
    assert np.abs(db(got[strong], asked[strong])).max() < 0.6


@pytest.mark.parametrize("body", [lambda v: wall(8.0, v), lambda v: ground(20.0, v)], ids=["wall", "ground"])
def test_what_moves_past_a_radar_is_cut_as_what_a_radar_moves_past(body):
    driving, standing = (made(chirps=512, velocity=speed * AHEAD) for speed in (15.0, 0.0))
    one, other = patches_of(driving, body((0.0, 0.0, 0.0))), patches_of(standing, body(-15.0 * AHEAD))
    np.testing.assert_allclose(one[0], other[0], atol=1e-9)
    np.testing.assert_allclose(one[1], other[1], rtol=1e-12)
    assert len(one[1]) > 1.2 * len(patches_of(standing, body((0.0, 0.0, 0.0)))[1])


def test_a_wall_that_a_radar_all_but_touches_returns_the_same_power_at_any_speed():
    passed = wall(20.0, position=(0.0, 0.1, 0.0))
    still, fast = (made(bandwidth=75e6, samples=16, chirps=128, velocity=v * AHEAD) for v in (0.0, 20.0))
    power = [returned(radar, *patches_of(radar, passed))[2] for radar in (still, fast)]
    assert db(power[1].sum(), power[0].sum()) == pytest.approx(0.0, abs=0.01)
    assert len(power[0]) < len(power[1]) < 100_000


def test_more_patches_than_there_may_be_grow_and_a_line_tells_by_how_much(monkeypatch):
    monkeypatch.setattr(diffuse_patches, "_MOST", 8000)
    narrow = made(rc.ArrayAntenna(100, 2, 0.5, 0.5), bandwidth=75e6, samples=32)
    result = rc.simulate(rc.Scene([ground(60.0)], radar=narrow, model={"max_bounces": 1}))
    assert (result.paths.kind == DIFFUSE).sum() <= 8000
    (line,) = [x for x in result.warnings if x.startswith("clutter:")]
    assert "times as large as range cell, rate, array and beam ask for" in line
    plain = rc.simulate(rc.Scene([ground(20.0)], radar=made(bandwidth=75e6, samples=16), model={"max_bounces": 1}))
    assert not [x for x in plain.warnings if x.startswith("clutter:")]
