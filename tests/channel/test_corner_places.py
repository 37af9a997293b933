"""Corners of footprints as the elements of an array see them: against images, a sphere's rays, and single receivers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.channel.corner_places import corner_places
from raychan.channel.corner_rays import departures
from raychan.channel.paths import join, nothing, of_trajectories, paths_of
from raychan.radar.array import wavefronts
from raychan.records import REFLECT, SCATTER, Routes
from raychan.run.micro_doppler import retraced
from raychan.run.rules import fine_rule, step_rule
from raychan.signal.baseband import synthesize
from raychan.tracing.solver import launch_routes
from raychan.tracing.stats import Stats
from raychan.units import C0
from raychan.world.geometry import geometry_of

WAVE = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=30e-6, n_chirps=8, n_samples=64)
HALF = 0.5 * C0 / WAVE.middle
RADAR = rc.Radar(WAVE, (0, 0, 1.0), noise=False, antenna=rc.IsotropicAntenna(), power=1e6)
ARRAY = replace(RADAR, elements=rc.uniform_array(8, HALF))
BALL = np.array([4.0, 0.3, 1.0]), 0.4


def routes_of(of, step=0):
    """Routes of a scene with a footprint, one batch after the other, and its facets."""
    geometry = geometry_of(of, of.model.tolerance_db)
    rule = step_rule(of.radar, of.processing, of.model, step)
    rule = replace(rule, refinement=replace(rule.refinement, floor=1e-9, relative=1e-6))
    batches = launch_routes(geometry, of.points(0.0), rule, Stats())
    return [r for r in batches if isinstance(r, Routes) and (r.kind == SCATTER).any()], geometry.facets


def scene(*bodies, radar=ARRAY, **model):
    return rc.Scene(bodies=list(bodies), radar=radar, model={"max_bounces": 1} | model)


def plate(yaw_deg, **size):
    params = {"width": 1.2, "height": 1.4} | size
    return rc.Body("plate", shape="plate", params=params, position=(2.0, 0.2, 0.3), yaw_deg=yaw_deg)


def samples(of, step=0, only=lambda paths: paths):
    batches, facets = routes_of(of, step)
    paths = join([nothing(facets, of.radar), *(paths_of(b, facets, of.radar, WAVE.carrier) for b in batches)])
    return synthesize(only(paths), of.radar, tolerance=1e-7).samples[:, 0]


def test_ways_between_elements_over_plane_mirrors_are_those_between_their_images():
    """Slow second way: the element itself mirrored at every plane of the route, then its distance to the corner."""
    corner = rc.Body("corner", shape="dihedral", params={"size": 0.4, "height": 0.5}, position=(3, 0, 1), yaw_deg=160)
    ground = rc.Body("ground", shape="ground", params={"size": 60.0}, material="concrete")
    batches, facets = routes_of(scene(corner, ground, max_bounces=3))
    tx, rx, seen = np.array([0.02, 0.03, -0.01]), np.array([-0.01, 0.04, 0.02]), 0
    for routes in batches:
        rows = np.flatnonzero((routes.kind == SCATTER).any(axis=1))
        rows = rows[(np.arange(len(rows)) % 3 == 0) & ((routes.kind[rows] == REFLECT).sum(axis=1) > 0)]
        places = corner_places(routes, rows, facets)[0].astype(float)
        ends = (np.broadcast_to(x, (len(routes.kind), 1, 3)) for x in (routes.tx, routes.rx))
        stops = np.concatenate([next(ends), routes.vertices, next(ends)], axis=1)
        fronts = wavefronts(stops, routes.scatter, *departures(routes), routes.length)
        for c in range(3):
            got = fronts.moved(rows, places[:, c]).between(tx, rx)[0][rows]
            for row, value in zip(rows, got, strict=True):
                at, used = routes.scatter[row], int((routes.kind[row] > 0).sum())
                want = 0.0
                for end, off, way in ((routes.tx, tx, range(at)), (routes.rx, rx, range(used - 1, at, -1))):
                    here = np.array([end, end + off])
                    for j in way:
                        n = routes.normals[row, j] * (routes.kind[row, j] == REFLECT)
                        here = here - 2.0 * ((here - routes.vertices[row, j]) @ n)[:, None] * n
                    want += np.diff(np.linalg.norm(routes.points[row, c] - here, axis=1))[0]
                assert value == pytest.approx(want, abs=2e-7)
                seen += 1
    assert seen > 100


def test_corners_behind_a_sphere_lie_along_the_rays_that_leave_to_them():
    """The true ray is reflected where both ways make equal angles with the sphere's normal, found by iteration."""
    (middle, radius), wall = BALL, {"width": 0.6, "height": 0.6}
    ball = rc.Body("ball", shape="sphere", params={"radius": radius, "max_sag": 0.0006}, position=tuple(middle))
    wall = rc.Body("wall", shape="plate", params=wall, position=(3.5, 1.6, 1.0), yaw_deg=-80.0)
    batches, facets = routes_of(scene(ball, wall, max_bounces=2))
    off, wrong = [], []
    for routes in batches:
        if routes.kind.shape[1] < 2:
            continue
        rows = np.flatnonzero((routes.scatter == 1) & (routes.body[:, :2] == (0, 1)).all(axis=1))
        places = corner_places(routes, rows, facets)[0].astype(float)
        steps = np.diff(
            np.concatenate([np.broadcast_to(routes.tx, (len(rows), 1, 3)), routes.vertices[rows]], 1), axis=1
        )
        away, centre = np.linalg.norm(steps, axis=2), steps[:, 0] / np.linalg.norm(steps[:, 0], axis=1)[:, None]
        source = (centre * away[:, :2].sum(axis=1)[:, None])[:, None] + places[:, :, 0]
        for r, row in enumerate(rows):
            for c in range(3):
                true = reflection(routes.tx, routes.points[row, c]) - routes.tx
                true /= np.linalg.norm(true)
                off.append(true - centre[r])
                wrong.append(true - source[r, c] / np.linalg.norm(source[r, c]))
    assert len(off) > 300
    assert np.median(np.linalg.norm(wrong, axis=1)) < 0.15 * np.median(np.linalg.norm(off, axis=1))
    assert np.sqrt(np.square(wrong).sum(axis=1).mean()) < 0.3 * np.sqrt(np.square(off).sum(axis=1).mean())


