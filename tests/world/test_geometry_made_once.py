"""Geometry is made once and kept: with a mesh, a body, a scene; and goes when these go."""

from __future__ import annotations

import copy
import dataclasses
import gc
import pickle
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from support.facets import ball, facets, facing_facets, quad
from support.places import SCENES
from support.results import assert_same

import raychan as rc
from raychan.radar.beam_table import beam_of
from raychan.run.sequence import frames
from raychan.tracing.culling import seed_facets
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry, geometry_of
from raychan.world.ray_caster import RayCaster

RADAR = {
    "position": [0.0, 0.0, 1.0],
    "waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 64},
}
BODIES = """
[[bodies]]
name = "wall"
shape = "plate"
params = { width = 2.0, height = 2.0 }
position = [6.0, 0.0, 1.0]
yaw_deg = 180.0

[[bodies]]
name = "box"
shape = "box"
position = [4.0, 2.0, 0.0]
"""
TEXT = """
[radar]
position = [0.0, 0.0, 1.0]
waveform = { bandwidth_mhz = 500.0, chirp_us = 30.0, chirps = 16, samples = 64 }
"""


@pytest.fixture
def scene():
    return rc.Scene.from_text(TEXT + BODIES)


@pytest.fixture
def builds(monkeypatch):
    """Count how many tracers are made: their making costs, and no result shows it."""
    made = []
    init = RayCaster.__init__
    monkeypatch.setattr(RayCaster, "__init__", lambda self, f, *a: (made.append(len(f.body)), init(self, f, *a))[1])
    return made


def test_a_scene_is_built_once_for_all_seeds_and_radars(scene, builds):
    first = rc.simulate(scene, seed=1)
    rc.simulate(scene, seed=2)
    louder = scene.override(["radar.power_dbm=20", "radar.position=[0.5, 0.0, 1.0]"])
    rc.simulate(louder)
    assert len(builds) == 1
    assert_same(first, rc.simulate(rc.Scene.from_text(TEXT + BODIES), seed=1))
    assert len(builds) == 2


def test_a_scene_that_has_run_can_be_sent_to_another_process(scene):
    first = rc.simulate(scene, seed=1)
    for sent in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        assert not sent._derived
        assert_same(first, rc.simulate(sent, seed=1))


def test_a_moved_body_keeps_its_mesh_and_the_others_stay_what_they_are(scene, builds):
    moved = scene.override(["bodies.box.position=[4.0, -2.0, 0.0]"])
    assert moved.bodies[0] is scene.bodies[0]
    assert moved.bodies[1].geometry is scene.bodies[1].geometry
    assert geometry_of(moved) is not geometry_of(scene)
    np.testing.assert_allclose(moved.facets().vertices[-1, :, 1], scene.facets().vertices[-1, :, 1] - 4.0, atol=1e-12)


@pytest.mark.parametrize(
    "change", ["bodies.box.material='glass'", "bodies.box.params.length=3.0", "scene.frequency_ghz=24.0"]
)
def test_what_changes_a_surface_makes_a_new_one(scene, change):
    assert geometry_of(scene.override([change])) is not geometry_of(scene)


def test_joints_of_meshes_are_those_found_from_facets_alone(scene):
    turned = scene.override(["bodies.box.yaw_deg=33.0"])
    own, blind = Geometry(turned.facets(), turned.topology), Geometry(turned.facets())
    for name in ("plane", "smooth", "both_sides", "piece", "first_edge", "plane_edges"):
        np.testing.assert_array_equal(getattr(own, name), getattr(blind, name), err_msg=name)
    for name in ("edge_ends", "wedge"):
        a, b = (np.sort(getattr(s, name).reshape(-1, 6), axis=0) for s in (own, blind))
        np.testing.assert_array_equal(a, b, err_msg=name)


def test_what_is_kept_goes_with_the_scene():
    scene = rc.Scene.from_text(TEXT + BODIES)
    result = rc.simulate(scene)
    gone = weakref.ref(geometry_of(scene)), weakref.ref(scene.bodies[0].geometry.topology)
    del scene
    gc.collect()
    assert gone[0]() is None, "a result holds on to the surface"
    assert gone[1]() is not None, "the meshes are the result's too"
    del result
    gc.collect()
    assert gone[1]() is None


def test_surfaces_go_without_the_garbage_collector_frame_by_frame():
    moving = rc.Scene.from_text(TEXT + BODIES + "velocity_mps = [0.0, -1.0, 0.0]\n")
    alive = weakref.WeakSet()
    init = Geometry.__init__

    def noted(self, *args):
        init(self, *args)
        alive.add(self)

    gc.collect()
    gc.disable()
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Geometry, "__init__", noted)
            kept, most = [], 0
            for frame in frames(moving, 4, 0.05):
                kept.append(frame.result)
                most = max(most, len(alive))
    finally:
        gc.enable()
    assert most == 1
    assert len(kept) == 4


