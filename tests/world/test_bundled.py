"""Scenes and antennas come with the package and are found by name; what a user has of that name goes before."""

from __future__ import annotations

import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
import types

import pytest
from support.places import ROOT
from support.scene_texts import PLATE

import raychan as rc
from raychan.cli import invoke
from raychan.run.ship.scene import read_ship_scene
from raychan.world.scene_files import bundled


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_scene_that_comes_along_is_found_by_name_from_anywhere(elsewhere):
    every = sorted(f.stem for f in (ROOT / "scenes").glob("*.toml"))
    assert sorted(bundled.names() + bundled.ship_names()) == every
    for name in bundled.ship_names():
        assert read_ship_scene(name).title == read_ship_scene(ROOT / "scenes" / f"{name}.toml").title
    for name in bundled.names():
        assert rc.Scene.load(name).title == rc.Scene.load(ROOT / "scenes" / f"{name}.toml").title


def test_a_file_of_ones_own_is_never_shadowed_and_a_folder_is_no_scene(elsewhere, capsys):
    (elsewhere / "urban").mkdir()
    assert rc.Scene.load("urban").path.name == "urban.toml"
    (elsewhere / "urban.toml").write_text(PLATE)
    assert rc.Scene.load("urban.toml").title == "A plate ahead"
    (elsewhere / "urban").rmdir()
    (elsewhere / "urban").write_text(PLATE)
    assert invoke(["info", "urban"]) == 0
    assert "A plate ahead" in capsys.readouterr().out


def test_an_antenna_that_comes_along_serves_any_scene_and_ones_own_goes_before(elsewhere, capsys):
    (elsewhere / "mine.toml").write_text(PLATE)
    scene = rc.Scene.load("mine.toml").override(["radar.antenna=antennas/patch.toml"])
    known = rc.Scene.load("urban").override(["radar.antenna=antennas/patch.toml"])
    assert scene.radar.tx == known.radar.tx
    (elsewhere / "antennas").mkdir()
    (elsewhere / "antennas" / "patch.toml").write_text('kind = "isotropic"\n')
    own = rc.Scene.load("mine.toml").override(["radar.antenna=antennas/patch.toml"])
    assert type(own.radar.tx).__name__ == "IsotropicAntenna"
    assert invoke(["info", "antennas/array_2x2"]) == 0
    assert "10.36" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["urbn", "no/such/urban.toml", "../pyproject", "/urban"])
def test_what_is_nowhere_is_told_with_what_there_is(name, elsewhere, capsys):
    assert invoke(["info", name]) == 2
    said = capsys.readouterr().err
    assert "file not found" in said and ("did you mean 'urban'" in said or "occluded_pedestrian" in said)


def test_a_missing_scene_is_told_with_the_files_of_close_names_beside_it(elsewhere, capsys):
    (elsewhere / "crossing.toml").write_text(PLATE)
    assert invoke(["info", "crosing.toml"]) == 2
    assert "did you mean 'crossing.toml'?" in capsys.readouterr().err


def test_an_unknown_scene_is_answered_with_those_of_radars(capsys):
    assert invoke(["info", "nothere"]) == 2
    said = capsys.readouterr().err
    assert all(name in said for name in bundled.names()) and not any(name in said for name in bundled.ship_names())


def test_run_without_a_scene_lists_those_that_come_along(elsewhere, capsys):
    assert invoke(["run"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in bundled.names())
    assert invoke(["run", "urban"]) == 2
    assert "--out" in capsys.readouterr().err


def python(code, folder):
    """Return what code prints that imports raychan from a folder."""
    env = os.environ | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=env, cwd=folder, capture_output=True, text=True, check=True).stdout


def test_the_wheel_holds_the_scenes_beside_the_code_and_the_code_finds_them_there(tmp_path):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"] == {"scenes": "raychan/scenes"}
    for place in ("wheel", "bare"):
        shutil.copytree(ROOT / "raychan", tmp_path / place / "raychan", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "wheel" / "raychan" / "scenes").mkdir()
    (tmp_path / "wheel" / "raychan" / "scenes" / "only.toml").write_text(PLATE)
    names = "from raychan.world.scene_files import bundled; print(bundled.names(), bundled.folder())"
    loads = f"{names}; import raychan; print(raychan.Scene.load('only').title)"
    assert python(loads, tmp_path / "wheel") == f"['only'] {tmp_path}/wheel/raychan/scenes\nA plate ahead\n"
    assert python(names, tmp_path / "bare") == "[] None\n"


def test_the_readme_of_a_package_index_has_no_address_that_leads_nowhere(monkeypatch):
    plugin = types.ModuleType("hatchling.metadata.plugin.interface")
    plugin.MetadataHookInterface = type("Interface", (), {"root": str(ROOT)})
    for name in ("hatchling", "hatchling.metadata", "hatchling.metadata.plugin"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, plugin.__name__, plugin)
    hook = runpy.run_path(str(ROOT / "hatch_build.py"))["Readme"]
    told: dict = {}
    hook().update(told)
    assert not re.search(r"\]\((?!https?:)", told["readme"]["text"])
    assert "An urban street and the paths of its waves" in told["readme"]["text"]
