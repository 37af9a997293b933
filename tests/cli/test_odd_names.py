"""Names of files and bodies are printed as they are, whatever characters or bytes they hold."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh
from support.scene_texts import PLATE

from raychan.cli import invoke
from raychan.run.storage import load_result

ODD = "a[b]:smile:[/c]"
"""Brackets of a style's beginning and of its end, and the name of a picture."""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plate.toml").write_text(PLATE)
    return "plate.toml"


def test_brackets_and_colons_in_names_of_results_are_printed(scene, capsys):
    assert invoke(["run", scene, "--out", f"out/{ODD}", "--no-pictures"]) == 0
    assert f"results: out/{ODD}/result.nc, detections.csv" in capsys.readouterr().out
    assert invoke(["study", "sweep", scene, "--target", "sign", "--out", f"out/{ODD}"]) == 0
    assert f"table and figure: out/{ODD}/sweep.csv, out/{ODD}/sweep.png" in capsys.readouterr().out


def test_brackets_and_colons_in_titles_of_tables_are_printed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name = ODD.replace("/", "") + ".ply"
    trimesh.creation.box().export(tmp_path / name)
    assert invoke(["info", name]) == 0
    assert capsys.readouterr().out.startswith(name)
    assert invoke(["rcs", name, "--azimuth", "0", "--out", "x[test].csv"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{name}, 77 GHz") and "written: x[test].csv\n" in said


@pytest.fixture
def cafe(scene, tmp_path):
    """Return a name that is no text in UTF-8, of a scene; skip where the system has no such names."""
    try:
        (tmp_path / "caf\udce9.toml").write_text(PLATE)
    except (OSError, UnicodeError):
        pytest.skip("the system has no such names")
    return "caf\udce9"


def test_bytes_that_are_no_text_are_written_with_backslashes(cafe, tmp_path):
    command = ["run", f"{cafe}.toml", "--out", f"out/{cafe}", "--no-pictures"]
    done = subprocess.run(
        [sys.executable, "-m", "raychan", *command], capture_output=True, timeout=120, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert rb"results: out/caf\udce9/result.nc" in done.stdout
    result = load_result(tmp_path / "out" / cafe)
    assert result.path == str(tmp_path / r"caf\udce9.toml") and result.scene is not None
    assert json.loads((tmp_path / "out" / cafe / "summary.json").read_text())["scene"] == result.path


@pytest.mark.parametrize("kind", ["glb", "obj", "ply", "stl"])
def test_meshes_whose_names_are_no_text_are_read(kind, cafe, capsys):
    trimesh.creation.box().export(f"box.{kind}")
    Path(f"box.{kind}").rename(f"{cafe}.{kind}")
    assert invoke(["info", f"{cafe}.{kind}"]) == 0
    said = capsys.readouterr().out
    assert rf"caf\udce9.{kind}" in said and "8, 12" in said


def test_values_that_are_no_text_are_refused(scene, tmp_path, capsys):
    assert invoke(["run", scene, "--out", "out", "--set", "scene.title=caf\udce9"]) == 2
    assert r"'scene.title=caf\udce9' is not possible; allowed: a text in UTF-8" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
