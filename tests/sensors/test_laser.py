"""A beam meets what a slow float64 intersection meets, the sea where height over sine says, and the nearest thing."""

import numpy as np
import pytest
import trimesh
from support.facets import box, facets

from raychan.sensors.laser import (
    NO_BODY,
    REFLECTIVITY,
    SEA,
    LaserScan,
    MovingBodies,
    Scanner,
    SensorPoses,
    beams,
    flat_sea_range,
    noisy,
    scan,
)
from raychan.world.ray_caster import RayCaster


def still(scanner, position=(0.0, 0.0, 5.0), yaw=0.0, pitch=0.0, roll=0.0):
    n = scanner.count
    return SensorPoses(
        position=np.tile(np.asarray(position, float), (n, 1)),
        yaw=np.full(n, yaw), pitch=np.full(n, pitch), roll=np.zeros(n) + roll,
    )  # fmt: skip


def moller_trumbore(triangles, origin, towards):
    """Nearest distance along each ray and its triangle, in float64 (Moeller, Trumbore, J. Graphics Tools 2, 1997)."""
    best, which = np.full(len(origin), np.inf), np.full(len(origin), -1)
    for k, (a, b, c) in enumerate(triangles):
        p = np.cross(towards, c - a)
        det = p @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = origin - a
            u = np.einsum("ij,ij->i", s, p) / det
            q = np.cross(s, b - a)
            v = np.einsum("ij,ij->i", towards, q) / det
            t = q @ (c - a) / det
            hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 1e-6) & (t < best)
        best[hit], which[hit] = t[hit], k
    return best, which


def test_beams_meet_what_an_exact_intersection_meets_to_a_micrometre_over_1e5_rays():
    rng = np.random.default_rng(92)
    corners = rng.uniform(-40.0, 40.0, (120, 1, 3)) + rng.uniform(-20.0, 20.0, (120, 3, 3))
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(360).reshape(-1, 3), process=False)
    surface = facets([mesh])
    origin, towards = rng.uniform(-40.0, 40.0, (100_000, 3)), rng.normal(size=(100_000, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    facet, distance = RayCaster(surface).cast(origin, towards, np.full(100_000, -1, np.int32))
    exact, which = moller_trumbore(np.asarray(surface.vertices), origin, towards)
    met = which >= 0
    assert met.sum() > 50_000
    np.testing.assert_array_equal(facet, which)
    np.testing.assert_allclose(distance[met], exact[met], rtol=0, atol=1e-6)


def test_of_two_boxes_in_line_the_front_one_is_met():
    caster = RayCaster(facets([box((20, -5, 0), (22, 5, 9)), box((10, -2, 0), (12, 2, 9))]))
    found = scan(Scanner(), still(Scanner()), caster, np.array([1.0, 1.0]))
    assert found.body[90] == 1 and found.range[90] == pytest.approx(10.0, abs=1e-9)
    # Beyond the front box's rim, at more than atan(2 / 10) = 11.3 deg, the rear one shows.
    assert found.body[90 + 13] == 0 and found.range[90 + 13] == pytest.approx(20.0 / np.cos(np.radians(13.0)), abs=1e-9)


def test_a_nearer_surface_hides_the_sea_and_the_sea_a_farther_one():
    poses = still(Scanner(), pitch=np.radians(30.0))
    for x, body in ((5.0, 0), (20.0, SEA)):
        caster = RayCaster(facets([box((x, -5, -20), (x + 1, 5, 9))]))
        assert scan(Scanner(), poses, caster, np.ones(1), 1.0).body[90] == body


def test_flat_sea_is_met_at_height_over_sine_to_a_millimetre():
    rng = np.random.default_rng(3)
    scanner = Scanner(step_deg=0.25, max_range=1e6, dark_range=1e6)
    poses = still(scanner, roll=rng.uniform(-0.5, 0.5, scanner.count))
    found = scan(scanner, poses, None, np.zeros(0), 1.0)
    depression = np.sin(poses.roll) * -np.sin(scanner.angles)
    meets = depression > 1e-4
    np.testing.assert_allclose(found.range[meets], 5.0 / depression[meets], rtol=0, atol=1e-3)
    assert (found.body[depression < 0.0] == NO_BODY).all()


def test_roll_of_10_deg_meets_the_sea_abeam_at_28_8_m_on_one_side_and_looks_to_the_sky_on_the_other():
    found = scan(Scanner(), still(Scanner(), roll=np.radians(10.0)), None, np.zeros(0), 1.0)
    assert found.range[0] == pytest.approx(28.8, abs=0.1) and found.body[0] == SEA
    assert (found.body[91:] == NO_BODY).all() and np.isinf(found.range[91:]).all()
    assert (found.body == SEA).sum() == 90 - 22 + 1  # sin a > 5 / (80 sin 10 deg): a > 21.09 deg


def test_spots_are_17_5_cm_apart_at_10_m_and_1_deg():
    tips = 10.0 * beams(Scanner(), still(Scanner(), roll=0.3, pitch=-0.2, yaw=1.0))
    np.testing.assert_allclose(np.linalg.norm(np.diff(tips, axis=0), axis=1), 0.175, rtol=0.01)


@pytest.mark.parametrize("step, count, duration", [(1.0, 181, 13.33e-3), (0.5, 361, 26.67e-3), (0.25, 721, 53.33e-3)])
def test_each_beam_has_its_own_time_and_neighbours_of_one_turn_are_a_degree_apart(step, count, duration):
    scanner = Scanner(step_deg=step)
    assert scanner.count == count and scanner.duration == pytest.approx(duration, rel=1e-3)
    assert len(np.unique(scanner.times)) == count
    turns = round(1.0 / step)
    np.testing.assert_allclose(scanner.times[turns:] - scanner.times[:-turns], 1.0 / 360.0 / 75.0, rtol=1e-9)
    assert scanner.times.min() >= 0.0 and scanner.times.max() < scanner.duration


def test_each_beam_leaves_at_the_pose_of_its_own_time():
    scanner, rate = Scanner(step_deg=0.5), 0.4
    moving = beams(scanner, still(scanner, roll=rate * scanner.times))
    for k in (0, 7, 200, 360):
        np.testing.assert_allclose(
            moving[k], beams(scanner, still(scanner, roll=rate * scanner.times[k]))[k], atol=1e-15
        )


def test_range_grows_with_reflectivity_up_to_the_scanners_own():
    limits = Scanner().range_limit(np.array(sorted(REFLECTIVITY.values())))
    assert (np.diff(limits) >= 0.0).all() and limits[0] == pytest.approx(30.0) and limits[-1] == 80.0
    wall = RayCaster(facets([box((35, -5, 0), (36, 5, 9))]))
    seen = [scan(Scanner(), still(Scanner()), wall, np.array([r])).body[90] for r in (0.10, 0.20)]
    assert seen == [NO_BODY, 0]


def test_roll_noise_makes_scans_of_the_sea_less_uniform_the_more_of_it():
    scanner, spread = Scanner(), []
    for sigma in (0.0, 0.5, 1.0, 1.5, 2.0):
        rng, ranges = np.random.default_rng(98), []
        for _ in range(200):
            roll = np.radians(20.0 + sigma * rng.normal(size=scanner.count))
            ranges.append(scan(scanner, still(scanner, roll=roll), None, np.zeros(0), 1.0).range[0])
        spread.append(np.std(ranges))
    assert (np.diff(spread) > 0.0).all()


def test_noise_has_its_deviation_and_leaves_beams_without_a_hit_alone():
    ideal = LaserScan(range=np.append(np.full(20_000, 10.0), np.inf), body=np.append(np.zeros(20_000, int), NO_BODY))
    found = noisy(ideal, 0.02, np.random.default_rng(1))
    assert np.std(found.range[:-1]) == pytest.approx(0.02, rel=0.03) and np.isinf(found.range[-1])
    np.testing.assert_array_equal(found.range, noisy(ideal, 0.02, np.random.default_rng(1)).range)


def test_below_the_sea_or_along_it_no_sea_is_met():
    origin = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    assert np.isinf(flat_sea_range(origin, np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))).all()


@pytest.mark.parametrize("wrong", [{"step_deg": 0.3}, {"fan_deg": 0.0}, {"fan_deg": 180.2}, {"mirror_hz": 0.0}])
def test_a_scanner_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match="allowed"):
        Scanner(**wrong)


