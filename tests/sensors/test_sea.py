"""The realised sea has its spectrum, its waves run as deep water's, and a ray stops at its first crossing."""

import numpy as np
import pytest

from raychan.poses import direction
from raychan.sensors.laser import SEA, Scanner, SensorPoses, beams, scan
from raychan.sensors.sea import GRAVITY, SeaState, Waves, flat_sea_range, waves, wavy_sea_range


def realised(height=2.0, period=6.0, seed=0, **more):
    return waves(SeaState(height, period, **more), np.random.default_rng(seed))


def rays(count, seed=1, lowest=-0.6, highest=0.02, top=7.0):
    """Rays from above every crest, most of them looking down."""
    rng = np.random.default_rng(seed)
    origin = np.stack([*rng.uniform(-200.0, 200.0, (2, count)), rng.uniform(5.0, top, count)], axis=1)
    return origin, direction(rng.uniform(-np.pi, np.pi, count), rng.uniform(lowest, highest, count))


def along(sea, origin, towards, s):
    """Height of a ray over the surface at distances s."""
    p = origin + s[:, None] * towards
    return p[:, 2] - sea.height(p[:, 0], p[:, 1])


def test_the_spectrum_holds_the_variance_of_its_significant_height_and_peaks_where_it_says():
    w = np.geomspace(0.05, 200.0, 400_000)
    for gamma, within in ((1.0, 1e-4), (3.3, 0.02)):  # DNV's 1 - 0.287 ln gamma is a fit
        density = SeaState(3.0, 8.0, gamma).spectrum(w)
        assert 4.0 * np.sqrt(np.trapezoid(density, w)) == pytest.approx(3.0, rel=within)
        assert w[np.argmax(density)] == pytest.approx(2.0 * np.pi / 8.0, rel=1e-3)


def test_the_wind_sea_of_pierson_and_moskowitz_is_the_same_spectrum():
    """Alpha g^2 w^-5 exp(-beta (g / (U w))^4), alpha = 8.1e-3, beta = 0.74: H = 2 U^2 / g sqrt(alpha / beta)."""
    wind, w = 12.0, np.linspace(0.3, 4.0, 50)
    height = 2.0 * wind**2 / GRAVITY * np.sqrt(8.1e-3 / 0.74)
    period = 2.0 * np.pi * wind / GRAVITY / (0.8 * 0.74) ** 0.25
    printed = 8.1e-3 * GRAVITY**2 / w**5 * np.exp(-0.74 * (GRAVITY / (wind * w)) ** 4)
    np.testing.assert_allclose(SeaState(height, period).spectrum(w), printed, rtol=1e-12)


@pytest.mark.parametrize("gamma", [1.0, 3.3])
def test_the_realised_surface_has_the_significant_height_of_four_roots_of_m0(gamma):
    sea = realised(2.5, 5.0, gamma=gamma)
    assert 4.0 * np.sqrt(0.5 * (sea.amplitude**2).sum()) == pytest.approx(2.5, rel=1e-12)
    x, y = np.meshgrid(*2 * [np.arange(0.0, 6000.0, 11.0)])
    assert 4.0 * sea.height(x, y).std() == pytest.approx(2.5, rel=0.01)


def test_the_variance_of_the_waves_lies_where_the_spectrum_has_it():
    state, peak = SeaState(2.0, 7.0), 2.0 * np.pi / 7.0
    found = [realised(2.0, 7.0, seed) for seed in range(40)]
    power = np.concatenate([0.5 * s.amplitude**2 for s in found]) / 40
    w = np.concatenate([s.frequency for s in found])
    for ratio in (0.9, 1.0, 1.3, 2.0):
        # Integral of Pierson and Moskowitz's spectrum: m0 exp(-5/4 (w_p / w)^4).
        wanted = np.exp(-1.25 / ratio**4) * (0.25 * state.significant_height) ** 2
        assert power[w < ratio * peak].sum() == pytest.approx(wanted, rel=0.03)


def test_crests_run_with_the_phase_speed_of_deep_water():
    sea = realised(seed=3)
    for k in range(0, 48, 7):
        one = Waves(*(np.array([getattr(sea, f)[k]]) for f in ("amplitude", "wave_x", "wave_y", "frequency", "phase")))
        number = np.hypot(one.wave_x, one.wave_y)
        assert one.frequency**2 == pytest.approx(GRAVITY * number)
        ahead = GRAVITY / one.frequency * 3.7
        there = np.array([5.0 + ahead * one.wave_x / number, -2.0 + ahead * one.wave_y / number]).ravel()
        assert one.height(*there, time=3.7) == pytest.approx(one.height(5.0, -2.0), abs=1e-9)


def test_waves_run_within_a_right_angle_of_their_heading_and_all_along_it_without_spread():
    sea = realised(heading=1.0)
    off = np.angle(np.exp(1j * (np.arctan2(sea.wave_y, sea.wave_x) - 1.0)))
    assert np.abs(off).max() < 0.5 * np.pi and np.abs(off.mean()) < 0.3 and off.std() == pytest.approx(0.57, abs=0.12)
    along_it = realised(heading=1.0, spread=False)
    np.testing.assert_allclose(np.arctan2(along_it.wave_y, along_it.wave_x), 1.0, atol=1e-12)


def test_a_sea_later_is_the_sea_at_that_time():
    sea, x = realised(), np.linspace(-50.0, 50.0, 30)
    np.testing.assert_allclose(sea.at(12.3).height(x, 2.0 * x, 0.4), sea.height(x, 2.0 * x, 12.7), atol=1e-9)