def test_a_moving_radar_has_one_beam(scene):
    assert beam_of(scene.radar) is beam_of(scene.radar.at(0.3))
    assert beam_of(scene.radar) is not beam_of(dataclasses.replace(scene.radar, yaw_deg=6.0))


@pytest.mark.parametrize("end", [(0.0, 0.0, 0.0), (0.3, 3.0, -1.0), (6.0, 0.2, 0.1), (30.0, -4.0, 9.0)])
def test_clusters_pass_over_only_facets_that_turn_away(end):
    geometry = Geometry(facets([ball((6.0, 0.0, 0.0), 1.5), ball((9.0, 4.5, 2.0))], smooth=True))
    for leg in (Leg(end=np.array(end)), Leg(end=np.array([0.6, 0.0, 0.8]), far=True)):
        for bodies in (np.array([True, True]), np.array([False, True])):
            np.testing.assert_array_equal(seed_facets(geometry, leg, bodies), facing_facets(geometry, leg, bodies))


@pytest.mark.parametrize("end", [(0.0, 0.0, 0.0), (6.0, 0.2, 0.1), (9.3, 1.1, 2.0), (30.0, -4.0, 9.0)])
def test_edges_turn_where_one_facet_looks_here_and_the_other_does_not(end):
    sheet = quad([[4, 3, -1], [4, 5, -1], [4, 5, 1], [4, 3, 1]])
    truck = rc.Body(name="truck", shape="truck", position=(20.0, 3.0, 0.0), yaw_deg=30.0)
    balls = facets([ball((6.0, 0.0, 0.0), 1.5), sheet, ball((9.0, 1.0, 2.0))], smooth=True)
    for geometry in (Geometry(balls), geometry_of(rc.Scene(bodies=[truck, rc.Body(name="bin", shape="trash_bin")]))):
        half, faces = geometry.scene_topology.silhouettes
        for image, far in ((np.array(end), False), (np.array([0.6, 0.0, 0.8]), True)):
            towards = geometry.normal @ image if far else ((image - geometry.first) * geometry.normal).sum(axis=1)
            front = towards > 0.0
            wanted = (faces[:, 1] < 0) | (front[faces[:, 0]] != front[faces[:, 1]])
            found = geometry.silhouette_edges(image, far)
            assert 0 < len(found[0]) < len(half)
            np.testing.assert_array_equal(found[0], half[wanted])
            np.testing.assert_array_equal(found[1], faces[wanted])


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("aside", np.linspace(0.0, 4.0, 9))
def test_what_a_wall_hides_is_what_no_ray_finds(aside, side):
    corners = np.array([[4, -1, -1], [4, 1, -1], [4, 1, 1], [4, -1, 1]], float)[:: int(side)]
    geometry = Geometry(facets([quad(corners), ball((8.0, aside, 0.3))], smooth=True))
    leg, bodies = Leg(end=np.zeros(3)), np.array([True, True])
    found = seed_facets(geometry, leg, bodies)
    left = np.setdiff1d(facing_facets(geometry, leg, bodies), found)
    middle = geometry.facets.vertices[left].mean(axis=1)
    slack = np.full(len(left), 1e-3)
    assert not leg.visible(geometry, middle, left.astype(np.int32), slack, 0).seen.any()
    assert (len(left) > 0) == (aside < 2.5)


def test_where_the_antenna_sends_nothing_nothing_is_launched(scene):
    geometry = Geometry(
        facets([ball((6.0, 1.0, 0.0), 1.5), ball((-6.0, 0.0, 0.5)), ball((0.0, 5.0, 1.0), 1.0)], smooth=True)
    )
    leg, bodies = Leg(end=np.zeros(3), beam=beam_of(scene.radar)), np.ones(3, bool)
    found, every = seed_facets(geometry, leg, bodies), facing_facets(geometry, leg, bodies)
    assert set(geometry.facets.body[found]) == {0, 2}
    left = np.setdiff1d(every, found)
    look = geometry.facets.vertices[left].reshape(-1, 3)
    assert not leg.weight(look).any()
    assert len(np.intersect1d(found, every)) == len(found)


def test_two_threads_may_simulate_one_scene_at_once():
    changes = ["model.max_bounces=2", "radar.waveform.samples=256", "radar.waveform.chirps=32"]
    scene = rc.Scene.load(SCENES / "occluded_pedestrian.toml").override(changes)
    with ThreadPoolExecutor(2) as pool:
        jobs = [pool.submit(rc.simulate, scene, tolerance_db=3.0) for _ in range(2)]
        one, other = (job.result() for job in jobs)
    alone = rc.simulate(rc.Scene.load(SCENES / "occluded_pedestrian.toml").override(changes), tolerance_db=3.0)
    for result in (one, other):
        assert result.stats["rays"] == alone.stats["rays"]
        np.testing.assert_array_equal(result.cube.samples, alone.cube.samples)
