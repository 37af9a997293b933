"""What stands still is kept while other bodies move: nothing that comes out may tell."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
import trimesh
from support.facets import ball
from support.results import assert_same

import raychan as rc
from raychan.run.sequence import frames
from raychan.world import static_geometry
from raychan.world.geometry import Geometry, surface_at
from raychan.world.shared_rows import SharedRows

RADAR = {
    "position": [0.0, 0.0, 1.0],
    "waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 64},
}


def bodies():
    return [
        rc.Body(
            name="box", shape="box", position=(6.0, 2.0, 0.0), velocity=(0.0, -4.0, 0.0), spin_dps=(30.0, 0.0, 0.0)
        ),
        rc.Body(name="truck", shape="truck", position=(20.0, 3.0, 0.0), yaw_deg=30.0),
        rc.Body(
            name="drum",
            mesh=ball((0.0, 0.0, 0.0), 1.2),
            position=(9.0, -3.0, 1.5),
            velocity=(3.0, 1.0, 0.0),
            turn_rate_dps=50.0,
        ),
        rc.Body(name="pane", shape="plate", material="car_glass", position=(4.0, -1.0, 1.0), yaw_deg=200.0),
        rc.Body(name="ground", shape="ground", material="asphalt"),
    ]


@pytest.fixture(params=["still", "rigid", "both"])
def scene(request, monkeypatch):
    """Return a scene of which the truck is kept, or the drum in its own frame, or both."""
    # Real bodies of 200,000 facets take minutes to trace; that sharing begins there is no one's choice.
    monkeypatch.setattr(static_geometry, "MANY", 2000)
    all_ = bodies()
    picked = {"still": [0, 1, 3, 4], "rigid": [0, 2, 3, 4], "both": [0, 1, 2, 3, 4]}[request.param]
    scene = rc.Scene(bodies=[all_[i] for i in picked], radar=RADAR, model={"max_bounces": 2, "tolerance_db": 3.0})
    assert scene.static_geometry is not None
    assert bool(scene.static_geometry.instances) == (request.param != "still")
    return scene


def rays(geometry, n=20_000):
    rng = np.random.default_rng(3)
    low, high = np.array([-1.0, -8.0, 0.0]), np.array([26.0, 8.0, 4.0])
    origin, aim = (rng.uniform(low, high, (n, 3)) for _ in range(2))
    direction = aim - origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    skip = np.where(rng.uniform(size=n) < 0.2, rng.integers(0, len(geometry.first), n), -1).astype(np.int32)
    # Of those that leave a facet, origins lie on it.
    leaves = skip >= 0
    origin[leaves] = geometry.facets.vertices[skip[leaves]].mean(axis=1)
    return origin, direction, skip, np.where(rng.uniform(size=n) < 0.5, rng.uniform(0.0, 9.0, n), 0.0)


@pytest.mark.parametrize("time", [0.0, 0.7])
def test_rays_meet_the_facets_that_they_meet_in_one_scene(scene, time):
    scene.at(0.3).facets()
    now = scene.at(time)
    geometry, plain = surface_at(now), Geometry(now.facets(), now.topology)
    assert len(geometry._groups) > 1
    assert len(plain._groups) == 1
    (facet, t), (wanted, at) = (s.cast(*rays(plain)) for s in (geometry, plain))
    hits = wanted >= 0
    assert hits.mean() > 0.5
    for body in range(len(scene.bodies)):
        assert (plain.facets.body[wanted[hits]] == body).sum() > 50
    # Facets that meet at an edge, or lie on each other, may stand for one another.
    differ = facet != wanted
    assert differ.mean() < 1e-3
    np.testing.assert_array_equal(t[~differ], at[~differ])
    np.testing.assert_allclose(t[differ], at[differ], atol=2e-5)


def test_what_is_kept_is_what_is_made_anew(scene):
    for time in (0.4, 0.0, 1.1):
        ours, fresh = surface_at(scene.at(time)), Geometry(rebuilt(scene.at(time)).facets(), scene.topology)
        for name in ("vertices", "normals", "body", "part", "material", "origin", "velocity", "spin"):
            np.testing.assert_array_equal(getattr(ours.facets, name), getattr(fresh.facets, name), err_msg=name)
        own = (
            "first",
            "normal",
            "area",
            "edge_curvature",
            "curved",
            "extents",
            "plane",
            "smooth",
            "is_layer",
            "lossy",
            "wall_area",
        )
        for name in (*own, "both_sides", "piece", "plane_edges", "first_edge", "edge_ends", "wedge", "touch", "extent"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(fresh, name), err_msg=name)
        for name in ("order", "first", "centre", "radius"):
            np.testing.assert_array_equal(getattr(ours.clusters, name), getattr(fresh.clusters, name), err_msg=name)


def rebuilt(scene):
    """Return the same scene without anything that is kept."""
    return scene.without_caches()


def test_frames_do_not_depend_on_those_before_them(scene):
    made = list(frames(scene, 3, 0.2, seed=5))
    again = rc.Scene(bodies=scene.bodies, radar=RADAR, model={"max_bounces": 2, "tolerance_db": 3.0})
    assert_same(made[2].result, rc.simulate(again.at(0.4), seed=7))
    assert_same(made[0].result, rc.simulate(scene, seed=5))


def test_a_result_does_not_hold_on_to_what_is_kept(scene):
    family = scene.without_caches()
    result = rc.simulate(family.at(0.1))
    gone = weakref.ref(family._static[static_geometry.StaticGeometry])
    del family
    gc.collect()
    assert gone() is None
    assert result.scene.static_geometry is not None


def test_small_scenes_and_those_in_which_nothing_moves_keep_nothing():
    assert rc.Scene(bodies=bodies(), radar=RADAR).static_geometry is None
    many = trimesh.creation.icosphere(subdivisions=6, radius=1.0)
    assert (
        rc.Scene(bodies=[rc.Body(name="ball", mesh=many, position=(9.0, 0.0, 1.0))], radar=RADAR).static_geometry
        is None
    )


@pytest.mark.parametrize("plain", [False, True])
def test_copies_of_a_sheet_are_each_others_alike_but_where_written(plain, monkeypatch):
    if plain:
        monkeypatch.delattr("os.memfd_create", raising=False)
    array = np.arange(300_000, dtype=float).reshape(-1, 3)
    sheet = SharedRows(array.copy())
    one, two = sheet.copy(), sheet.copy()
    one[5] = -1.0
    np.testing.assert_array_equal(two, array)
    del sheet
    np.testing.assert_array_equal(one[6:], array[6:])
    assert (one[5] == -1.0).all()
    assert SharedRows(np.zeros((0, 3))).copy().shape == (0, 3)
