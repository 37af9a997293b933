"""A beam's energy is a Gaussian spot's, and the range reported of it is that of the echo that the scanner times."""

import math

import numpy as np
import pytest
from support.facets import box, facets

from raychan.sensors.laser import NO_BODY, SEA, Scanner, SensorPoses, scan
from raychan.sensors.sea import SeaState, waves
from raychan.sensors.spot import Echo, Spot
from raychan.world.ray_caster import RayCaster

WALL = ((20.0, -30.0, -30.0), (20.5, 30.0, 30.0))


def seen(scanner, *boxes, reflectivity=1.0, sea=0.0, **pose):
    """Return what the middle beam, along +x from the origin, reports."""
    n = scanner.count
    angles = {name: np.full(n, pose.get(name, 0.0)) for name in ("yaw", "pitch", "roll")}
    poses = SensorPoses(position=np.tile(pose.get("position", (0.0, 0.0, 0.0)), (n, 1)), **angles)
    caster = RayCaster(facets([box(*b) for b in boxes])) if boxes else None
    found = scan(scanner, poses, caster, np.full(len(boxes), reflectivity), sea)
    return found.range[n // 2], found.body[n // 2]


@pytest.mark.parametrize("rings", [1, 2, 3, 8])
def test_sub_rays_share_the_energy_of_a_gaussian_spot(rings):
    places, share = Spot(rings=rings).pattern
    assert len(places) == 1 + 3 * rings * (rings + 1)
    assert share.sum() == pytest.approx(1.0, abs=1e-15) and (share > 0.0).all()
    np.testing.assert_allclose(share @ places, 0.0, atol=1e-15)
    r = np.linalg.norm(places, axis=1)
    for j in range(rings):
        # Energy of exp(-2 r^2) within the middle between two rings.
        within = r < (j + 0.5) / rings
        assert share[within].sum() == pytest.approx(1.0 - math.exp(-2.0 * ((j + 0.5) / rings) ** 2))


def test_the_more_rings_the_nearer_is_the_energy_beside_an_edge_to_the_gaussians():
    """The share of exp(-2 r^2) beyond x is erfc(sqrt(2) x) / 2."""
    edges, off = np.linspace(-0.8, 0.8, 33), []
    for rings in (1, 4, 16):
        places, share = Spot(rings=rings).pattern
        off.append(max(abs(share[places[:, 0] > x].sum() - 0.5 * math.erfc(math.sqrt(2.0) * x)) for x in edges))
    assert off[0] < 0.25 and off[1] < 0.09 and off[2] < 0.03


def test_the_spot_is_13_mm_wide_at_the_exit_and_grows_by_4_6_mrad():
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    start, line = Spot().sub_rays(np.zeros((1, 3)), turn[None, 0], turn[None, 1])
    for away in (0.0, 8.0, 50.0):
        tips = start + away / (line @ turn[0])[:, None] * line
        across = np.linalg.norm(tips - away * turn[0], axis=1)
        assert across[0] == pytest.approx(0.0, abs=1e-12)
        np.testing.assert_allclose(2.0 * across[1:], 0.013 + 4.6e-3 * away, rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(line, axis=1), 1.0, atol=1e-15)


@pytest.mark.parametrize("echo", list(Echo))
def test_a_wall_across_the_beam_is_where_a_ray_meets_it(echo):
    found, body = seen(Scanner(spot=Spot(echo=echo)), WALL)
    assert body == 0 and found == pytest.approx(20.0, abs=1e-4)  # sub-rays are longer by 20 m (2.3 mrad)^2 / 2


def test_a_spot_across_an_edge_reads_a_range_between_where_nothing_is():
    spot = Spot(rings=3)
    near = ((19.7, 1e-4, -5.0), (19.71, 5.0, 5.0))  # a hair's breadth off the axis: no sub-ray meets the edge itself
    found, _ = seen(Scanner(spot=spot), WALL, near)
    places, share = spot.pattern
    left = places[:, 0] > 1e-2
    part = share[~left].sum() * 20.0**-2, share[left].sum() * 19.7**-2
    assert 19.75 < found < 19.95
    assert found == pytest.approx((part[0] * 20.0 + part[1] * 19.7) / sum(part), abs=1e-4)


def test_of_two_echoes_apart_the_first_the_strongest_or_their_mean_is_reported():
    edge = 0.3 * 0.5 * (0.013 + 4.6e-3 * 15.0)  # leaves less than half of the spot to the nearer
    near = ((15.0, edge, -5.0), (15.1, 5.0, 5.0))
    spot = {echo: seen(Scanner(spot=Spot(rings=4, echo=echo)), WALL, near) for echo in Echo}
    assert spot[Echo.FIRST] == (pytest.approx(15.0, abs=1e-3), 1)
    assert spot[Echo.STRONGEST] == (pytest.approx(20.0, abs=1e-3), 0)
    assert 15.5 < spot[Echo.MEAN][0] < 19.5


def test_an_echo_too_weak_to_be_seen_is_passed_over_for_the_next():
    edge = 0.9 * 0.5 * (0.013 + 4.6e-3 * 15.0)
    near = ((15.0, edge, -5.0), (15.1, 5.0, 5.0))
    dim = Scanner(spot=Spot(rings=4), dark_range=21.0)  # the wall alone just seen
    assert seen(dim, WALL, near, reflectivity=0.1) == (pytest.approx(20.0, abs=1e-3), 0)
    assert seen(dim, near, reflectivity=0.1) == (np.inf, NO_BODY)


@pytest.mark.parametrize("x, body", [(29.99, 0), (30.01, NO_BODY)])
def test_a_surface_that_fills_the_spot_is_seen_as_far_as_by_a_ray(x, body):
    wall = ((x, -30.0, -30.0), (x + 1.0, 30.0, 30.0))
    for spot in (None, Spot()):
        assert seen(Scanner(spot=spot), wall, reflectivity=0.1)[1] == body


@pytest.mark.parametrize("x, body", [(20.5, 0), (21.6, NO_BODY)])
def test_a_surface_that_fills_half_the_spot_is_seen_a_root_of_two_less_far(x, body):
    """30 m / sqrt(2) = 21.2 m."""
    half = ((x, 1e-4, -30.0), (x + 1.0, 30.0, 30.0))
    assert seen(Scanner(spot=Spot(rings=24)), half, reflectivity=0.1)[1] == body


@pytest.mark.parametrize("distance, body", [(14.0, 0), (16.0, NO_BODY)])
def test_with_lambert_a_wall_seen_at_60_deg_of_incidence_is_seen_a_root_of_two_less_far(distance, body):
    """Power falls with the cosine, so range with its root: 30 m sqrt(cos 60 deg) = 21.2 m, here at 0.05: 15 m."""
    turned = {"yaw": np.radians(60.0), "position": (20.0 - 0.5 * distance, 0.0, 0.0)}
    assert seen(Scanner(lambert=True), WALL, reflectivity=0.05, **turned)[1] == body
    assert seen(Scanner(), WALL, reflectivity=0.05, **turned)[1] == 0


def test_with_lambert_the_sea_fades_with_the_sine_of_the_grazing_angle():
    at = {"pitch": np.radians(10.0), "position": (0.0, 0.0, 5.0)}  # 28.8 m; sin 10 deg = 0.174
    assert seen(Scanner(), sea=0.1, **at)[1] == SEA
    assert seen(Scanner(lambert=True), sea=0.1, **at)[1] == NO_BODY
    assert seen(Scanner(lambert=True), sea=0.54, **at)[1] == SEA
    assert seen(Scanner(lambert=True), sea=0.52, **at)[1] == NO_BODY


def test_with_lambert_waves_without_height_fade_as_the_flat_sea():
    n, sea = Scanner().count, waves(SeaState(0.0, 5.0), np.random.default_rng(0))
    poses = SensorPoses(
        position=np.tile([0.0, 0.0, 5.0], (n, 1)), yaw=np.zeros(n), pitch=np.zeros(n), roll=np.full(n, 0.3)
    )
    for spot in (None, Spot()):
        flat, wavy = (scan(Scanner(lambert=True, spot=spot), poses, None, np.zeros(0), 0.2, s) for s in (None, sea))
        np.testing.assert_allclose(wavy.range, flat.range, atol=1e-6)
        assert 20 < (flat.body == SEA).sum() < 90


def test_all_beams_leave_at_the_scans_start_where_motion_is_switched_off():
    assert not Scanner(moving=False).times.any() and Scanner().times.any()


WRONG = [{"divergence": -1.0}, {"exit_diameter": np.nan}, {"rings": 0}, {"merge": np.inf}]


@pytest.mark.parametrize("wrong", [*WRONG, {"rings": 10**6}, {"rings": 1.5}, {"divergence": 0.6}, {"echo": "first"}])
def test_a_footprint_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match=f"Spot.{next(iter(wrong))} = .*; allowed: "):
        Spot(**wrong)
