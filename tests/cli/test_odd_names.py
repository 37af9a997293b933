"""Names of files and bodies are printed as they are, whatever characters or bytes they hold."""

from __future__ import annotations

import pytest
import trimesh
from support.scene_texts import PLATE

from raychan.cli import invoke

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