def test_equal_seeds_give_equal_waves():
    np.testing.assert_array_equal(realised(seed=5).phase, realised(seed=5).phase)
    assert (realised(seed=5).phase != realised(seed=6).phase).all()


def test_waves_without_height_are_the_flat_sea():
    origin, towards = rays(2000)
    found = wavy_sea_range(realised(0.0), origin, towards, np.zeros(2000), np.full(2000, 1e5))
    flat = flat_sea_range(origin, towards)
    flat = np.where(flat <= 1e5, flat, np.inf)
    np.testing.assert_allclose(found, flat, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(realised(0.0).normal(origin[:, 0], origin[:, 1]), np.tile([0.0, 0.0, 1.0], (2000, 1)))


@pytest.mark.parametrize("height, period", [(0.3, 3.0), (2.0, 5.0), (3.0, 9.0)])
def test_a_ray_stops_on_the_surface_and_meets_nothing_nearer(height, period):
    sea = realised(height, period)
    origin, towards = rays(300)
    found = wavy_sea_range(sea, origin, towards, np.zeros(300), np.full(300, 150.0))
    assert np.isfinite(found).sum() > 200
    for o, d, r in zip(origin, towards, found, strict=True):
        # Every 5 mm; a crest that a ray crosses within less would be lower than 1e-5 m.
        above = along(sea, o, d, np.arange(0.0, min(r, 150.0) - 1e-3, 5e-3))
        assert above.min() > -1e-9
        if np.isfinite(r):
            assert abs(along(sea, o, d, np.array([r]))[0]) < 1e-6


@pytest.mark.parametrize("height, period", [(0.3, 3.0), (2.0, 5.0), (3.0, 9.0)])
def test_rays_of_one_beam_meet_together_what_they_meet_alone(height, period):
    sea, rng = realised(height, period), np.random.default_rng(4)
    origin, towards = (np.repeat(x, 7, axis=0) for x in rays(300, top=5.5))
    origin, towards = (x + size * rng.normal(size=x.shape) for x, size in ((origin, 0.01), (towards, 3e-3)))
    origin[:70, 2] -= 4.9  # some begin among the waves, and below
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    rest = np.repeat(rng.uniform(0.0, 9.0, 300), 7), np.full(2100, 120.0)
    alone, together = (wavy_sea_range(sea, origin, towards, *rest, k) for k in (1, 7))
    assert np.isfinite(alone).sum() > 1000
    hit = np.isfinite(alone)
    np.testing.assert_array_equal(hit, np.isfinite(together))
    p = origin[hit] + alone[hit, None] * towards[hit]
    grazing = -np.einsum("ij,ij->i", sea.normal(p[:, 0], p[:, 1], rest[0][hit]), towards[hit])
    # Both end within 1e-9 m of the surface's height.
    assert (np.abs(together[hit] - alone[hit]) * np.maximum(grazing, 1e-3) < 1e-8).all()


def test_normals_are_those_of_the_surfaces_slopes():
    sea, h = realised(), 1e-5
    x, y, t = np.random.default_rng(2).uniform(-50.0, 50.0, (3, 200))
    slopes = [(sea.height(x + a, y + b, t) - sea.height(x - a, y - b, t)) / (2 * h) for a, b in ((h, 0), (0, h))]
    normal = np.stack([-slopes[0], -slopes[1], np.ones(200)], axis=1)
    np.testing.assert_allclose(sea.normal(x, y, t), normal / np.linalg.norm(normal, axis=1)[:, None], atol=1e-7)


def test_from_below_the_surface_nothing_is_met_and_far_crests_are_met_by_level_rays_only_within_reach():
    sea = realised(4.0, 9.0, spread=False)
    below = np.array([[0.0, 0.0, -20.0]])
    level = np.array([[1.0, 0.0, 0.0]])
    assert np.isinf(wavy_sea_range(sea, below, level, np.zeros(1), np.full(1, 1e4))).all()
    trough = np.array([[0.0, 0.0, float(sea.height(0.0, 0.0)) + 0.01]])
    reached = wavy_sea_range(sea, trough, level, np.zeros(1), np.full(1, 1e4))[0]
    assert 0.0 < reached < 1e4
    assert np.isinf(wavy_sea_range(sea, trough, level, np.zeros(1), np.full(1, 0.5 * reached))[0])


@pytest.mark.parametrize("moving", [True, False])
def test_each_beam_meets_the_sea_of_its_own_time(moving):
    scanner = Scanner(step_deg=0.25, moving=moving)
    n, sea = scanner.count, realised(1.0, 4.0).at(5.0)
    poses = SensorPoses(
        position=np.tile([0.0, 0.0, 6.0], (n, 1)), yaw=np.zeros(n), pitch=np.zeros(n), roll=np.full(n, 0.2)
    )
    found = scan(scanner, poses, None, np.zeros(0), 1.0, sea)
    hit = found.body == SEA
    assert hit.sum() > 200
    tips = poses.position[hit] + found.range[hit, None] * beams(scanner, poses)[hit]
    np.testing.assert_allclose(tips[:, 2], sea.height(tips[:, 0], tips[:, 1], scanner.times[hit]), rtol=0, atol=1e-6)


@pytest.mark.parametrize("wrong", [(-1.0, 5.0), (1.0, 0.0), (np.inf, 5.0), (1.0, 5.0, 0.5), (1.0, 5.0, 1.0, np.nan)])
def test_a_sea_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match="allowed"):
        SeaState(*wrong)
    with pytest.raises(ValueError, match="allowed"):
        waves(SeaState(1.0, 5.0), np.random.default_rng(0), 0)
