"""OBJ files are read alike whether faces count vertices backwards or from the file's begin, with indents and tabs or
without; their parts have the names of the file."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.world.mesh_files.mesh_io import load

_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def _obj(backwards: bool, normals: bool, odd: bool) -> str:
    """Return three squares above each other, quads but for the last, two objects, each face after its vertices; odd: as
    few writers indent and divide lines."""
    lines = ["mtllib none.mtl"]
    for i in range(3):
        if i != 1:
            lines += [f"o square_{i}", f"usemtl paint_{i}"]
        lines += [f"{'  ' * odd}v {x} {y} {0.5 * i}" for x, y in _SQUARE] + ["vn 0 0 1"] * normals
        first = -4 if backwards else 4 * i + 1
        normal = f"//{-1 if backwards else i + 1}" if normals else ""
        corners = [f"{first + k}{normal}" for k in range(4)]
        if i < 2:
            lines.append(f"f{chr(9) if odd else ' '}" + " ".join(corners) + "  # -1 is the newest" * backwards)
        else:
            lines.append(f"f {corners[0]} {corners[1]} " + "\\\n  " * odd + corners[2])
            lines.append("\t" * odd + f"f {corners[0]} {corners[2]} {corners[3]}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("backwards", "normals", "odd"), [(b, n, o) for b in (0, 1) for n in (0, 1) for o in (0, 1)])
def test_faces_and_parts_of_an_obj(tmp_path, backwards, normals, odd):
    (tmp_path / "m.obj").write_text(_obj(bool(backwards), bool(normals), bool(odd)))
    mesh = load(tmp_path / "m.obj")
    assert mesh.part_names == ("square_0", "square_2") or mesh.part_names == ("square_2", "square_0")
    for i, height in (("square_0", (0.0, 0.5)), ("square_2", (1.0,))):
        corners = mesh.vertices[mesh.faces[mesh.part == mesh.part_names.index(i)]]
        assert sorted(set(corners[..., 2].ravel().tolist())) == list(height)
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        assert area.sum() == pytest.approx(len(height))


def test_parts_of_an_obj_with_materials_have_their_names(tmp_path):
    (tmp_path / "none.mtl").write_text("newmtl paint_0\nKd 1 0 0\nnewmtl paint_2\nKd 0 1 0\n")
    for odd in (False, True):
        (tmp_path / "m.obj").write_text(_obj(False, False, odd))
        assert sorted(load(tmp_path / "m.obj").part_names) == ["paint_0", "paint_2"]


def test_a_vertex_before_the_first(tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n")
    with pytest.raises(rc.SceneError, match=r"m\.obj:3: 'f -1 -2 -3' names v -3, but 2 'v' lines before it"):
        load(tmp_path / "m.obj")


_FOUR = "".join(f"v {x} {y} 0\n" for x, y in _SQUARE)
_PAINTED = f"{_FOUR}usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n"
_OBJECTS = f"{_FOUR}usemtl red\no left\nf 1 2 3\no right\nusemtl red\nf 1 3 4\n"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("mtllib a.mtl\n" + _PAINTED, {"red", "blue"}),
        ("mtllib none.mtl a.mtl\n" + _PAINTED, {"red", "blue"}),
        ("mtllib a.mtl b.mtl\n" + _PAINTED, {"red", "blue"}),
        ("mtllib two words.mtl\n" + _PAINTED, {"red", "blue"}),
        ("mtllib none.mtl\nmtllib a.mtl\n" + _PAINTED, {"red", "blue"}),
        ("mtllib\ta.mtl\n" + _PAINTED, {"red", "blue"}),
        ("mtllib a.mtl\n" + _PAINTED.replace("usemtl ", "usemtl\t"), {"red", "blue"}),
        ("mtllib a.mtl\n" + _PAINTED.replace("usemtl ", "  usemtl  "), {"red", "blue"}),
        ("mtllib a.mtl\no left\n" + _PAINTED, {"red", "blue"}),
        (_PAINTED, {"body"}),
        ("# mtllib a.mtl\n" + _PAINTED, {"body"}),
        ("mtllib none.mtl\n" + _PAINTED, {"body"}),
        ("mtllib a.mtl\n" + _OBJECTS, {"left", "right"}),
        (_OBJECTS, {"left", "right"}),
        (_OBJECTS.replace("o ", "o\t"), {"left", "right"}),
        (f"{_FOUR}usemtl red\nf 1 2 3\n# usemtl blue\nf 1 3 4\n", {"body"}),
    ],
)
def test_parts_are_the_materials_of_a_library_that_is_there_else_the_objects(tmp_path, text, names):
    for name in ("a.mtl", "two words.mtl"):
        (tmp_path / name).write_text("newmtl red\nKd 1 0 0\n")
    (tmp_path / "m.obj").write_text(text)
    mesh = load(tmp_path / "m.obj")
    assert set(mesh.part_names) == names and len(mesh.part_names) == len(names)
    assert mesh.areas.sum() == pytest.approx(1.0)
    first = mesh.part_names[int(mesh.part[np.argmin(mesh.corners[..., 1].sum(axis=1))])]
    assert first in ("red", "left", "body")


@pytest.mark.parametrize(
    ("before", "names"),
    [
        ("o left\n", {"left", "red", "blue"}),
        ("g left\n", {"left", "red", "blue"}),
        ("o left\ng wheel\n", {"left", "red", "blue"}),
        ("g wheel\no\tleft\n", {"left", "red", "blue"}),
        ("o none\no left\n", {"left", "red", "blue"}),
        ("", {"m.obj", "red", "blue"}),
        ("o near\nf 1 2 4\no far\n", {"near", "far", "red", "blue"}),
    ],
)
def test_faces_before_the_first_material_have_the_name_of_their_object_or_group(tmp_path, before, names):
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\n")
    painted = "usemtl red\nf 1 2 3\no x\nusemtl blue\nf 1 3 4\no y\nf 1 2 4\n"
    (tmp_path / "m.obj").write_text(f"mtllib a.mtl\n{_FOUR}{before}f 2 3 4\n{painted}")
    assert set(load(tmp_path / "m.obj").part_names) == names


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("v 1 2", "'v 1 2' is no vertex of three numbers; allowed: 'v' and three numbers"),
        ("v 1 x 2", "'v 1 x 2' is no vertex of three numbers"),
        ("v 1,0 2,0 3,0", "'v 1,0 2,0 3,0' is no vertex of three numbers"),
        ("v", "'v' is no vertex of three numbers"),
        ("vn 0 0 up", "'vn 0 0 up' is no normal of numbers"),
        ("vt left", "'vt left' is no texture of numbers"),
        ("f 1 2 3.5", "'f 1 2 3.5' is no face of numbered vertices"),
        ("f 1 2 x", "'f 1 2 x' is no face of numbered vertices"),
        ("f 1 2 99999999999999999999", "is no face of numbered vertices"),
        ("f1 2 3", "'f1 2 3' is no face of numbered vertices"),
        ("f-1 -2 -3", "'f-1 -2 -3' is no face of numbered vertices"),
        ("f1/1 2/2 3/3", "'f1/1 2/2 3/3' is no face of numbered vertices"),
        ("fo 1 2 3", "'fo 1 2 3' is no face of numbered vertices"),
        ("f", "'f' is no face of numbered vertices"),
        ("f 1 2 99", "'f 1 2 99' names vertex 99, which the file does not hold; allowed: 1 to 4"),
        ("f 1 2 -9", "'f 1 2 -9' names v -9, but 4 'v' lines before it"),
        (" surf 0 1 0 1 1 2 3 4", "'surf 0 1 0 1 1 2 3 4' is a free-form surface, which is not read"),
        ("bzp 1 2 3 4", "'bzp 1 2 3 4' is a free-form surface, which is not read"),
        ("call other.obj", "'call other.obj' calls another file, which is not read"),
    ],
)
@pytest.mark.parametrize("before", ["", "# one\n", "  # one\nvn 0 \\\n 0 1\n", "# C:\\\n"])
def test_a_line_that_is_no_vertex_or_face_is_refused_by_its_number(tmp_path, line, words, before):
    (tmp_path / "m.obj").write_text(f"{before}{_FOUR}f 1 2 3\n{line}\nf 1 3 4\n")
    with pytest.raises(rc.SceneError) as told:
        load(tmp_path / "m.obj")
    assert f"m.obj:{before.count(chr(10)) + 6}: " in str(told.value) and words in str(told.value)


@pytest.mark.parametrize("more", ["", "vn 0 0 1 1\nvt 0 0 0\n"])
@pytest.mark.parametrize("nan", ["nan", "-nan", "-nan(ind)", "nan(snan)", "-NaN(IND)", "nan()"])
@pytest.mark.parametrize("corner", ["{0}/1/1", "{0}//2", "{0}/2", "{0}"])
def test_normals_and_textures_that_are_no_numbers_change_nothing(tmp_path, corner, nan, more):
    face = " ".join(corner.format(i) for i in (1, 2, 3, 4))
    lines = f"vn {nan} {nan} {nan}\nvn 0 0 1\nvt {nan} 0\nvt 0 0\n{more}f {face}\n"
    (tmp_path / "m.obj").write_text(_FOUR + lines)
    assert load(tmp_path / "m.obj").areas.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("nan", ["nan", "-nan(ind)"])
def test_vertices_of_faces_that_are_no_numbers_are_refused(tmp_path, nan):
    (tmp_path / "m.obj").write_text(_FOUR + f"v {nan} 0 0\nf 1 2 5\n")
    with pytest.raises(rc.SceneError, match="1 vertices hold NaN or infinity"):
        load(tmp_path / "m.obj")


_JUNK = ["free form", "foo 1 2 3", "fx", "f2", "From 1 to 2", "V for value", "VN x", "vertex 1", "fo", "f1 of 2"]


@pytest.mark.parametrize("line", _JUNK)
@pytest.mark.parametrize("before", ["", "  ", "# one\n\t"])
def test_lines_that_begin_with_no_keyword_are_ignored(tmp_path, line, before):
    (tmp_path / "m.obj").write_text(f"{_FOUR}f 1 2 3\n{before}{line}\nf 1 3 4\n{line}")
    mesh = load(tmp_path / "m.obj")
    assert len(mesh.faces) == 2 and mesh.areas.sum() == pytest.approx(1.0)


def test_tabs_between_numbers_are_blanks(tmp_path):
    (tmp_path / "m.obj").write_text(_FOUR.replace("1 1 0", "1\t1\t 0") + "f 1 2\t3 4\nvn 0 0\t1\n")
    assert load(tmp_path / "m.obj").areas.sum() == pytest.approx(1.0)


def test_vertices_of_other_lengths_keep_their_places(tmp_path):
    corners = "v 0 0 0 1\nv 1 0 0\nv 1 1 0\nv 0 1 0 0.5 0.5 0.5\n"  # as many numbers as four each
    (tmp_path / "m.obj").write_text(corners + "f 1 2 3 4\n")
    mesh = load(tmp_path / "m.obj")
    assert mesh.areas.sum() == pytest.approx(1.0) and mesh.bounds.tolist() == [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]


_L = [(2, 1), (1, 1), (1, 2), (0, 2), (0, 0), (2, 0)]  # an L of area 3


@pytest.mark.parametrize("ending", ["obj", "ply"])
@pytest.mark.parametrize(("first", "folds"), [(0, True), (1, False)])
def test_faces_that_a_fan_of_triangles_does_not_fit_are_told(tmp_path, ending, first, folds):
    corners, file = _L[first:] + _L[:first], tmp_path / f"m.{ending}"
    if ending == "obj":
        file.write_text("".join(f"v {x} {y} 0\n" for x, y in corners) + "f 1 2 3 4 5 6\n")
    else:
        head = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
        head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        file.write_text(head + "".join(f"{x} {y} 0\n" for x, y in corners) + "6 0 1 2 3 4 5\n")
    told = [line for line in load(file).report.warnings() if "not convex" in line]
    assert bool(told) == folds


@pytest.mark.parametrize(
    "lines",
    [
        "  f 1 2 3 4 5 6\n",
        "f\t1 2 3 4 5 6\n",
        "f +1 +2 +3 +4 +5 +6\n",
        "f 1 2 3 \\\n4 5 6\n",
        "f 1 2 3\\\r\n4 5 6\r\n",
        "f 1 2 3 \\\n  4 5 6\n",
        "# a comment\rf 1 2 3 4 5 6\r",
        "f 1// 2// 3// 4// 5// 6//\n",
    ],
)
def test_faces_that_are_not_convex_are_told_however_their_lines_are_written(tmp_path, lines):
    corners = "".join(f"v {x} {y} 0\n" for x, y in _L)
    (tmp_path / "m.obj").write_bytes((corners.replace("\n", "\r") if lines.endswith("6\r") else corners).encode())
    with (tmp_path / "m.obj").open("ab") as file:
        file.write(lines.encode())
    mesh = load(tmp_path / "m.obj")
    assert len(mesh.faces) == 4 and any("not convex" in line for line in mesh.report.warnings())


@pytest.mark.parametrize(
    ("old", "new"), [("f 1 2 3", "f 1 2 3 # the first"), ("v 0 0 0", "v 0 0 0 # origin"), ("", "\ufeff")]
)
def test_comments_and_a_mark_of_byte_order_in_an_obj(tmp_path, old, new):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "m.obj").write_text(text.replace(old, new, 1), encoding="utf-8")
    assert load(tmp_path / "m.obj").bounds[1].tolist() == [1.0, 1.0, 0.0]
