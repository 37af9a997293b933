"""What the commands say of options and names that cannot be, before anything is computed."""

from __future__ import annotations

import pytest
import trimesh
from support.scene_texts import PLATE

from raychan.cli import invoke


def told(argv, capsys):
    """Return what a command that fails prints to standard error, in one line."""
    assert invoke(argv) == 2
    said = capsys.readouterr()
    assert said.out == ""
    return " ".join(said.err.split())


@pytest.mark.parametrize(
    "command",
    [
        ["run", "three_reflectors"], ["spectrogram", "walker_and_cyclist"], ["hil", "--duration", "1"], ["ship"],
        ["validate"], ["study", "tradeoff"], ["study", "stability"], ["study", "sensitivity", "urban"],
    ],
    ids=lambda words: words[-1],
)  # fmt: skip
def test_a_file_in_the_place_of_a_directory_is_told_before_the_start(command, tmp_path, capsys):
    (tmp_path / "a").write_text("mine")
    assert "a: is a file; name a directory" in told([*command, "--out", str(tmp_path / "a")], capsys)
    said = told([*command, "--out", str(tmp_path / "a" / "sub")], capsys)
    assert "a: is a file;" in said and "sub cannot be made in it; name a directory" in said


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["run", "urban", "--seed", "1e3"], "'--seed': '1e3': a whole number is wanted; must lie between 0 and 9,2"),
        (["run", "urban", "--max-bounces", "2.5"], "'2.5': a whole number is wanted; must lie between 1 and 12"),
        (["run", "urban", "--tolerance", "abc"], "'abc': a number is wanted; must lie between 0.001 and 40 dB"),
        (["run", "urban", "--threads", "q"], "'q': a whole number is wanted, 1 to "),
        (["explain", "x", "--detection", "1.5"], "'--detection': '1.5': a whole number is wanted"),
        (["ship", "urban", "--out", "o"], "radar: is a scene of a radar, not of a ship; allowed: raychan run"),
        (["hil", "urban"], "radar: is a scene of a radar, not of a ship; allowed: raychan run"),
        (["explain", "x", "--paths", "-1"], "'--paths': -1: must lie between 0 and 1e+06"),
        (["explain", "x", "--paths", "a"], "'--paths': 'a': a whole number is wanted; must lie between 0 and"),
        (["hil", "--scanner", " "], "--scanner: the name is empty: name a serial port, or leave the option out"),
        (["hil", "--origin", "91,0"], "--origin: '91,0': latitude is 91.0 deg; allowed: -89.9 to 89.9"),
        (["hil", "--origin", "5"], "--origin: '5': two numbers, latitude and longitude in degrees, as 54.0,8.0"),
        (
            ["run", "", "--out", "o"],
            "an empty name, is the current folder; allowed: a scene file that exists, or one of",
        ),
        (["run", ".", "--out", "o"], "no scene file is named: '.', or an empty name, is the current folder; allowed"),
        (["run", "..", "--out", "o"], "..: is a folder; allowed: a scene file, which is a text in TOML"),
        (
            ["explain", "nodir", "--detection", "1"],
            "nodir: no such file or directory; allowed: a directory that `raych",
        ),
        (["explain", "nodir"], "nodir: no such file or directory; allowed: a directory that `raychan run`"),
        (["explain", "..", "--detection", "1"], "..: a directory without a result.nc; allowed: a directory that `rayc"),
        (["view", "urban", "--html", "s.png"], "--html s.png: the name must end in .html"),
        (["view", "urban", "--screenshot", "s.html"], "--screenshot s.html: the name must end in .png"),
    ],
)
def test_what_is_wrong_and_what_is_allowed_is_told(argv, words, capsys):
    assert words in told(argv, capsys)


@pytest.mark.parametrize("held", [b"", b"no result", b"\x89PNG\r\n\x1a\n"], ids=["empty", "text", "picture"])
def test_a_file_that_is_no_result_is_told_as_that_with_what_is_allowed(held, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.nc").write_bytes(held)
    for argv in (["explain", "x.nc", "--range", "5"], ["explain", "x.nc"], ["view", "x.nc", "--html", "x.html"]):
        said = told(argv, capsys)
        assert "x.nc: cannot be read: it is not a raychan result; allowed: a directory that `raychan run` or" in said


def test_a_result_that_may_not_be_read_is_told_in_plain_words(tmp_path, capsys, monkeypatch):
    (tmp_path / "x.nc").write_bytes(b"\x89HDF")

    def refused(*args, **options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refused)
    said = told(["explain", str(tmp_path / "x.nc"), "--range", "5"], capsys)
    assert "x.nc: cannot be read as a raychan result: Permission denied; allowed: a directory" in said


def test_view_names_results_beside_scenes_where_there_is_no_such_file(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = told(["view", "nodir", "--html", "x.html"], capsys)
    assert (
        "nodir: no such file or directory; allowed: a directory that `raychan run` wrote, its result.nc, or a sc"
        in said
    )
    (tmp_path / "mesh.toml").write_text(
        PLATE.replace("[[bodies]]", '[[bodies]]\nname = "m"\nmesh = "no.stl"\n[[bodies]]', 1)
    )
    said = told(["view", "mesh.toml", "--html", "x.html"], capsys)
    assert "no.stl" in said and "raychan run" not in said


def test_only_names_that_are_near_are_proposed(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bin.toml").write_text(PLATE)
    assert "bin" not in told(["run", "nosuch.toml", "--out", "o"], capsys)
    assert "did you mean 'bin.toml'?" in told(["run", "bim.toml", "--out", "o"], capsys)


@pytest.mark.parametrize("table", ["[run]\nduration_s = 3\n", "[sea]\n", "[scanner]\n[[bodies]]\nname = 'b'\n"])
@pytest.mark.parametrize("command", [["info"], ["run", "--out", "o"]])
def test_a_scene_of_a_ship_without_its_own_table_is_told_as_one(command, table, tmp_path, capsys):
    file = tmp_path / "s.toml"
    file.write_text(table)
    assert "is a scene of a ship, not of a radar; allowed: raychan ship" in told([*command, str(file)], capsys)
    file.write_text(PLATE + table)
    assert "unknown key" in told([*command, str(file)], capsys)


def test_a_mesh_is_told_once(tmp_path, capsys):
    trimesh.creation.box().export(tmp_path / "box.stl")
    assert invoke(["info", str(tmp_path / "box.stl")]) == 0
    said = capsys.readouterr().out
    assert said.count("vertices") == 1 and "faces" not in said and "(1.0" not in said


@pytest.mark.parametrize("held", [b"1 2 3\n", b"\x00\xff"])
def test_a_mesh_of_a_kind_that_is_not_read_is_told_with_those_that_are(held, tmp_path, capsys):
    file = tmp_path / "good.xyz"
    file.write_bytes(held)
    said = told(["info", str(file)], capsys)
    assert "good.xyz: neither a text in TOML nor a mesh that can be read (" in said
    assert "allowed: a scene file (.toml), in which a body may name a mesh; meshes are .glb, .gltf, .obj" in said
