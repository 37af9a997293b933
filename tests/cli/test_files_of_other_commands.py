"""No command replaces files of another command, or of anyone else."""

import json
from pathlib import Path

import pytest
from support.scene_texts import PLATE

from raychan.cli import invoke

SHIP = "[run]\nduration_s = 0.1\n"


def argv(command, folder, out):
    """Return the shortest call of a command into a folder."""
    for name, text in (("plate", PLATE), ("ship", SHIP)):
        (folder / f"{name}.toml").write_text(text)
    plate, ship = str(folder / "plate.toml"), str(folder / "ship.toml")
    return {
        "run": ["run", plate, "--no-pictures"],
        "ship": ["ship", ship, "--no-pictures"],
        "hil": ["hil", ship, "--duration", "0.1", "--no-realtime"],
    }[command] + ["--out", str(out)]


def held(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


@pytest.mark.parametrize("first", ["run", "ship", "hil"])
def test_the_results_of_one_command_stay_when_another_is_told_to_write_over_them(first, tmp_path, capsys):
    out = tmp_path / "out"
    assert invoke(argv(first, tmp_path, out)) == 0
    before = held(out)
    for other in {"run", "ship", "hil"} - {first}:
        capsys.readouterr()
        assert invoke(argv(other, tmp_path, out)) == 2, other
        said = capsys.readouterr().err
        assert "exists, and" in said and "move it away or name another folder" in said
        assert held(out) == before, other
    assert invoke(argv(first, tmp_path, out)) == 0
    assert held(out).keys() == before.keys()


@pytest.mark.parametrize("name", ["summary.json", "track.csv"])
def test_hil_leaves_files_of_ones_own_and_says_so_before_the_run(name, tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("mine")
    assert invoke(argv("hil", tmp_path, out)) == 2
    assert f"{name}: exists, and is not a file of this command" in capsys.readouterr().err
    assert held(out) == {name: b"mine"}


def test_a_file_that_comes_while_hil_runs_stays(tmp_path, monkeypatch):
    from raychan.hil import session

    run, mine = session.Session.run, tmp_path / "out" / "summary.json"
    monkeypatch.setattr(session.Session, "run", lambda *a: (run(*a), mine.write_text("mine")))
    assert invoke(argv("hil", tmp_path, mine.parent)) == 2
    assert mine.read_text() == "mine"


def test_a_run_of_hil_that_was_killed_is_replaced_by_the_next(tmp_path):
    out = tmp_path / "out"
    assert invoke(argv("hil", tmp_path, out)) == 0
    (out / "summary.json").unlink()
    assert invoke(argv("hil", tmp_path, out)) == 0
    assert json.loads((out / "summary.json").read_text())["ended"] == "duration"
    (out / "track.csv").unlink()
    Path(out / "track.csv").mkdir()
    assert invoke(argv("hil", tmp_path, out)) == 2
