"""Mesh files that are cut short or damaged are refused, or what was left out of them is told."""

from __future__ import annotations

import gzip
import subprocess
import sys

import pytest
import trimesh

from raychan.cli import invoke
from raychan.world.errors import SceneError
from raychan.world.mesh_files.mesh_io import load

PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 1 2 3
3 0 3 2
"""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (PLY[:-20], "is cut short: 6 lines after the header, 8 expected (vertex 4, face 4)"),
        (PLY[:-3], "is cut short: its last line lacks 1 of its numbers"),
        (PLY[:166], "is cut short: 2 lines after the header, 8 expected (vertex 4, face 4)"),
    ],
)
def test_a_ply_that_is_cut_short_is_refused(text, words, tmp_path):
    file = tmp_path / "cut.ply"
    file.write_text(PLY)
    assert len(load(file).faces) == 4
    file.write_text(text)
    with pytest.raises(SceneError) as told:
        load(file)
    assert words in str(told.value)


@pytest.mark.parametrize("end", range(20, 155, 15))
def test_a_ply_cut_in_its_header_is_said_to_be(end, tmp_path):
    file = tmp_path / "cut.ply"
    file.write_text(PLY[:end])
    with pytest.raises(SceneError, match="is cut short: its header has no 'end_header'"):
        load(file)


def _stl(folder, spare=b"", kind="stl"):
    file = folder / "ball.stl"
    trimesh.creation.icosphere(subdivisions=2, radius=0.2).export(file, file_type=kind)
    file.write_bytes(file.read_bytes() + spare)
    return file


def test_a_binary_stl_with_spare_bytes_is_told_what_is_wrong(tmp_path):
    assert len(load(_stl(tmp_path)).faces) == 320
    with pytest.raises(SceneError, match="does not end with its 320 triangles: 16086 bytes there, 16084 expected"):
        load(_stl(tmp_path, b"\0\0"))


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.999])
def test_an_stl_of_text_that_is_cut_anywhere_is_said_to_be(share, tmp_path):
    file = _stl(tmp_path, kind="stl_ascii")
    text = file.read_bytes()
    assert len(load(file).faces) == 320
    file.write_bytes(text[: int(share * len(text))])
    with pytest.raises(SceneError, match=r"is cut short: \d+ facets begin, and an 'end(facet|solid)' is missing"):
        load(file)


STL = """solid sheet
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
facet normal 0 0 1
outer loop
vertex 1 0 0
vertex 1 1 0
vertex 0 1 0
endloop
endfacet
endsolid sheet
"""


@pytest.mark.parametrize("normal", ["x 0 0", "0 0", "0 0 1 1", "-nan(ind) 0 0", ""])
def test_normals_that_cannot_be_read_are_left_out_and_told(normal, tmp_path, capsys):
    file = tmp_path / "sheet.stl"
    file.write_text(STL)
    assert load(file).report.unread_normals == 0
    file.write_text(STL.replace("normal 0 0 1", f"normal {normal}", 1))
    mesh = load(file)
    assert len(mesh.faces) == 2 and mesh.report.unread_normals == 1
    assert "1 of the file's normals are no three numbers and were left out" in " ".join(mesh.report.warnings())
    assert invoke(["info", str(file)]) == 0
    said = capsys.readouterr()
    assert "normals are no three numbers" in said.err
    assert "Traceback" not in said.err + said.out and "failed to extract" not in said.err + said.out


def test_nothing_that_the_reader_of_meshes_logs_is_printed(tmp_path):
    """In a process of its own: pytest takes what is logged."""
    file = tmp_path / "sheet.stl"
    file.write_text(STL.replace("normal 0 0 1", "normal x 0 0", 1))
    command = [sys.executable, "-m", "raychan", "info", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0 and "left out" in done.stderr
    assert "Traceback" not in done.stderr and "failed to extract" not in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("vertex 1 1 0", "vertex 1 1", "sheet.stl:12: 'vertex 1 1' is no vertex of three numbers"),
        ("vertex 1 1 0", "vertex 1 a 0", "sheet.stl:12: 'vertex 1 a 0' is no vertex of three numbers"),
        ("vertex 1 1 0\n", "", "is damaged: 5 vertices for 2 facets, 6 expected"),
        ("vertex 1 1 0", "vertex 1 NaN 0", "1 vertices hold NaN"),
    ],
)
def test_an_stl_of_text_with_a_damaged_vertex_is_refused(old, new, words, tmp_path):
    file = tmp_path / "sheet.stl"
    file.write_text(STL.replace(old, new))
    with pytest.raises(SceneError) as told:
        load(file)
    assert words in str(told.value)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("\nouter", " outer"),
        ("loop\n", "loop "),
        ("0\nvertex", "0 vertex"),
        ("solid sheet", "solid facet of a sheet, endfacet"),
        ("vertex 0 1 0", "  VERTEX +.0 1.e0 -0E+00 \r"),
        ("solid sheet\nfacet", "\ufeffsolid sheet\nfacet"),
        ("solid sheet\nfacet", "\n\n  solid sheet\nfacet"),
        ("solid sheet", "solid " + "long " * 500),
        ("solid sheet", "solid facet vertex 1 2 3 normal"),
        ("solid sheet", "solid Würfel"),
        ("\n", "\r"),
        ("\n", "\r\n"),
    ],
)
def test_an_stl_of_text_with_other_lines_and_names_is_read(old, new, tmp_path):
    file = tmp_path / "sheet.stl"
    file.write_bytes(STL.replace(old, new).encode())
    mesh = load(file)
    assert (len(mesh.faces), mesh.report.unread_normals) == (2, 0)


def test_each_solid_of_an_stl_of_text_is_a_part_of_its_name(tmp_path):
    file = tmp_path / "sheets.stl"
    others = [
        STL.replace(" sheet", name).replace(" 0\n", f" {i}\n") for i, name in enumerate([" Top deck", " vertex", ""])
    ]
    file.write_text("".join(others))
    mesh = load(file)
    assert mesh.part_names[:2] == ("Top deck", "vertex") and len(mesh.part_names) == 3
    for i in range(3):
        assert set(mesh.corners[mesh.part == i][..., 2].ravel()) == {float(i)}


@pytest.mark.parametrize("head", [b"solid", b"solid my facet file\nfacet", b"\xef\xbb\xbfsolid facet normal"])
def test_a_binary_stl_whose_head_begins_as_text_is_binary(head, tmp_path):
    file = _stl(tmp_path)
    file.write_bytes(head.ljust(80) + file.read_bytes()[80:])
    assert len(load(file).faces) == 320


def test_an_stl_of_text_on_one_line_is_said_to_be(tmp_path):
    file = tmp_path / "sheet.stl"
    file.write_text(STL.replace("\n", " "))
    with pytest.raises(SceneError, match=r"sheet\.stl: is all on one line"):
        load(file)


@pytest.mark.parametrize("face", ["f 1 2 0", "f 0 1 2", "f 1/1 0/1 2/1", "f 1//1 2//1 0//1", "f 1 2 -0 "])
def test_an_obj_with_a_face_of_vertex_0_is_refused(face, tmp_path):
    file = tmp_path / "z.obj"
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvn 0 0 1\n" + "v 5 5 5\n" * 6
    file.write_text(f"{corners}# f 1 2 0\nf 1 2 3\nf 10 1 2\n")
    assert len(load(file).faces) == 2
    file.write_text(f"{corners}f 1 2 3\n{face}\nf 1 2 4\n")
    with pytest.raises(SceneError, match=r"z\.obj:14: .* names vertex 0; allowed: vertices counted from 1"):
        load(file)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("element face 4", "element face 3", "does not end with its elements: 8 lines after the header, 7 expected"),
        ("element face 4", "element face -4", "holds -4 of 'face'; allowed: a number from 0 on"),
        ("property float z\n", "", "'z' is missing"),
    ],
)
def test_a_ply_with_other_counts_or_without_z_is_refused(old, new, problem, tmp_path):
    file = tmp_path / "m.ply"
    file.write_text(PLY.replace(old, new))
    with pytest.raises(SceneError, match=problem):
        load(file)


@pytest.mark.parametrize("ending", [".obj", ".ply", ".stl", ".glb", ".gltf"])
def test_a_packed_file_is_said_to_be(ending, tmp_path):
    (tmp_path / f"m{ending}").write_bytes(gzip.compress(b"v 0 0 0\n"))
    with pytest.raises(SceneError, match=rf"is packed by gzip; allowed: the {ending} file that is in it, unpacked"):
        load(tmp_path / f"m{ending}")
