"""Parts of glTF files have names that tell them apart; what is damaged in a file is told by its name."""

from __future__ import annotations

import json
import struct

import pytest
import trimesh
from support.gltf import BOX, Gltf, refused

from raychan.world.body import Body
from raychan.world.errors import SceneError
from raychan.world.mesh_files.mesh_io import from_trimesh


def _parts(mesh):
    return {n: round(float(mesh.areas[mesh.part == i].sum()), 6) for i, n in enumerate(mesh.part_names)}


def _twice(g, *names):
    """Place the box twice, the second time twice as large, at nodes of two names, None for none."""
    g.node["scale"], other = [2.0] * 3, {"mesh": 0, "translation": [9.0, 0.0, 0.0]}
    for node, name in zip((g.node, other), names, strict=True):
        node.pop("name", None)
        node.update({"name": name} if name else {})
    g.tree["nodes"].append(other)
    g.tree["scenes"][0]["nodes"] = [0, 1]


def _painted(g, *paints):
    """Make the box of surfaces of 6 m2 (one side), and 16 m2, of two materials."""
    halves = (BOX.faces[BOX.face_normals[:, 0] > 0.5], BOX.faces[BOX.face_normals[:, 0] <= 0.5])
    g.tree["materials"] = [{"name": x} for x in paints if x]
    g.mesh["primitives"] = [
        {"attributes": g.primitive["attributes"], "indices": g.add(half.ravel(), "H", "SCALAR")}
        | ({"material": paints.index(paint)} if paint else {})
        for half, paint in zip(halves, paints, strict=True)
    ]


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_nodes_of_one_mesh_are_parts_of_their_names(ending, tmp_path):
    made = Gltf()
    _twice(made, "left", "right")
    assert _parts(made.read(tmp_path, ending)) == {"left": 88.0, "right": 22.0}
    body = Body("b", tmp_path / f"m.{ending}", materials={"left": "glass", "right": "metal"})
    assert dict(zip(body.geometry.part_names, body.part_materials(), strict=True)) == body.materials


def test_nodes_without_names_and_of_one_name_are_numbered(tmp_path):
    made = Gltf()
    _twice(made, None, None)
    assert _parts(made.read(tmp_path)) == {"box": 88.0, "box_1": 22.0}
    made = Gltf()
    _twice(made, "crate", "crate")
    assert sorted(_parts(made.read(tmp_path))) == ["crate", "crate_1"]


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_surfaces_of_several_materials_are_parts_of_their_names(ending, tmp_path):
    made = Gltf()
    _painted(made, "glass", "paint")
    assert _parts(made.read(tmp_path, ending)) == {"glass": 6.0, "paint": 16.0}
    _painted(made, "glass", None)
    assert _parts(made.read(tmp_path, ending)) == {"glass": 6.0, "box": 16.0}


def test_materials_of_one_mesh_at_two_nodes_have_both_names(tmp_path):
    made = Gltf()
    _painted(made, "glass", "paint")
    _twice(made, "left", "right")
    parts = _parts(made.read(tmp_path))
    assert parts == {"left.glass": 24.0, "left.paint": 64.0, "right.glass": 6.0, "right.paint": 16.0}


def no_scenes(g):
    g.tree["nodes"].append({"children": [0]})
    del g.tree["scenes"], g.tree["scene"]


def no_scene(g):
    g.tree["scenes"].append({"nodes": []})
    del g.tree["scene"]


@pytest.mark.parametrize("form", [no_scenes, no_scene])
@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_a_file_that_names_no_scene_is_shown_as_viewers_do(form, ending, tmp_path):
    made = Gltf()
    form(made)
    assert made.read(tmp_path, ending).volume() == pytest.approx(6.0)


def no_nodes(g):
    del g.tree["scenes"], g.tree["scene"], g.tree["nodes"]


def cycle(g):
    g.tree["nodes"].append({"children": [0]})
    g.node["children"] = [1]


def two_parents(g):
    g.tree["nodes"].append({"children": [0]})
    g.tree["scenes"][0]["nodes"] = [0, 1]


def put(where, key, value):
    def form(g):
        where(g)[key] = value

    return form


