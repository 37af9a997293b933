"""Brute-force specular paths against Friis, two rays, and the images of a shoebox."""

from __future__ import annotations

import numpy as np
import pytest

from truth import corner, paths, slab, tworay

C0 = 299_792_458.0
K = 2 * np.pi * 77e9 / C0
LAM = C0 / 77e9


def test_line_of_sight_is_friis_with_identity_jones():
    (path,) = paths.specular_paths((0, 0, 1), (30, 7, 3), [], 77e9)
    assert np.allclose(path.gain, tworay.friis(path.length, K) * np.eye(2))
    assert np.abs(path.gain[0, 0]) == pytest.approx(LAM / (4 * np.pi * path.length))


@pytest.mark.parametrize("eps", [None, 5.24 - 0.32j, 3.0])
@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_ground_by_images_is_the_two_ray_form(eps, yaw):
    geometry = slab.pec if eps is None else lambda c: slab.half_space(c, eps)
    d, h1, h2 = 40.0, 0.6, 1.4
    rx = (d * np.cos(yaw), d * np.sin(yaw), h2)
    direct, bounced = paths.specular_paths((0, 0, h1), rx, paths.ground(geometry=geometry), 77e9)
    (va, vb), (ha, hb) = tworay.two_ray(d, h1, h2, K, eps)
    assert np.allclose(direct.gain, np.diag([va, ha]), atol=1e-12)
    assert np.allclose(bounced.gain, np.diag([vb, hb]), atol=1e-12)


def test_radar_gain_squared_is_the_radar_equation():
    power = abs(tworay.radar_gain(20.0, 20.0, 3.0, K)) ** 2
    assert power == pytest.approx(tworay.radar_power(20.0, 3.0, LAM))


def room():
    walls = paths.box((-2, -3, 0), (4, 2, 3), lambda c: slab.half_space(c, 4.0 - 0.3j), "room")
    return walls + paths.box((0.5, -0.5, 0.01), (1.5, 0.5, 1.2), body="crate")


def test_empty_shoebox_has_one_path_for_every_image():
    """A rectangular room has 1, 6, 18, 38 images of order 0 to 3 (|i| + |j| + |l| = order), all seen."""
    walls = paths.box((-2, -3, 0), (4, 2, 3), body="room")
    found = paths.specular_paths((0.31, 0.23, 1.17), (1.73, -1.29, 2.11), walls, 77e9)
    unique = {round(p.length, 9) for p in found}
    # orders of the same walls give one path each where only one order is geometrically met
    assert [len({round(p.length, 9) for p in found if len(p.faces) == m}) for m in range(4)] == [1, 6, 18, 38]
    assert len(found) == len(unique) == 63


def test_exchange_of_ends_transposes_the_gains():
    tx, rx, frequency = (-1.03, -1.31, 1.07), (2.91, 0.87, 0.83), 77e9
    there = paths.specular_paths(tx, rx, room(), frequency)
    back = paths.specular_paths(rx, tx, room(), frequency)
    assert len(there) == len(back) > 10
    # phi-hat turns its sign with the direction of travel, theta-hat does not
    turn = np.diag([1.0, -1.0])
    for a, b in zip(there, back, strict=True):
        assert a.length == pytest.approx(b.length, rel=1e-12)
        assert np.allclose(a.gain, turn @ b.gain.T @ turn, atol=1e-12)


def test_crate_blocks_line_of_sight_and_layer_lets_it_through():
    tx, rx = (-1.0, 0.0, 0.6), (3.0, 0.1, 0.6)
    assert paths.specular_paths(tx, rx, room(), 77e9, max_bounces=0) == []
    pane = [
        paths.Face([[0, -1, 0], [0, 1, 0], [0, 1, 2], [0, -1, 2]], lambda c: slab.layer(c, 6.3, 0.005, K), "pane", True)
    ]
    (path,) = paths.specular_paths((-1, 0, 1), (1, 0, 1), pane, 77e9, max_bounces=0)
    assert np.allclose(path.gain, tworay.friis(2.0, K) * slab.layer(1.0, 6.3, 0.005, K)[2] * np.eye(2))


def test_right_angle_of_mirrors_returns_with_turned_polarisation():
    """Two conducting walls at a right angle: the double bounce at 45 degrees of roll swaps V and H."""
    c = np.sqrt(0.5)
    faces = [
        paths.Face(f @ np.array([[1, 0, 0], [0, c, -c], [0, c, c]]).T, body="wall") for f in corner.dihedral_faces(5, 9)
    ]
    double = [p for p in paths.specular_paths((6, 0.1, 0.0), (6, -0.1, 0.05), faces, 77e9) if len(p.faces) == 2]
    assert len(double) >= 1
    for p in double:
        cross, co = abs(p.gain[0, 1]), abs(p.gain[0, 0])
        assert cross == pytest.approx(LAM / (4 * np.pi * p.length), rel=1e-2) and co < 0.05 * cross