def reflection(tx, point):
    """Return the point (3,) of the ball over which two points see each other."""
    (middle, radius), n = BALL, np.zeros(3)
    for _ in range(100):
        ways = [x - middle - radius * n for x in (tx, point)]
        m = sum(w / np.linalg.norm(w) for w in ways)
        n = n + 0.5 * (m / np.linalg.norm(m) - n)
        n /= np.linalg.norm(n)
    return middle + radius * n


@pytest.mark.parametrize("yaw_deg", [180.0, 174.0, 150.0])
def test_a_near_plate_before_an_array_is_what_single_receivers_there_receive(yaw_deg):
    """Each element alone is a radar whose receiver stands there: of its own the tracer knows how long each way is."""

    def scattered(paths):
        return of_trajectories(paths, (paths.trajectories.kind == SCATTER).any(axis=1))

    got = samples(scene(plate(yaw_deg), tolerance_db=1.0))
    for i in (0, 3, 7):
        there = replace(RADAR, rx_position=tuple(RADAR.position + ARRAY.elements_world[i]))
        true = samples(scene(plate(yaw_deg), radar=there, tolerance_db=0.1), 2, scattered)
        assert np.abs(got[i] - true[0]).max() < 0.03 * np.abs(true).max()


@pytest.mark.parametrize("yaw_deg", [180.0, 150.0])
def test_cuts_of_a_plate_change_nothing_at_any_element(yaw_deg):
    """Two facets, and the same plate of 200: the terms at the corners where tubes meet cancel at all elements."""
    few, many = (
        samples(scene(replace(plate(yaw_deg), shape=None, params={}, mesh=sheet(n)), tolerance_db=0.5)) for n in (1, 10)
    )
    for i in (0, 3, 7):
        assert np.abs(few[i] - many[i]).max() < 0.02 * np.abs(few[i]).max()


def sheet(n):
    """Mesh of a plate of 2 n^2 facets."""
    y, z = np.meshgrid(np.linspace(-0.6, 0.6, n + 1), np.linspace(-0.7, 0.7, n + 1), indexing="ij")
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (x.ravel() for x in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return trimesh.Trimesh(np.stack([0.0 * y.ravel(), y.ravel(), z.ravel()], axis=1), faces, process=False)


def test_the_first_chirp_of_a_turning_plate_is_that_of_its_paths_at_every_element():
    """So far off that no footprint is divided into pieces."""
    turning = replace(plate(150.0), position=(20.0, 0.2, 0.3), spin_dps=(0.0, 0.0, 1.0))
    of = scene(turning, retrace=2)
    rule = fine_rule(of.radar, of.processing, of.model)
    geometry = geometry_of(of, of.model.tolerance_db)
    batches = launch_routes(geometry, of.points(0.0), rule, Stats())
    paths = join([paths_of(b, geometry.facets, of.radar, WAVE.carrier) for b in batches])
    want = synthesize(paths, of.radar, tolerance=1e-7).samples[:, 0]
    got = retraced(of, rule, of.model).samples[:, 0]
    np.testing.assert_allclose(got, want, rtol=0.0, atol=1e-3 * np.abs(want).max())
