"""Which waves of the last order meet a surface more, against closed forms: wedges of pi / m, a plate over ground."""

import numpy as np
import pytest

import raychan as rc
from raychan.run.explanation.labels import alike
from raychan.run.ledger.going_on import going_on, shorter
from raychan.run.mechanisms import interactions
from raychan.world.geometry import geometry_of

WAVE = rc.Waveform(carrier=24e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=4, n_samples=64)


def plate(name, at, yaw, size=0.3):
    return rc.Body(name=name, shape="plate", params={"width": size, "height": size}, position=at, yaw_deg=yaw)


def shares(bodies, bounces):
    """Return the share of paths of each number of interactions that go on, from one on."""
    model = {"max_bounces": bounces, "tolerance_db": 2.0}
    scene = rc.Scene(bodies=bodies, radar=rc.Radar(WAVE, position=(0.0, 0.0, 0.5)), model=model)
    paths, geometry = rc.simulate(scene).paths, geometry_of(scene)
    met = interactions(paths)
    orders = range(1, bounces + 1)
    assert all((met == n).any() for n in orders)
    return [going_on(paths, geometry, met == n, alike(paths)).sum() / (met == n).sum() for n in orders]


@pytest.mark.parametrize("m", [2, 3, 4])
def test_in_a_wedge_of_pi_over_m_waves_go_on_up_to_m_bounces(m):
    half = np.pi / (2 * m)
    along = 0.15 * np.array([[np.cos(half), side * np.sin(half), 0.0] for side in (-1, 1)])
    apex = np.array([5.0, 0.02, 0.5])
    yaws = np.degrees([-half, half]) - 90.0
    walls = [plate(f"wall_{k}", tuple(apex - along[k]), yaws[k]) for k in range(2)]
    share = shares(walls, m)
    assert all(x > 0.0 for x in share[:-1]) and share[-1] == 0.0


def test_a_plate_over_ground_sends_waves_on_to_it_but_none_to_a_third_surface():
    ground = rc.Body(name="ground", shape="ground", material="asphalt")
    first, *more = shares([plate("plate", (6.0, 0.0, 0.5), 180.0), ground], 3)
    # All of the first order but the foot point below the radar.
    assert 0.5 < first < 1.0 and more == [0.0, 0.0]
    assert shares([plate("plate", (6.0, 0.0, 0.5), 180.0)], 1) == [0.0]


def test_a_target_of_given_rcs_goes_on_where_there_are_mirrors():
    target = rc.Body(name="target", shape="sphere", params={"radius": 0.1}, position=(6.0, 0.0, 0.5), rcs_dbsm=10.0)
    assert shares([target], 1) == [0.0]
    assert shares([target, rc.Body(name="ground", shape="ground", material="asphalt")], 2)[1] == 1.0


def test_shorter_ways_are_those_over_the_same_bodies_without_the_first_or_the_last_and_no_mirror_alone():
    """A ball sends waves on to the ground and the ground to it; a plate aside sees neither, nor does the foot point."""
    ground = rc.Body(name="ground", shape="ground", material="asphalt")
    ball = rc.Body(name="ball", shape="sphere", params={"radius": 0.2}, position=(6.0, 0.0, 0.5))
    scene = rc.Scene(
        bodies=[plate("aside", (0.0, 0.0, 6.5), 0.0), ball, ground],
        radar=rc.Radar(WAVE, position=(0.0, 0.0, 0.5)),
        model={"max_bounces": 2, "tolerance_db": 2.0},
    )
    paths = rc.simulate(scene).paths
    met = interactions(paths)
    goes = going_on(paths, geometry_of(scene), met == 2, alike(paths))
    rows = shorter(paths, goes, alike(paths))
    assert goes.any() and set(met[rows]) == {1}
    assert {tuple(b) for b in paths.bodies[rows][:, :1]} == {("ball",)}
