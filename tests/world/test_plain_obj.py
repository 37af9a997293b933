"""OBJ files are read alike whether faces count vertices backwards or from the file's begin, with indents and tabs or
without; their parts have the names of the file."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.world.mesh_io import load

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
    with pytest.raises(rc.SceneError, match=r"m\.obj: 'f -1 -2 -3' names v -3, but 2 'v' lines before it"):
        load(tmp_path / "m.obj")


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