@pytest.mark.parametrize("name", ["max_range", "dark_range", "mirror_hz", "fan_deg", "step_deg"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, 1e9, "80", True, None])
def test_a_number_of_a_scanner_that_no_scene_file_takes_is_refused_with_name_and_limits(name, value):
    with pytest.raises(ValueError, match=f"Scanner.{name} = .*; allowed: "):
        Scanner(**{name: value})


def test_a_scanner_takes_numbers_of_numpy_and_refuses_texts_for_switches():
    assert Scanner(max_range=np.float32(40.0), fan_deg=np.int64(90)) == Scanner(max_range=40.0, fan_deg=90.0)
    for wrong in ({"lambert": "no"}, {"moving": 2.0}, {"spot": True}):
        with pytest.raises(ValueError, match=f"Scanner.{next(iter(wrong))} = "):
            Scanner(**wrong)


BOX = RayCaster(facets([box((10, -5, 0), (11, 5, 9))]))


@pytest.mark.parametrize(
    "caster, reflectivity, said",
    [
        (BOX, [0.5, 0.1], "reflectivity: 2 values; allowed: one for each body, here 1"),
        (BOX, [], "reflectivity: 0 values; allowed: one for each body, here 1"),
        (BOX, 0.5, "reflectivity: 0.5; allowed: one for each body, here 1"),
        (BOX, [[0.5]], "here 1"),
        (BOX, [np.nan], r"reflectivity\[0\] = nan; allowed: between 0 and 100"),
        (BOX, [-0.1], r"reflectivity\[0\] = -0.1; allowed"),
        (BOX, ["0.5"], "reflectivity = .*: numbers are wanted"),
        (None, [0.5], "reflectivity: 1 values; allowed: one for each body, here 0"),
        ((MovingBodies(BOX, np.zeros(3), np.array([1], np.int32)),), [0.5], "here 2"),
    ],
)
def test_a_reflectivity_that_is_not_one_for_each_body_is_refused(caster, reflectivity, said):
    with pytest.raises(ValueError, match=said):
        scan(Scanner(), still(Scanner()), caster, reflectivity)


def test_poses_of_another_number_than_the_beams_a_sea_and_a_noise_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="poses: 181 given; allowed: one for each beam of the scanner, 361"):
        scan(Scanner(step_deg=0.5), still(Scanner()), BOX, [0.5])
    with pytest.raises(ValueError, match="sea_reflectivity = nan; allowed: between 0 and 100"):
        scan(Scanner(), still(Scanner()), BOX, [0.5], np.nan)
    with pytest.raises(ValueError, match="deviation = -1; allowed"):
        noisy(scan(Scanner(), still(Scanner()), BOX, [0.5]), -1, np.random.default_rng(0))
