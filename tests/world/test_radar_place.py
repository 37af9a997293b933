"""Where a radar stands to a body, and whether its array can have what its processing asks for."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import trimesh
from support.facets import box, quad

import raychan as rc
from raychan.world.errors import SceneError
from raychan.world.point_in_body import Place, in_plane_of, place_of

F = 77e9
SCENE = """
[radar]
position = {at}
[radar.waveform]
carrier_ghz = 77.0
bandwidth_mhz = 1000.0
chirp_us = 30.0
repetition_us = 40.0
chirps = 8
samples = 64
[[bodies]]
name = "plate"
shape = "plate"
params = {{ width = 1.0, height = 1.0 }}
position = [4.0, 0.0, 0.0]
"""


@pytest.mark.parametrize("seed", range(5))
def test_a_point_is_inside_a_convex_body_where_it_lies_behind_all_its_faces(seed):
    rng = np.random.default_rng(seed)
    hull = trimesh.convex.convex_hull(rng.normal(size=(30, 3)))
    corners = np.array(hull.triangles)
    for p in rng.normal(size=(60, 3)):
        behind = (((p - corners[:, 0]) * hull.face_normals).sum(axis=1) < 0.0).all()
        assert place_of(corners, p) == (Place.INSIDE if behind else Place.OUTSIDE)
    weights = rng.dirichlet(np.ones(3), len(corners))
    assert all(place_of(corners, p) == Place.ON for p in np.einsum("fi,fic->fc", weights, corners))


def test_an_open_box_has_no_inside():
    closed = np.array(box((-1, -1, -1), (1, 1, 1)).triangles)
    assert place_of(closed, np.zeros(3)) == Place.INSIDE
    assert place_of(closed[:-2], np.zeros(3)) == Place.OUTSIDE


def test_a_body_turned_inside_out_still_has_an_inside():
    corners = np.array(box((-1, -1, -1), (1, 1, 1)).triangles)[:, ::-1]
    assert place_of(corners, np.full(3, 0.2)) == Place.INSIDE


def test_facets_whose_plane_holds_a_point_are_counted():
    cube = box((-1, -1, -1), (1, 1, 1))
    first, normal = np.array(cube.triangles)[:, 0], np.array(cube.face_normals)
    planes = first, normal, (first * normal).sum(axis=1)
    assert in_plane_of(planes, np.array([5.0, 1.0, 0.3])) == 2
    assert in_plane_of(planes, np.array([5.0, 1.1, 0.3])) == 0


@pytest.mark.parametrize(("distance", "word"), [(0.4, "inside"), (1.0, "on")])
def test_a_radar_inside_a_mesh_or_on_it_is_an_error_of_rcs(distance, word):
    with pytest.raises(ValueError, match=f"is {word} the mesh"):
        rc.rcs(box((-1, -1, -1), (1, 1, 1)), F, 0.0, distance=distance)
    with pytest.raises(ValueError, match=f"is {word} the mesh"):
        rc.rcs(box((-1, -1, -1), (1, 1, 1)), F, 0.0, distance=5.0, rx_azimuth_deg=90.0, rx_distance=distance)


def test_a_radar_in_the_plane_of_a_sheet_sees_nothing_of_it_and_divides_by_no_zero():
    sheet = quad([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = rc.rcs(sheet, F, [0.0, 30.0], 0.0, distance=5.0)
    assert (found.sigma < 1e-9).all()


@pytest.mark.parametrize("shape", ["sheet", "box"])
def test_a_radar_in_the_plane_of_a_face_is_told_and_divides_by_no_zero(shape):
    mesh = box((3, -1, -1), (5, 1, 1)) if shape == "box" else quad([[3, -1, 1], [5, -1, 1], [5, 1, 1], [3, 1, 1]])
    scene = rc.Scene(bodies=[rc.Body(name="thing", mesh=mesh)], frequency=F)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = rc.specular_paths(scene, (0.0, 0.0, 1.0), (0.5, 0.2, 1.0), max_bounces=2)
    assert np.isfinite(found.gain).all() and len(found.length) >= 1


def test_a_scene_tells_of_facets_that_the_radar_sees_edge_on(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(
        SCENE.format(at="[0.0, 0.0, 0.5]")
        .replace('"plate"\nparams', '"box"\nparams')
        .replace("width = 1.0, height = 1.0", "length = 1.0, width = 1.0, height = 1.0")
    )
    scene = rc.Scene.load(file)
    z = scene.bodies[0].geometry.bounds[1, 2]
    file.write_text(file.read_text().replace("[0.0, 0.0, 0.5]", f"[0.0, 0.0, {z}]"))
    assert any("in the plane of 2 facets of 'plate'" in w for w in rc.Scene.load(file).warnings)


WAVE = rc.Waveform(carrier=77e9, bandwidth=600e6, chirp_duration=40e-6, n_chirps=16, n_samples=64)


@pytest.mark.parametrize(("away", "told"), [(0.001, True), (0.0038, True), (0.0041, False), (0.5, False)])
def test_a_scene_tells_of_a_radar_within_a_wavelength_of_a_body(away, told):
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.5}, position=(0.5 + away, 0.0, 1.0))
    radar = rc.Radar(waveform=WAVE, position=(0.0, 0.0, 1.0))
    said = [w for w in rc.Scene(bodies=[ball], radar=radar).warnings if "less than a wavelength (3.9 mm)" in w]
    assert len(said) == told


def test_a_scene_tells_of_a_receiver_within_a_wavelength_of_a_body():
    plate = rc.Body("plate", shape="plate", params={"width": 1.0, "height": 1.0}, position=(2.0, 0.0, 1.0))
    radar = rc.Radar(waveform=WAVE, position=(0.0, 0.0, 1.0), rx_position=(1.998, 0.2, 1.1))
    assert any("receiver is 2 mm from 'plate', less" in w for w in rc.Scene(bodies=[plate], radar=radar).warnings)


def test_a_radar_on_a_plate_is_an_error_of_the_scene(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(SCENE.format(at="[4.0, 0.1, 0.1]"))
    with pytest.raises(SceneError, match="on the surface of 'plate'"):
        rc.Scene.load(file)


LINE = [[0.0, 1.9 * k, 0.0] for k in range(4)]
GAP = [[0.0, 1.9 * k, 0.0] for k in (0, 1, 4, 6)]
PLANE = [[0.0, 1.9 * i, 1.9 * k] for i in range(2) for k in range(2)]


@pytest.mark.parametrize(
    ("elements", "key", "value", "allowed"),
    [
        (LINE, "doa", "esprit", True),
        (GAP, "doa", "esprit", False),
        (PLANE, "doa", "esprit", False),
        ([[0.0, 0.0, 0.0]], "doa", "esprit", False),
        (GAP, "doa", "music", True),
        (LINE, "beam_window", "hann", True),
        (PLANE, "beam_window", "taylor(30)", True),
        (GAP, "beam_window", "hann", False),
    ],
)
def test_esprit_and_tapers_are_for_arrays_that_can_have_them(elements, key, value, allowed):
    wave = {"bandwidth_mhz": 300, "chirp_us": 20, "chirps": 32, "samples": 64}
    data = {"radar": {"elements_mm": elements, "waveform": wave}, "processing": {key: value}}
    if allowed:
        assert getattr(rc.Scene.from_dict(data).radar.processing, key) == value
        return
    with pytest.raises(SceneError, match="no uniform line") as e:
        rc.Scene.from_dict(data)
    assert e.value.key == f"processing.{key}" and value not in str(e.value.allowed).split(";")[0]


def test_the_array_that_counts_is_the_virtual_one():
    """Two transmitters with a hole between their copies of the receivers leave no uniform line."""
    wave = {"bandwidth_mhz": 300, "chirp_us": 20, "chirps": 32, "samples": 64}
    for apart, fits in ((4 * 1.9, True), (5 * 1.9, False)):
        radar = {"elements_mm": LINE, "tx_elements_mm": [[0, 0, 0], [0, apart, 0]], "multiplexing": "tdm"}
        data = {"radar": radar | {"waveform": wave}, "processing": {"doa": "esprit"}}
        if fits:
            assert len(rc.Scene.from_dict(data).radar.virtual_elements) == 8
        else:
            with pytest.raises(SceneError, match="no uniform line"):
                rc.Scene.from_dict(data)


def test_a_receiver_elsewhere_moves_in_the_radars_table_too_and_may_not_run_into_a_body():
    body = rc.Body("box", shape="box", position=(4.0, 0.0, 0.0))
    radar = rc.Radar(rc.Waveform(F, 1e9, 30e-6), (0, 0, 0.5), rx_position=(0, 1, 0.5), rx_velocity=(4, -1, 0))
    scene = rc.Scene(bodies=[body], radar=radar)
    assert scene.at(0.5).radar_table.rx_position == scene.at(0.5).radar.rx_position.tolist() == [2.0, 0.5, 0.5]
    with pytest.raises(SceneError, match=r"radar\.rx_position: receiver is inside 'box' 1 s on"):
        scene.at(1.0)
