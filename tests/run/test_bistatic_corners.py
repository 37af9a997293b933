"""Corners seen from two places: exchanged ends change nothing, of small faces (tubes) and large ones (mirrors)."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.units import C0, db

F = 77e9
WAVE = rc.Waveform(F, 150e6, 40e-6, n_chirps=8, n_samples=128)
PLACE = np.array([10.0, 0.0, 0.7])


def dihedral(width, height):
    """Two faces at right angles that open towards -x, their edge upright."""
    up = np.array([0.0, 0.0, height / 2])
    a, b = (width * np.array([1.0, s, 0.0]) / 2**0.5 for s in (1.0, -1.0))
    corners = [-up, up, a - up, a + up, b - up, b + up]
    return trimesh.Trimesh(corners, [[0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 1, 5]], process=False)


def paths(tx, rx, bodies):
    """Return the paths of a scene from one place to another, and its radar."""
    radar = rc.Radar(
        WAVE, position=np.array(tx), rx_position=np.array(rx), noise=False, power=1.0, antenna=rc.IsotropicAntenna()
    )
    made = rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 3, "tolerance_db": 0.2})
    return rc.transfer(rc.trace(made), radar), radar


def samples(*scene):
    """Return the samples of a scene from one place to another."""
    return rc.synthesize(*paths(*scene)).samples


def exchanged_db(one, two, bodies):
    """Return by how much the strongest sample changes, and how far under it the largest difference lies."""
    a, b = samples(one, two, bodies), samples(two, one, bodies)
    return db(np.abs(a).max() / np.abs(b).max()) * 2, db(np.abs(a - b).max() / np.abs(a).max()) * 2


@pytest.mark.parametrize(
    ("width", "height", "pose", "apart"),
    [
        (0.3, 0.4, 188.0, 0.5),
        (0.3, 0.4, 184.0, 2.5),
        (1.0, 0.8, 186.0, 0.5),
        (1.2, 1.5, 175.0, 2.0),
    ],
)
def test_a_corner_seen_the_other_way_round_returns_the_same(width, height, pose, apart):
    """Rays followed from the transmitter alone differ by 3 to 7 dB."""
    body = rc.Body(
        name="corner", mesh=dihedral(width, height), material="pec", position=PLACE, yaw_deg=pose, crease_deg=5.0
    )
    level, rest = exchanged_db((0.0, 0.0, 0.6), (0.0, apart, 0.6), [body])
    assert level == pytest.approx(0.0, abs=0.02)
    assert rest < -40.0


def test_corners_over_ground_and_beside_a_wall_return_the_same_the_other_way_round():
    bodies = [
        rc.Body(name="ground", shape="ground", material="asphalt"),
        rc.Body(name="corner", shape="trihedral", params={"size": 0.3}, position=(8.0, 1.0, 0.6), yaw_deg=170.0),
        rc.Body(name="wall", shape="plate", params={"width": 6.0, "height": 3.0}, position=(12.0, 4.0, 1.6)),
        rc.Body(
            name="box",
            shape="box",
            params={"length": 0.5, "width": 0.4, "height": 0.6},
            position=(7.0, -1.0, 0.3),
            yaw_deg=20.0,
        ),
    ]  # fmt: skip
    level, rest = exchanged_db((0.0, 0.0, 0.5), (1.0, 2.0, 0.8), bodies)
    assert level == pytest.approx(0.0, abs=0.05)
    assert rest < -30.0


def test_a_corner_in_a_scene_has_the_level_of_its_bistatic_cross_section():
    """Near backscatter, where the wave of the shadow, which `rcs` adds, is weak."""
    one, two, mesh = np.array([0.0, 0.0, 0.7]), np.array([0.0, 0.3, 0.7]), dihedral(0.3, 0.4)
    for pose in (180.0, 184.0, 188.0):
        body = rc.Body(name="corner", mesh=mesh, material="pec", position=PLACE, yaw_deg=pose, crease_deg=5.0)
        every, _ = paths(one, two, [body])
        found = np.abs(every.amplitude[(every.kind > 0).any(axis=1)].sum()) ** 2
        turn = np.radians(pose)
        views = [np.degrees(np.arctan2(*(end - PLACE)[1::-1])) - np.degrees(turn) for end in (one, two)]
        far = [float(np.linalg.norm(end - PLACE)) for end in (one, two)]
        known = rc.rcs(
            mesh, F, views[0], 0.0, rx_azimuth_deg=views[1], rx_elevation_deg=0.0, distance=far[0], rx_distance=far[1],
            crease_deg=5.0, polarization="VV", tolerance_db=0.1,
        )  # fmt: skip
        true = (C0 / F) ** 2 * float(np.squeeze(known.sigma)) / ((4.0 * np.pi) ** 3 * (far[0] * far[1]) ** 2)
        assert db(found / true) == pytest.approx(0.0, abs=0.15)


def test_the_direct_samples_do_not_change_where_nothing_bounces_twice():
    """One surface: both ways have the same routes, and none is traced twice."""
    body = rc.Body(name="plate", shape="plate", params={"width": 0.3, "height": 0.3}, position=(8.0, 0.0, 0.5))
    one, two = (samples((0.0, 0.0, 0.5), (0.0, 1.0, 0.5), [body]) for _ in range(2))
    np.testing.assert_array_equal(one, two)
