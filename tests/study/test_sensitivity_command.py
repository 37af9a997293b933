"""raychan study sensitivity: what it writes and prints, wrong input, Ctrl-C."""

from __future__ import annotations

import csv
import math
import subprocess
import sys

import pytest
from support.scene_texts import PLATE, but_compiling

from raychan.cli import invoke, show
from raychan.cli.study_sensitivity import _each
from raychan.study.detection_tracks import Sighting, Track
from raychan.study.sensitivity import Moves, Sensitivity, Tolerances


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "plate.toml"
    path.write_text(PLATE)
    return path


def test_the_command_writes_tables_and_a_figure_and_tells_speckle_from_error(file, tmp_path, capsys):
    out = tmp_path / "out"
    options = ["--draws", "3", "--turn-deg", "0.3", "--tolerance", "0.5", "--each"]
    assert invoke(["study", "sensitivity", str(file), *options, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "over 3 draws of 1 body" in said and "speckle: spread above the tolerance" in said
    assert {p.name for p in out.iterdir()} == {"sensitivity.csv", "sensitivity.png", "each.csv"}
    assert all(str(p) in said for p in out.iterdir())
    assert (out / "sensitivity.png").stat().st_size > 5_000
    with open(out / "sensitivity.csv", newline="") as table:
        rows = list(csv.DictReader(table))
    assert rows[0]["bodies"] == "sign" and rows[0]["seen"] == rows[0]["draws"] == "3"
    assert float(rows[0]["level_p10_dbm"]) < float(rows[0]["level_p90_dbm"])
    with open(out / "each.csv", newline="") as table:
        assert {r["body"] for r in csv.DictReader(table)} == {"sign"}
    assert invoke(["study", "sensitivity", str(file), "--draws", "2"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "plate.toml"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--draws", "1"], "'--draws': 1: must lie between 2 and"),
        (["--turn-deg", "-1"], "'--turn-deg': -1.0: must lie between 0 and 45 deg"),
        (["--shift-mm", "nan"], "'--shift-mm': nan: must lie between 0"),
        (["--turn-deg", "0", "--shift-mm", "0"], "nothing would move"),
        (["--set", "bodies.sing.yaw_deg=3"], "did you mean 'sign'"),
        (["--set", "bodies.sign.role=mirror"], "no body can be displaced"),
        (["--shift-mm", "9000", "--draws", "9", "--set", "bodies.sign.shape=box"], "displaced the bodies"),
    ],
)
def test_wrong_words_are_told_in_a_sentence_and_write_nothing(options, words, file, tmp_path, capsys):
    if "9000" in options:
        file.write_text(PLATE.replace("[9.0, 0.0, 1.0]", "[3.0, 0.0, 0.0]").replace("plate", "box"))
        options = [*options[:-2], "--set", "bodies.sign.params={length=5.0, width=30.0, height=30.0}"]
    assert invoke(["study", "sensitivity", str(file), "--out", str(tmp_path / "out"), *options]) == 2
    said = capsys.readouterr().err
    assert words in said and "Traceback" not in said
    assert [p.name for p in tmp_path.iterdir()] == [file.name]


def test_a_level_that_no_body_moves_has_no_share_and_one_that_no_draw_sees_has_no_spread(capsys):
    track = Track(Sighting(9.0, 0.0, math.nan, -80.0, 0.1, "direct", "a", frozenset("a")))
    shares = [(0.0, math.nan), (0.0, math.nan)], [(0.3, 1.0), (math.nan, math.nan)]
    moves = tuple(Moves(track, True, 2, dict(zip("ab", s, strict=True))) for s in shares)
    show.console().print(_each(Sensitivity("", Tolerances(each=True), ("a", "b"), 0.5, moves, ())))
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows[-3:-1] == [["1", "0.00", "0.00"], ["2", "0.30", "(100", "%)"]]


_STOPPED = """
import os, signal, sys
import raychan.study.sensitivity as study, raychan.cli
# A job in the background starts deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
study.displaced = lambda *a, **k: os.kill(os.getpid(), signal.SIGINT)
sys.exit(raychan.cli.invoke(["study", "sensitivity", {scene!r}, "--out", {out!r}]))
"""


def test_ctrl_c_leaves_nothing(file, tmp_path):
    code = _STOPPED.format(scene=str(file), out=str(tmp_path / "out"))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (130, ""), done.stderr
    assert but_compiling(done.stderr) == "raychan: interrupted; nothing was written\n"
    assert [p.name for p in tmp_path.iterdir()] == [file.name]
