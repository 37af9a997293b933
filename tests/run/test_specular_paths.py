"""Exact specular paths against a brute-force enumerator and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from support.facets import box, facets, ground, quad
from truth import paths as brute
from truth import slab, tworay

from raychan.channel.rates import rates
from raychan.records import HALF_SPACE, LAYER, PEC
from raychan.run.specular_paths import jones, specular_routes
from raychan.units import C0
from raychan.world.geometry import Geometry

F = 77e9
K = 2 * np.pi * F / C0
CONCRETE = 5.24 - 0.31j
GLASS = 6.27 - 0.35j


def both(meshes, faces, materials, tx, rx, bounces):
    f = facets(meshes, materials)
    routes = specular_routes(Geometry(f), tx, rx, bounces)
    return routes, jones(routes, f, F), brute.specular_paths(np.array(tx), np.array(rx), faces, F, bounces)


def street():
    stone = lambda c: slab.half_space(c, CONCRETE)  # noqa: E731
    glass = lambda c: slab.layer(c, GLASS, 0.004, K)  # noqa: E731
    wall = [[-20, 6, -1], [-20, 6, 8], [60, 6, 8], [60, 6, -1]]
    pane = [[8, -1, 0.2], [8, 2, 0.2], [8, 2, 2.2], [8, -1, 2.2]]
    low, high = (12, -4, 0.02), (16, -2, 1.5)
    meshes = [ground(), quad(wall), quad(pane), box(low, high)]
    faces = [*brute.ground(500.0, geometry=stone), brute.Face(wall, stone, "wall")]
    faces += [brute.Face(pane, glass, "pane", lets_through=True), *brute.box(low, high)]
    rows = [(HALF_SPACE, CONCRETE, 0.0, 0.0)] * 2 + [(LAYER, GLASS, 0.004, 0.0), (PEC, 1.0, 0.0, 0.0)]
    return meshes, faces, rows


@pytest.mark.parametrize(
    ("tx", "rx"), [((0, 0, 0.5), (20, 1, 1.3)), ((1, -2, 0.7), (25, -3, 0.4)), ((2, 3, 1.5), (11, -3, 1.0))]
)
def test_paths_equal_the_brute_force_enumeration(tx, rx):
    meshes, faces, rows = street()
    routes, gain, truth = both(meshes, faces, rows, tx, rx, 3)
    mine = np.argsort(routes.length)
    other = sorted(truth, key=lambda p: p.length)
    assert len(mine) == len(other)
    np.testing.assert_allclose(routes.length[mine], [p.length for p in other], atol=1e-9)
    expected = np.array([p.gain for p in other])
    np.testing.assert_allclose(gain[mine], expected, atol=1e-6 * np.abs(expected).max())


def test_line_of_sight_is_friis():
    f = facets([box((100, 100, 100), (101, 101, 101))])
    routes = specular_routes(Geometry(f), (0, 0, 1), (30, 4, 2), 1)
    gain = jones(routes, f, F)
    length = np.linalg.norm([30, 4, 1])
    expected = C0 / F / (4 * np.pi * length) * np.exp(-1j * K * length) * np.eye(2)
    np.testing.assert_allclose(gain[routes.kind[:, 0] == 0][0], expected, atol=1e-12)


@pytest.mark.parametrize("distance", [3.0, 8.0, 22.0, 90.0, 200.0])
def test_ground_reflection_is_the_two_ray_closed_form_through_brewster(distance):
    f = facets([ground(1000.0)], [(HALF_SPACE, CONCRETE, 0.0, 0.0)])
    h_tx, h_rx = 0.5, 1.7
    routes = specular_routes(Geometry(f), (0, 0, h_tx), (distance, 0, h_rx), 2)
    total = jones(routes, f, F).sum(axis=0)
    truth = tworay.two_ray(distance, h_tx, h_rx, K, CONCRETE).sum(axis=1)
    ratio = np.diag(total) / truth
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.01
    assert np.abs(np.angle(ratio)).max() < 0.01


def test_exchanging_the_ends_changes_nothing():
    meshes, _, rows = street()
    f = facets(meshes, rows)
    s = Geometry(f)
    there, back = (specular_routes(s, *ends, 3) for ends in (((0, 0, 0.5), (20, 1, 1.3)), ((20, 1, 1.3), (0, 0, 0.5))))
    flip = np.array([[1, -1], [-1, 1]])  # H turns over with the direction of travel
    a, b = jones(there, f, F), jones(back, f, F).transpose(0, 2, 1) * flip
    np.testing.assert_allclose(np.sort(there.length), np.sort(back.length), atol=1e-9)
    i, j = np.argsort(there.length), np.argsort(back.length)
    np.testing.assert_allclose(a[i], b[j], atol=1e-9 * np.abs(a).max())


def test_rates_are_those_of_the_moved_scene():
    rng = np.random.default_rng(5)
    meshes, _, rows = street()
    v = np.array([[0, 0, 0], [0, -3, 0], [2, 0, 0], [8, 1, 0]], float)
    v_tx, v_rx = rng.normal(size=3) * 5, rng.normal(size=3) * 5
    tx, rx = np.array([0, 0, 0.5]), np.array([20, 1, 1.3])

    def lengths(t):
        moved = [m.copy() for m in meshes]
        for m, u in zip(moved, v, strict=True):
            m.apply_translation(u * t)
        r = specular_routes(Geometry(facets(moved, rows)), tx + v_tx * t, rx + v_rx * t, 3)
        return {tuple(row): length for row, length in zip(r.facet.tolist(), r.length, strict=True)}

    f = facets(meshes, rows, velocity=v)
    r = specular_routes(Geometry(f), tx, rx, 3)
    early, late = lengths(-1e-4), lengths(1e-4)
    mine = 2.0 * rates(r, f, v_tx, v_rx)
    assert len(mine) >= 4
    for row, rate in zip(r.facet.tolist(), mine, strict=True):
        assert (late[tuple(row)] - early[tuple(row)]) / 2e-4 == pytest.approx(rate, abs=1e-3)
