"""Which waves of the last order meet a surface more, against closed forms: wedges of pi / m, a plate over ground."""

import numpy as np
import pytest

import raychan as rc
from raychan.run.going_on import going_on
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
    return [going_on(paths, geometry, met == n).sum() / (met == n).sum() for n in orders]


@pytest.mark.parametrize("m", [2, 3, 4])
def test_in_a_wedge_of_pi_over_m_waves_go_on_up_to_m_bounces(m):
    half = np.pi / (2 * m)
    along = 0.15 * np.array([[np.cos(half), side * np.sin(half), 0.0] for side in (-1, 1)])
    apex = np.array([5.0, 0.02, 0.5])
    yaws = np.degrees([-half, half]) - 90.0
    walls = [plate(f"wall_{k}", tuple(apex - along[k]), yaws[k]) for k in range(2)]
    share = shares(walls, m)
    assert all(x > 0.0 for x in share[:-1]) and share[-1] == 0.0


def test_a_plate_over_ground_has_no_way_but_those_over_the_ground_at_each_end():
    ground = rc.Body(name="ground", shape="ground", material="asphalt")
    assert shares([plate("plate", (6.0, 0.0, 0.5), 180.0), ground], 3) == [1.0, 1.0, 0.0]
    assert shares([plate("plate", (6.0, 0.0, 0.5), 180.0)], 1) == [0.0]
