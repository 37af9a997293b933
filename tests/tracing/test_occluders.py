"""Balls inside closed bodies: what lies in their shadow is seen by no ray, and leaving it out changes nothing."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.boxes_and_balls import WAVEFORM
from support.facets import ball, facets, facing_facets, ground

import raychan as rc
from raychan.geometry.closed_surfaces import clearance, winding
from raychan.records import LAYER
from raychan.tracing.contributions import Contributions
from raychan.tracing.culling import seed_facets
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror
from raychan.tracing.occluders import HidingSpheres, Occluders
from raychan.world.geometry import Geometry, geometry_of
from raychan.world.shapes import build

NOTHING = HidingSpheres(np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int32))
PANE = (LAYER, 6.3 - 0.2j, 0.004, 0.0)
STEEL = (0, 1.0 + 0j, 0.0, 0.0)


@pytest.mark.parametrize("name", ["sphere", "box", "truck", "van", "car"])
def test_a_core_lies_inside_and_no_facet_in_it(name):
    mesh = build(name, {"radius": 1.3} if name == "sphere" else {})
    v = mesh.corners
    centres, radii = mesh.inner_spheres((True,) * len(mesh.part_names))
    assert len(radii)
    rng = np.random.default_rng(0)
    for centre, radius in zip(centres, radii, strict=True):
        way = rng.normal(size=(20, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        assert all(mesh.winding(centre + 0.999 * radius * w) > 0.5 for w in way)
        on, _, _ = trimesh.proximity.closest_point_naive(trimesh.Trimesh(mesh.vertices, mesh.faces), centre[None])
        assert radius < np.linalg.norm(on[0] - centre) < 1.01 * radius
        assert winding(v, centre) == pytest.approx(mesh.winding(centre), abs=1e-9)


def test_the_clearance_is_that_of_points_all_over_the_facets():
    rng = np.random.default_rng(1)
    v = rng.normal(size=(30, 3, 3))
    weights = rng.dirichlet((0.5, 0.5, 0.5), size=40_000)
    weights[:3] = np.eye(3)
    for point in 3.0 * rng.normal(size=(40, 3)):
        dense = np.linalg.norm(np.einsum("wi,nic->nwc", weights, v) - point, axis=2).min()
        assert dense - 0.03 < clearance(v, point) <= dense + 1e-12


def test_what_is_open_or_lets_through_has_no_core():
    half = ball((0.0, 0.0, 0.0), 1.0)
    half.update_faces(half.triangles_center[:, 2] < 0.8)
    shell = facets([half, ball((9.0, 0.0, 0.0), 1.0)], [STEEL, PANE])
    assert not len(Geometry(shell).inner_spheres[1])
    mended = facets([half, ball((9.0, 0.0, 0.0), 1.0)])
    np.testing.assert_array_equal(Geometry(mended).inner_spheres[2], [1])


def test_the_cores_of_a_scene_are_those_of_its_facets():
    bodies = [
        rc.Body(name="truck", shape="truck", position=(14.0, 3.0, 0.0), yaw_deg=40.0),
        rc.Body(name="ground", shape="ground"),
        rc.Body(name="ball", shape="sphere", params={"radius": 2.0}, position=(9.0, -6.0, 2.0)),
    ]
    scene = rc.Scene(bodies=bodies)
    centre, radius, body = geometry_of(scene).inner_spheres
    assert set(body) == {0, 2}
    v = geometry_of(scene).facets
    for c, r, b in zip(centre, radius, body, strict=True):
        assert r < clearance(v.vertices[v.body == b], c) < 1.01 * r


LEGS = {
    "straight": lambda s: Leg(end=np.zeros(3)),
    "aside": lambda s: Leg(end=np.array([0.5, -2.5, 0.5])),
    "far": lambda s: Leg(end=np.array([-0.9578262852211513, 0.0, -0.28734788556634544]), far=True),
    "over the ground": lambda s: Leg(
        end=np.array([0.0, 0.0, -1.5]), mirrors=(Mirror.of(s, int(np.flatnonzero(s.facets.body == 2)[0]), 1.0),)
    ),
}


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize("aside", np.linspace(0.0, 3.0, 7))
def test_what_a_solid_body_hides_is_what_no_ray_finds(leg, aside):
    front = trimesh.creation.capsule(height=1.5, radius=1.2, count=[24, 24])
    front.apply_translation((6.0, 0.0, -0.75))
    geometry = Geometry(facets([front, ball((12.0, aside, 0.3)), ground(height=-2.0)], smooth=True))
    way, bodies = LEGS[leg](geometry), np.array([True, True, False])
    found = seed_facets(geometry, way, bodies)
    # The occluders are left out: they only save time, so that no setting does without them.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Occluders, "spheres_over", lambda self, leg: NOTHING)
        left = np.setdiff1d(seed_facets(geometry, way, bodies), found)
    middle = geometry.facets.vertices[left].mean(axis=1)
    slack = np.full(len(left), 1e-3)
    assert not way.visible(geometry, middle, left.astype(np.int32), slack, 0).seen.any()
    assert np.isin(found, facing_facets(geometry, way, bodies)).all()
    if leg in ("straight", "over the ground") and aside == 0.0:
        assert len(left) > 500


def test_what_stands_before_a_solid_body_or_about_it_stays():
    inner, outer = ball((6.0, 0.0, 0.0), 1.0), ball((6.0, 0.0, 0.0), 2.0)
    geometry = Geometry(facets([inner, outer, ball((3.0, 0.0, 0.0))], smooth=True))
    leg, bodies = Leg(end=np.zeros(3)), np.array([False, True, True])
    np.testing.assert_array_equal(seed_facets(geometry, leg, bodies), facing_facets(geometry, leg, bodies))


@pytest.mark.compiled(reason="minutes as plain Python")
def test_paths_are_the_same_bit_for_bit_whether_or_not_hidden_facets_are_looked_at(monkeypatch):
    def paths():
        bodies = [
            rc.Body(name="ground", shape="ground", material="asphalt"),
            rc.Body(name="truck", shape="truck", position=(12.0, 0.0, 0.0)),
            rc.Body(name="car", shape="car", position=(24.0, 0.5, 0.0)),
            rc.Body(name="tank", mesh=ball((7.0, 3.0, 1.4), 1.3)),
            rc.Body(name="bin", mesh=ball((12.0, 5.2, 1.2), 0.4)),
            rc.Body(name="wall", shape="wall", position=(15.0, 7.0, 0.0)),
        ]
        radar = {
            "position": [0.0, 0.0, 1.0],
            "waveform": {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 64},
        }
        return rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 3, "tolerance_db": 3.0})).paths

    calls, within = [], Occluders.spheres_over

    def counted(self, leg):
        calls.append(len(within(self, leg)[1]))
        return within(self, leg)

    # The weakest tubes are let go up to a sum, to which hidden ones would add. Neither that nor the occluders can be
    # left out by a setting: both only save time.
    monkeypatch.setattr(Contributions, "that_count", lambda self, bound, length, many=0: np.arange(len(bound)))
    monkeypatch.setattr(Occluders, "spheres_over", counted)
    ours = paths()
    assert max(calls) > 0
    monkeypatch.setattr(Occluders, "spheres_over", lambda self, leg: NOTHING)
    every = paths()
    for name in ("length", "amplitude", "length_rate", "body", "kind", "vertices"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(every, name), err_msg=name)


@pytest.mark.parametrize("others", [[], [rc.Body("ground", shape="ground")]])
@pytest.mark.parametrize("thickness", [0.0, 1e-9, 1e-3])
def test_a_closed_body_without_thickness_hides_what_a_plate_of_its_size_hides(thickness, others):
    flat = trimesh.creation.box((thickness, 2.0, 1.5))
    sign = rc.Body("sign", mesh=flat, position=(6.0, 0.3, 0.75), material=rc.PEC)
    beyond = rc.Body("ball", shape="sphere", params={"radius": 0.6}, position=(10.0, 3.5, 0.8))
    hidden = rc.Body("behind", shape="sphere", params={"radius": 0.3}, position=(8.0, 0.3, 0.9))
    radar = {"waveform": WAVEFORM, "position": (0.0, 0.0, 0.6), "power_dbm": 20.0}
    scene = rc.Scene(bodies=[sign, beyond, hidden, *others], radar=radar, model={"max_bounces": 1})
    geometry = geometry_of(scene, 0.5)
    lit = seed_facets(geometry, Leg(end=np.array([0.0, 0.0, 0.6])), np.ones(geometry.piece.max() + 1, bool))
    names = {geometry.facets.body_names[b] for b in geometry.facets.body[lit]}
    assert "ball" in names
    assert any("without thickness" in note for note in scene.warnings) == (thickness < 1e-6)
    seen = rc.simulate(scene).detections
    assert any(np.abs(seen.range - np.linalg.norm([10.0, 3.5, 0.2]) + 0.6) < 0.4)
    assert not any(np.abs(seen.range - 7.7) < 0.4)
