"""Meshes: repair, winding, the normals of the true surface, files."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.world.errors import SceneError
from raychan.world.mesh_files.mesh_io import from_trimesh, load
from raychan.world.meshes.mesh import make_mesh, smooth_normals


def test_smoothed_normals_of_a_sphere_are_radial():
    mesh = from_trimesh(trimesh.creation.icosphere(subdivisions=4))
    assert np.abs(mesh.normals - mesh.corners).max() < 5e-3


def test_normals_of_a_cylinder_are_radial_on_its_side_and_axial_on_its_caps():
    mesh = from_trimesh(trimesh.creation.cylinder(radius=1.0, height=2.0, sections=64))
    normal, corner = mesh.normals.reshape(-1, 3), mesh.corners.reshape(-1, 3)
    side = np.abs(normal[:, 2]) < 0.5
    assert np.abs(normal[side, :2] - corner[side, :2]).max() < 0.03
    np.testing.assert_allclose(np.abs(normal[~side]), np.broadcast_to([0.0, 0.0, 1.0], (np.sum(~side), 3)), atol=1e-12)


def test_normals_of_a_box_are_its_faces():
    box = trimesh.creation.box()
    mesh = from_trimesh(box)
    c = mesh.corners
    face = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.normals, np.repeat(face[:, None], 3, axis=1), atol=1e-12)


def test_crease_angle_decides_what_is_smooth():
    roof = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, np.tan(np.radians(30.0))]], float)
    faces = np.array([[0, 1, 2], [1, 0, 3]])
    assert np.allclose(smooth_normals(roof, faces, 20.0)[0], [0, 0, 1])
    smooth = smooth_normals(roof, faces, 40.0)
    np.testing.assert_allclose(smooth[0, 0], smooth[1, 1], atol=1e-15)
    np.testing.assert_allclose(smooth[0, 2], [0, 0, 1], atol=1e-15)


def test_scrambled_winding_is_made_outward():
    sphere = trimesh.creation.icosphere(subdivisions=3)
    faces = sphere.faces.copy()
    wrong = np.random.default_rng(1).random(len(faces)) < 0.3
    faces[wrong] = faces[wrong][:, ::-1]
    mesh = make_mesh(sphere.vertices, faces)
    assert mesh.report.flipped == wrong.sum()
    assert mesh.volume() == pytest.approx(sphere.volume, rel=1e-12)
    assert mesh.report.watertight


def test_inside_out_bodies_are_turned_each_by_itself():
    good, bad = trimesh.creation.box(), trimesh.creation.box()
    bad.invert()
    both = trimesh.util.concatenate([good, bad.apply_translation([3, 0, 0])])
    mesh = make_mesh(both.vertices, both.faces)
    assert (mesh.volume(), mesh.report.flipped, mesh.report.bodies) == (pytest.approx(2.0), 12, 2)


def test_dead_faces_are_dropped_and_counted():
    box = trimesh.creation.box()
    faces = np.concatenate([box.faces, [[0, 0, 1], [0, 1, 1]], box.faces[:3], box.faces[:1, ::-1]])
    mesh = make_mesh(box.vertices, faces)
    assert (mesh.report.zero_area, mesh.report.duplicates, mesh.report.faces) == (2, 4, 12)
    said = " ".join(mesh.report.warnings())
    assert "2 faces of zero area" in said and "4 duplicate" in said


def test_triangle_soup_is_welded():
    box = trimesh.creation.box()
    soup = box.vertices[box.faces].reshape(-1, 3)
    mesh = make_mesh(soup, np.arange(len(soup)).reshape(-1, 3))
    assert mesh.report.vertices == 8 and mesh.report.watertight


def test_open_mesh_is_allowed_and_reported():
    box = trimesh.creation.box()
    mesh = make_mesh(box.vertices, box.faces[:-2])
    assert not mesh.report.watertight and mesh.report.open_edges == 4
    assert "not watertight" in mesh.report.warnings()[-1]


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int)),
        (np.zeros((3, 3)), [[0, 1, 2]]),
        ([[0, 0, 0], [1, 0, 0], [np.nan, 1, 0]], [[0, 1, 2]]),
        ([[0, 0, 0], [1, 0, 0], [np.inf, 1, 0]], [[0, 1, 2]]),
    ],
)
def test_empty_and_nan_meshes_are_errors(vertices, faces):
    with pytest.raises(SceneError, match=r"empty|NaN"):
        make_mesh(np.asarray(vertices, float), np.asarray(faces))


def test_winding_number_tells_inside_from_outside():
    mesh = from_trimesh(trimesh.creation.icosphere(subdivisions=2))
    assert mesh.winding(np.array([0.3, 0.2, 0.1])) == pytest.approx(1.0, abs=1e-12)
    assert mesh.winding(np.array([1.3, 0.2, 0.1])) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("suffix", ["glb", "obj", "ply", "stl"])
def test_all_formats_give_the_same_body(tmp_path, suffix):
    solid = trimesh.creation.box([1.0, 2.0, 3.0])
    file = tmp_path / f"box.{suffix}"
    solid.export(file)
    mesh = load(file, up="z")
    np.testing.assert_allclose(mesh.report.size, [1.0, 2.0, 3.0], rtol=1e-6)
    assert mesh.report.watertight and mesh.volume() == pytest.approx(6.0, rel=1e-6)


def test_units_and_axes(tmp_path):
    file = tmp_path / "arrow.ply"
    trimesh.creation.box([1.0, 2.0, 3.0]).apply_translation([10.0, 20.0, 30.0]).export(file)
    mesh = load(file, unit="cm", up="y", forward="z")
    np.testing.assert_allclose(mesh.bounds.mean(axis=0), [0.30, 0.10, 0.20], rtol=1e-6)
    back = load(file, up="z", forward="-x", scale=2.0)
    np.testing.assert_allclose(back.bounds.mean(axis=0), [-20.0, -40.0, 60.0], rtol=1e-6)


def test_glb_is_y_up_and_its_scene_graph_is_baked(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box(), geom_name="low")
    high = trimesh.transformations.translation_matrix([0.0, 5.0, 0.0])
    scene.add_geometry(trimesh.creation.box([0.5] * 3), geom_name="high", transform=high)
    file = tmp_path / "two.glb"
    scene.export(file)
    mesh = load(file)
    assert set(mesh.part_names) == {"low", "high"}
    top = mesh.corners[mesh.part == mesh.part_names.index("high")].reshape(-1, 3)
    np.testing.assert_allclose(top.mean(axis=0), [0.0, 0.0, 5.0], atol=1e-6)


def test_mirrored_nodes_of_a_scene_stay_outward(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box(), transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    assert from_trimesh(scene).volume() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"unit": "metre"}, "unit"),
        ({"up": "w"}, "up"),
        ({"up": "z", "forward": "z"}, "forward"),
        ({"scale": -1.0}, "scale"),
    ],
)
def test_bad_options_are_named(tmp_path, options, word):
    file = tmp_path / "box.ply"
    trimesh.creation.box().export(file)
    with pytest.raises(SceneError) as caught:
        load(file, **options)
    assert caught.value.key == word and caught.value.allowed


def test_missing_broken_and_unknown_files(tmp_path):
    with pytest.raises(SceneError, match="not found"):
        load(tmp_path / "none.ply")
    (tmp_path / "broken.ply").write_text("nonsense")
    with pytest.raises(SceneError, match="cannot be read"):
        load(tmp_path / "broken.ply")
    (tmp_path / "a.step").write_text("")
    with pytest.raises(SceneError, match="unknown mesh format"):
        load(tmp_path / "a.step")


@pytest.mark.parametrize(
    "solid",
    [
        trimesh.creation.icosphere(subdivisions=2, radius=0.3),
        trimesh.creation.cylinder(radius=0.2, height=0.5, sections=24),
        trimesh.creation.box(extents=(1, 2, 3)),
    ],
    ids=["sphere", "cylinder", "box"],
)
def test_a_mesh_cut_in_its_planes_is_the_same_body(solid):
    whole, cut = from_trimesh(solid), from_trimesh(solid.subdivide().subdivide())
    assert len(cut.faces) == len(whole.faces)
    assert cut.report.watertight
    assert cut.volume() == pytest.approx(solid.volume, rel=1e-9)


@pytest.mark.parametrize(
    "keys",
    [
        {"unit": "mm"},
        {"scale": 0.5},
        {"up": "y"},
        {"forward": "-y"},
        {"unit": "cm", "up": "x", "forward": "y", "scale": 2.0},
    ],
)
def test_a_trimesh_is_read_as_its_file_is(keys, tmp_path):
    box = trimesh.creation.box([10.0, 20.0, 30.0]).apply_translation([1.0, 2.0, 3.0])
    box.export(tmp_path / "box.ply")
    of_file = rc.Body(name="b", mesh=tmp_path / "box.ply", **keys).geometry
    for given in (box, trimesh.Scene(box)):
        mesh = rc.Body(name="b", mesh=given, **keys).geometry
        np.testing.assert_allclose(mesh.bounds, of_file.bounds, rtol=1e-6)
        assert mesh.volume() == pytest.approx(of_file.volume())


def test_a_trimesh_in_no_unit_is_refused():
    with pytest.raises(SceneError, match=r"b\.unit: unknown unit .mmm.; did you mean .mm."):
        _ = rc.Body(name="b", mesh=trimesh.creation.box(), unit="mmm").geometry
