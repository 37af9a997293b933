"""Specular paths of random worlds of plates and boxes against the brute force: none invented, none missed."""

from __future__ import annotations

import numpy as np
import pytest
from support.facets import box, facets, quad
from truth import paths as brute
from truth import slab

import raychan as rc
from raychan.records import LAYER, PEC
from raychan.run.specular_paths import jones, specular_routes
from raychan.units import C0
from raychan.world.geometry import Geometry

F = 77e9
K = 2 * np.pi * F / C0
GLASS = 6.27 - 0.35j


def lengths_of_vertices(routes):
    chain = np.concatenate(
        [
            np.tile(routes.tx, (len(routes.length), 1, 1)),
            routes.vertices,
            np.tile(routes.rx, (len(routes.length), 1, 1)),
        ],
        axis=1,
    )
    return np.linalg.norm(np.diff(chain, axis=1), axis=2).sum(axis=1)


def plate(rng, middle, size):
    """Four corners of a rectangle turned anyhow."""
    u, v = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    a, b = size * rng.uniform(0.3, 1.0, 2)
    return [middle - a * u - b * v, middle + a * u - b * v, middle + a * u + b * v, middle - a * u + b * v]


def world(seed):
    """Plates of metal and glass, and a box: meshes, materials, faces for the truth, and two ends."""
    rng = np.random.default_rng(seed)
    meshes, rows, faces = [], [], []
    glass = lambda c: slab.layer(c, GLASS, 0.004, K)  # noqa: E731
    for i in range(5):
        corners = plate(rng, rng.uniform(-4, 4, 3), 5.0)
        meshes.append(quad(corners))
        rows.append((LAYER, GLASS, 0.004, 0.0) if i % 2 else (PEC, 1.0, 0.0, 0.0))
        faces.append(brute.Face(corners, glass if i % 2 else slab.pec, lets_through=bool(i % 2)))
    low = rng.uniform(-4, 3, 3)
    meshes.append(box(low, low + rng.uniform(0.5, 2.0, 3)))
    rows.append((PEC, 1.0, 0.0, 0.0))
    faces += brute.box(*meshes[-1].bounds)
    return meshes, rows, faces, rng.uniform(-6, 6, 3), rng.uniform(-6, 6, 3)


def same(routes, gain, truth):
    mine = np.argsort(routes.length)
    assert len(mine) == len(truth)
    np.testing.assert_allclose(routes.length[mine], [p.length for p in truth], atol=1e-9)
    np.testing.assert_allclose(lengths_of_vertices(routes), routes.length, rtol=1e-12)
    expected = np.array([p.gain for p in truth]).reshape(-1, 2, 2)
    np.testing.assert_allclose(gain[mine], expected, atol=1e-6 * np.abs(expected).max(initial=1e-9))


@pytest.mark.parametrize("seed", range(12))
def test_paths_of_a_random_world_are_those_of_the_brute_force_enumeration(seed):
    meshes, rows, faces, tx, rx = world(seed)
    f = facets(meshes, rows)
    routes = specular_routes(Geometry(f), tx, rx, 2, layers=9)
    same(routes, jones(routes, f, F), brute.specular_paths(tx, rx, faces, F, 2))


@pytest.mark.parametrize("seed", range(3))
def test_paths_within_a_metal_room_are_those_of_the_brute_force_enumeration(seed):
    rng = np.random.default_rng(seed)
    room, thing = box((0, 0, 0), (4, 3, 2.5)), box((1.5, 1.2, 0.1), (2.1, 1.9, 1.1))
    f = facets([room, thing])
    tx, rx = rng.uniform((0.2, 0.2, 1.3), (3.8, 2.8, 2.3), (2, 3))
    routes = specular_routes(Geometry(f), tx, rx, 2)
    faces = [*brute.box(*room.bounds), *brute.box(*thing.bounds)]
    same(routes, jones(routes, f, F), brute.specular_paths(tx, rx, faces, F, 2))


def test_a_stop_behind_the_mirror_before_it_makes_no_path():
    sheet = [[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]]
    wall = [[-9, 2.5, -1], [-3, 2.5, -1], [-3, 2.5, 1], [-9, 2.5, 1]]
    bodies = [rc.Body(name=n, mesh=quad(c), material="pec") for n, c in (("sheet", sheet), ("wall", wall))]
    found = rc.specular_paths(rc.Scene(bodies=bodies, frequency=F), (1, -0.3, 0.1), (-9, 0, 0.05), max_bounces=2)
    chains = {tuple(b for b in row if b) for row in found.bodies}
    assert ("sheet", "wall") not in chains
    walked = np.linalg.norm(np.diff(found.vertices, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(walked, found.length, rtol=1e-12)


def test_a_pane_just_before_a_mirror_leaves_its_path():
    gap = 4e-4
    mirror = [[-9, 1, -9], [9, 1, -9], [9, 1, 9], [-9, 1, 9]]
    pane = [[x, y - gap, z] for x, y, z in mirror]
    glass = lambda c: slab.layer(c, GLASS, 0.004, K)  # noqa: E731
    f = facets([quad(mirror), quad(pane)], [(PEC, 1.0, 0.0, 0.0), (LAYER, GLASS, 0.004, 0.0)])
    tx, rx = np.array([0, 0, 0.1]), np.array([2.0, -0.5, 0.3])
    routes = specular_routes(Geometry(f), tx, rx, 1, layers=4)
    faces = [brute.Face(mirror), brute.Face(pane, glass, lets_through=True)]
    same(routes, jones(routes, f, F), brute.specular_paths(tx, rx, faces, F, 1))


def test_a_path_of_no_gain_is_not_listed():
    thick = rc.Material(eps_r=80.0, sigma=1e4, thickness=10.0)
    pane = rc.Body(name="pane", mesh=quad([[1, -5, -5], [1, 5, -5], [1, 5, 5], [1, -5, 5]]), material=thick)
    found = rc.specular_paths(rc.Scene(bodies=[pane], frequency=F), (0, 0, 0), (2, 0, 0), max_bounces=1)
    assert len(found.length) == 0


def test_coplanar_plates_at_one_place_return_once():
    here = [[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]]
    there = [[-0.5, 2, -2], [2, 2, -2], [2, 2, 2], [-0.5, 2, 2]]
    f = facets([quad(here), quad(there)])
    routes = specular_routes(Geometry(f), np.array([0, 0, 0.1]), np.array([0.4, 0, 0.2]), 1)
    assert sorted((routes.kind > 0).sum(axis=1)) == [0, 1]