@pytest.mark.parametrize("ending", ["glb", "gltf"])
@pytest.mark.parametrize(
    ("form", "words"),
    [
        (no_nodes, "has meshes, but no scene and no node that places them; allowed: a file with a scene"),
        (cycle, "node 'crate' is below itself; allowed: nodes that are a tree"),
        (two_parents, "node 'crate' is a root of the scene or a child more than once"),
        (put(lambda g: g.tree, "scene", 3), "the file names scene 3, which is not there; allowed: 0 to 0"),
        (put(lambda g: g.tree["scenes"][0], "nodes", [0, 5]), "scene 0 names node 5, which is not there"),
        (put(lambda g: g.node, "mesh", 7), "node 'crate' names mesh 7, which is not there; allowed: 0 to 0"),
        (put(lambda g: g.node, "children", [-1]), "node 'crate' names node -1, which is not there"),
        (put(lambda g: g.primitive, "indices", 2), "mesh 'box' names accessor 2, which is not there; allowed: 0 to 1"),
        (put(lambda g: g.primitive, "material", 0), "mesh 'box' names material 0, which is not there"),
        (put(lambda g: g.tree["accessors"][0], "bufferView", 9), "accessor 0 names bufferView 9, which is not there"),
        (put(lambda g: g.tree["accessors"][0], "componentType", 5130), "accessor 0 has componentType 5130"),
        (put(lambda g: g.tree["accessors"][0], "count", 9), "accessor 0 of 9 rows is bytes 0 to 108 of bufferView 0"),
        (put(lambda g: g.tree["accessors"][1], "count", 35), "mesh 'box' has 35 corners of triangles (mode 4)"),
        (put(lambda g: g.tree["accessors"][0], "type", "VEC2"), "mesh 'box' has corners of type 'VEC2'"),
        (put(lambda g: g.tree["bufferViews"][1], "buffer", 1), "bufferView 1 names buffer 1, which is not there"),
        (put(lambda g: g.tree["bufferViews"][1], "byteOffset", 99), "bufferView 1 is bytes 99 to 171 of buffer 0"),
    ],
)
def test_what_is_damaged_is_told(form, words, ending, tmp_path):
    assert words in refused(form, tmp_path, ending)


def test_a_buffer_cut_short_is_told(tmp_path):
    made = Gltf()
    (tmp_path / "x.bin").write_bytes(made.data[:-40])
    with pytest.raises(SceneError, match=r"bufferView 1 is bytes 96 to 168 of buffer 0, which has 128"):
        made.read(tmp_path, "gltf", "x.bin")


@pytest.mark.parametrize("ending", ["glb", "gltf"])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.99])
def test_a_file_cut_short_is_told(share, ending, tmp_path):
    Gltf().read(tmp_path, ending)
    file = tmp_path / f"m.{ending}"
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    with pytest.raises(SceneError, match="is cut short"):
        Body("b", file).geometry  # noqa: B018


def test_headers_that_are_none_are_told(tmp_path):
    file = tmp_path / "m.gltf"
    file.write_text("[]")
    with pytest.raises(SceneError, match="its header is no table"):
        Body("b", file).geometry  # noqa: B018
    for header in ("[" * 100_000, '{"asset": 1' + "0" * 5000 + "}"):
        file.write_text(header)
        with pytest.raises(SceneError, match=r"m\.gltf: .*header"):
            Body("b", file).geometry  # noqa: B018
    text = json.dumps(Gltf().tree).encode()
    (tmp_path / "m.glb").write_bytes(struct.pack("<4sII", b"glTX", 2, 20) + text)
    with pytest.raises(SceneError, match="does not begin with glTF"):
        Body("b", tmp_path / "m.glb").geometry  # noqa: B018


def test_a_mark_of_byte_order_before_a_header_is_left_out(tmp_path):
    Gltf().read(tmp_path, "gltf")
    file = tmp_path / "m.gltf"
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    assert Body("b", file).geometry.volume() == pytest.approx(6.0)


def test_nodes_of_a_scene_of_trimesh_that_share_a_mesh_are_parts_of_their_names():
    scene = trimesh.Scene()
    scene.add_geometry(BOX, geom_name="box", node_name="left")
    scene.graph.update("right", matrix=trimesh.transformations.translation_matrix([9.0, 0.0, 0.0]), geometry="box")
    assert _parts(from_trimesh(scene)) == {"left": 22.0, "right": 22.0}
