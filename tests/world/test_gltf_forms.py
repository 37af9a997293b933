"""A glTF file is read as the body that it describes, or refused by the name of what is not read."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.gltf import BOX, Gltf, refused

from raychan.world.errors import SceneError


def fans(g):
    g.primitive["mode"] = 6


def sparse_corners(g):
    g.tree["accessors"][0]["sparse"] = {"count": 1}


def sparse_indices(g):
    g.tree["accessors"][1]["sparse"] = {"count": 1}


def normalised(g):
    g.primitive["attributes"]["POSITION"] = g.add(BOX.vertices / 1.5 * 127, "b", "VEC3", normalized=True)
    g.node["scale"] = [1.5] * 3
    g.tree["extensionsRequired"] = ["KHR_mesh_quantization"]


def instances(g):
    places = g.add([[0, 0, 0], [9, 0, 0]], "f", "VEC3")
    g.node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}


def morphed(g):
    g.primitive["targets"], g.mesh["weights"] = [{"POSITION": 0}], [1.0]


def morphed_at_the_node(g):
    g.primitive["targets"], g.node["weights"] = [{"POSITION": 0}], [0.5]


def hidden(g):
    g.node["extensions"] = {"KHR_node_visibility": {"visible": False}}


def camera(g):
    g.node["camera"] = 0


def mesh_below_a_camera(g):
    g.tree["nodes"] += [{"camera": 0, "children": [2], "name": "crate"}, {"children": [0]}]
    g.node["name"], g.tree["scenes"] = "box", [{"nodes": [1]}]


def unknown(g):
    g.tree["extensionsRequired"] = ["EXT_meshopt_compression"]


def draco(g):
    g.primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    del g.tree["accessors"][0]["bufferView"]
    g.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]


@pytest.mark.parametrize("ending", ["glb", "gltf"])
@pytest.mark.parametrize(
    ("form", "words"),
    [
        (fans, "mesh 'box' has triangle fans (mode 6), which are not read; allowed: triangles (mode 4)"),
        (sparse_corners, "mesh 'box' has corners of a sparse accessor"),
        (sparse_indices, "mesh 'box' has indices of a sparse accessor"),
        (normalised, "mesh 'box' has normalised integers as corners (KHR_mesh_quantization)"),
        (instances, "node 'crate' repeats its mesh by EXT_mesh_gpu_instancing"),
        (morphed, "mesh 'box' has morph targets of weights other than 0"),
        (morphed_at_the_node, "mesh 'box' has morph targets of weights other than 0"),
        (hidden, "node 'crate' is hidden by KHR_node_visibility"),
        (camera, "node 'crate' is a camera with a mesh or children"),
        (mesh_below_a_camera, "node 'crate' is a camera with a mesh or children"),
        (unknown, "needs the glTF extension 'EXT_meshopt_compression', which is not read"),
        (draco, "mesh 'box' is compressed by Draco"),
    ],
)
def test_a_form_that_would_be_another_body_is_refused_by_name(form, words, ending, tmp_path, monkeypatch):
    monkeypatch.setattr("raychan.world.mesh_files.gltf_forms.find_spec", lambda name: None)
    assert words in refused(form, tmp_path, ending)


def quantised(g):
    g.primitive["attributes"]["POSITION"] = g.add(BOX.vertices * 100, "h", "VEC3")
    g.node["scale"] = [0.01] * 3
    g.tree["extensionsRequired"] = ["KHR_mesh_quantization"]


def looks(g):
    g.tree["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform"]


def morphs_of_weight_0(g):
    g.primitive["targets"], g.mesh["weights"] = [{"POSITION": 0}], [0.0]


def fans_out_of_the_scene(g):
    g.tree["meshes"].append({"primitives": [g.primitive | {"mode": 6}]})
    g.tree["nodes"].append({"mesh": 1})


def light_below_a_camera(g):
    g.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    g.tree["nodes"] += [{"camera": 0, "children": [2]}, {"name": "light", "children": [3]}, {"name": "empty"}]
    g.tree["scenes"] = [{"nodes": [0, 1]}]


READ = [lambda g: None, quantised, looks, morphs_of_weight_0, fans_out_of_the_scene, light_below_a_camera]


@pytest.mark.parametrize("form", READ)
def test_a_form_that_is_read_right_is_read(form, tmp_path):
    made = Gltf()
    form(made)
    mesh = made.read(tmp_path)
    assert mesh.areas.sum() == pytest.approx(22.0) and mesh.volume() == pytest.approx(6.0)


def _rigged(g, bind, pose):
    """Hang the box on a joint under a turned and shifted node; bind is its place as drawn, pose its place now."""
    turned = {"rotation": [0.0, 0.0, 0.6, 0.8], "translation": [1.0, 2.0, 3.0], "scale": [2.0] * 3, "children": [2]}
    g.tree["nodes"] += [turned, {"translation": pose}]
    above = trimesh.transformations.quaternion_matrix([0.8, 0.0, 0.0, 0.6]) * [2.0, 2.0, 2.0, 1.0]
    above[:3, 3] = turned["translation"]
    inverse = np.linalg.inv(above @ trimesh.transformations.translation_matrix(bind))
    g.primitive["attributes"] |= {
        "JOINTS_0": g.add(np.zeros((8, 4)), "B", "VEC4"),
        "WEIGHTS_0": g.add(np.tile([1.0, 0, 0, 0], (8, 1)), "f", "VEC4"),
    }
    g.tree["skins"] = [{"joints": [2], "inverseBindMatrices": g.add(inverse.T.reshape(1, 16), "f", "MAT4")}]
    g.node["skin"], g.tree["scenes"][0]["nodes"] = 0, [0, 1]


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_a_skin_is_read_in_the_pose_in_which_its_mesh_was_drawn_only(ending, tmp_path):
    rest = Gltf()
    _rigged(rest, [0.3, 0.2, 0.1], [0.3, 0.2, 0.1])
    assert rest.read(tmp_path, ending).volume() == pytest.approx(6.0)
    bent = Gltf()
    _rigged(bent, [0.3, 0.2, 0.1], [0.3, 0.2, 0.2])
    with pytest.raises(SceneError, match="mesh 'box' has a skin in another pose than its mesh was drawn in"):
        bent.read(tmp_path, ending)


@pytest.mark.parametrize(
    ("uri", "there"),
    [("x.bin", "x.bin"), ("./sub/x.bin", "sub/x.bin"), ("a%20b.bin", "a b.bin"), ("a%20b.bin", "a%20b.bin"),
     ("sub/%C3%A4.bin", "sub/\u00e4.bin"), ("gone/x.bin", "x.bin")],
)  # fmt: skip
def test_a_skin_and_its_mesh_are_read_from_a_buffer_in_a_folder_or_of_an_encoded_name(uri, there, tmp_path):
    (tmp_path / "sub").mkdir()
    for pose in (0.1, 0.2):
        made = Gltf()
        _rigged(made, [0.3, 0.2, 0.1], [0.3, 0.2, pose])
        (tmp_path / there).write_bytes(made.data)
        if pose == 0.1:
            assert made.read(tmp_path, "gltf", uri).volume() == pytest.approx(6.0)
        else:
            with pytest.raises(SceneError, match="has a skin in another pose"):
                made.read(tmp_path, "gltf", uri)


@pytest.mark.parametrize("uri", ["x.bin", "../x.bin"])
def test_a_skin_whose_buffer_is_not_there_is_not_said_to_be_in_another_pose(uri, tmp_path):
    made = Gltf()
    _rigged(made, [0.3, 0.2, 0.1], [0.3, 0.2, 0.1])
    with pytest.raises(SceneError, match=r"m\.gltf: cannot be read as a mesh \(.*x\.bin"):
        made.read(tmp_path, "gltf", uri)


def test_a_skin_that_cannot_be_followed_is_refused(tmp_path):
    lost = Gltf()
    _rigged(lost, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    lost.tree["scenes"][0]["nodes"] = [0]
    with pytest.raises(SceneError, match="has a skin in another pose"):
        lost.read(tmp_path)
