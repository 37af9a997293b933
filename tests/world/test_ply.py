"""A PLY is read as the body that it describes, whatever the sizes of its faces and the properties beside them; one that
is damaged is refused by its row."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

from raychan.world.errors import SceneError
from raychan.world.mesh_files.mesh_io import load

# A cube of edge 1 without a corner of legs of 1/2.
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
CORNERS += [(1, 1, 0.5), (1, 0.5, 1), (0.5, 1, 1)]
FACES = [(0, 1, 5, 4), (0, 4, 6, 3), (0, 3, 2), (0, 2, 1), (1, 2, 7, 8, 5), (2, 3, 6, 9, 7), (4, 5, 8, 9, 6), (7, 9, 8)]
AREA, VOLUME = 6.0 - 3.0 / 8.0 + np.sqrt(3.0) / 8.0, 1.0 - 1.0 / 48.0
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
KINDS = {"uchar": "B", "char": "b", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
TEXTURE = ("texcoord", "uchar", "float")


def ply(form, faces=FACES, count="uchar", index="int", before=(), after=(), end="\n"):
    """Return a PLY; before and after: properties of faces beside their corners, a list being (name, count, kind)."""
    vertex = "".join(f"property float {x}{end}" for x in "xyz")
    parts = [*before, ("vertex_indices", count, index), *after]
    face = "".join(f"property {f'list {p[1]} {p[2]}' if len(p) == 3 else p[1]} {p[0]}{end}" for p in parts)
    head = f"ply{end}format {form} 1.0{end}comment element face 3{end}element vertex {len(CORNERS)}{end}{vertex}"
    head += f"element face {len(faces)}{end}{face}element edge 1{end}property int v{end}end_header{end}"
    rows = [[("float", x) for x in corner] for corner in CORNERS]
    for corners in faces:
        row = []
        for part in parts:
            values = corners if part[0] == "vertex_indices" else [3] * (2 * len(corners) if len(part) == 3 else 1)
            row += [(part[1], len(values))] * (len(part) == 3) + [(part[-1], x) for x in values]
        rows.append(row)
    return head.encode() + b"".join(_row(form, row, end) for row in [*rows, [("int", 7)]])


def _row(form, row, end):
    if form == "ascii":
        return (" ".join(f"{x:g}" for _, x in row) + end).encode()
    return b"".join(struct.pack(FORMATS[form] + KINDS[kind], x) for kind, x in row)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("first", [0, 2, 4])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"index": "uchar"},
        {"count": "int", "index": "uint"},
        {"count": "char", "index": "ushort"},
        {"after": [("red", "uchar"), ("flags", "int")]},
        {"before": [("quality", "float")]},
        {"after": [TEXTURE]},
        {"before": [TEXTURE], "after": [("red", "uchar")]},
        {"end": "\r\n"},
    ],
)
def test_faces_of_several_sizes_close_the_body(form, first, options, tmp_path):
    (tmp_path / "m.ply").write_bytes(ply(form, [FACES[first], *FACES[:first], *FACES[first + 1 :]], **options))
    mesh = load(tmp_path / "m.ply")
    assert mesh.report.watertight and mesh.report.warnings() == []
    assert mesh.areas.sum() == pytest.approx(AREA) and mesh.volume() == pytest.approx(VOLUME)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("where", ["element vertex", "element face 8", "element edge", "end_header"])
def test_an_element_without_rows_changes_nothing(form, where, tmp_path):
    empty = b"element tristrips 0\nproperty list int int i\nproperty float x\n"
    (tmp_path / "m.ply").write_bytes(ply(form).replace(where.encode(), empty + where.encode(), 1))
    assert load(tmp_path / "m.ply").volume() == pytest.approx(VOLUME)


@pytest.mark.parametrize("form", FORMATS)
def test_a_mark_of_byte_order_before_a_ply_changes_nothing(form, tmp_path):
    (tmp_path / "m.ply").write_bytes(b"\xef\xbb\xbf" + ply(form))
    assert load(tmp_path / "m.ply").volume() == pytest.approx(VOLUME)


def test_numbers_with_a_plus_are_read(tmp_path):
    text = ply("ascii").decode().replace("\n4 0 1 5 4\n", "\n+4 +0 +1 5 +4e0\n").replace("vertex 10", "vertex +10")
    (tmp_path / "m.ply").write_text(text)
    assert load(tmp_path / "m.ply").volume() == pytest.approx(VOLUME)


@pytest.mark.parametrize("form", ["binary", "ascii"])
def test_a_mesh_that_was_written_is_read_again(form, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3)
    (tmp_path / "m.ply").write_bytes(ball.export(file_type="ply", encoding=form))
    mesh = load(tmp_path / "m.ply")
    assert len(mesh.faces) == len(ball.faces) and mesh.volume() == pytest.approx(ball.volume, rel=1e-6)


@pytest.mark.parametrize("form", list(FORMATS)[1:])
def test_a_binary_ply_cut_anywhere_in_its_data_is_said_to_be_cut(form, tmp_path):
    whole, file = ply(form), tmp_path / "m.ply"
    for end in range(whole.index(b"end_header") + 11, len(whole) - 4, 7):
        file.write_bytes(whole[:end])
        with pytest.raises(SceneError, match=r"is cut short or damaged: \d+ bytes after the header end within"):
            load(file)


def test_a_binary_ply_with_bytes_at_its_end_is_refused(tmp_path):
    (tmp_path / "m.ply").write_bytes(ply("binary_little_endian") + b"12")
    with pytest.raises(SceneError, match="does not end with its elements"):
        load(tmp_path / "m.ply")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("\n4 0 1 5 4\n", "\n4 0 1 5\n", "m.ply:23: '4 0 1 5', row 1 of 'face', lacks 1 of its numbers"),
        ("\n4 0 1 5 4\n", "\n4 0 1 5 4 6\n", "m.ply:23: '4 0 1 5 4 6', row 1 of 'face', has 1 numbers too many"),
        ("\n4 0 1 5 4\n", "\n4 0 0.6 5 4\n", "m.ply:23: face 1 names vertex 0.6, which the file does not hold"),
        ("\n4 0 1 5 4\n", "\n4 0 10 5 4\n", "m.ply:23: face 1 names vertex 10, which the file does not hold"),
        ("\n4 0 1 5 4\n", "\n4 0 -1 5 4\n", "m.ply:23: face 1 names vertex -1"),
        ("\n4 0 1 5 4\n", "\n4 0 x 5 4\n", "m.ply:23: 'x' is no number"),
        ("\n4 0 1 5 4\n", "\n-4 0 1 5 4\n", "m.ply:23: '-4 0 1 5 4' has a list of '-4' entries"),
        ("\n1 1 0\n", "\n1 1 0 9\n", "m.ply:15: '1 1 0 9', row 3 of 'vertex', has 1 numbers too many"),
        ("\n1 1 0\n", "\n1 1\n", "m.ply:15: '1 1', row 3 of 'vertex', lacks 1 of its numbers"),
        ("\n1 1 0\n", "\n1 1,0 0\n", "m.ply:15: '1,0' is no number"),
        ("\n1 1 0\n", "\n1 1_0 0\n", "m.ply:15: '1_0' is no number"),
        ("\n4 0 1 5 4\n", "\n4 0 0_1 5 4\n", "m.ply:23: '0_1' is no number"),
        ("\n4 0 1 5 4\n", "\n4_0 0 1 5 4\n", "m.ply:23: '4_0 0 1 5 4' has a list of '4_0' entries"),
        ("\n4 0 1 5 4\n", "\n" + "4" * 5000 + " 0 1 5 4\n", "allowed: a number from 0 on, of 18 digits at most"),
        ("element vertex 10", "element vertex -1", "m.ply:4: holds -1 of 'vertex'; allowed: a number from 0 on"),
        ("element vertex 10", "element vertex " + "1" * 5000, "m.ply:4: holds '1111"),
        ("float z", "float128 z", "m.ply:7: unknown type 'float128'; did you mean 'float32'?"),
        ("format ascii 1.0\n", "", "its header has no 'format'"),
        ("element edge 1", "element face 1", "m.ply:10: 'element face 1' is no element"),
        ("element face 8\nproperty list uchar int vertex_indices", "element tristrips 8\nproperty list uchar int i",
         "holds triangle strips ('tristrips'), which are not read"),
    ],
)  # fmt: skip
def test_a_damaged_line_of_a_ply_is_refused_by_its_number(old, new, problem, tmp_path):
    text = ply("ascii").decode()
    assert old in text
    (tmp_path / "m.ply").write_text(text.replace(old, new, 1))
    with pytest.raises(SceneError) as told:
        load(tmp_path / "m.ply")
    assert problem in str(told.value) and len(str(told.value).replace(str(tmp_path), "")) < 300


def test_faces_without_area_are_told(tmp_path):
    (tmp_path / "m.ply").write_bytes(ply("binary_little_endian", [*FACES, (0, 1), (2,), ()]))
    mesh = load(tmp_path / "m.ply")
    assert mesh.volume() == pytest.approx(VOLUME) and mesh.report.zero_area == 2
