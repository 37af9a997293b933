"""A sequence ends where something else writes into its directory: files of two are never mixed."""

from __future__ import annotations

import csv
import shutil

import pytest
from support.scene_texts import PLATE

import raychan as rc
from raychan.cli import invoke
from raychan.run import sequence
from raychan.run.files.output import StoreError
from raychan.run.sequence import Store


@pytest.fixture(scope="module")
def frames():
    return list(sequence.frames(rc.Scene.from_text(PLATE), 3, 0.1))


def another_sequence(out, frames):
    Store(out).add(frames[0])


def a_run(out, frames):
    rc.save_result(frames[0].result, out)


def a_line(out, frames):
    with (out / "detections.csv").open("a") as file:
        file.write("mine\n")


def nothing_left(out, frames):
    shutil.rmtree(out)


@pytest.mark.parametrize("disturb", [another_sequence, a_run, a_line, nothing_left])
def test_a_sequence_adds_no_frame_to_what_something_else_wrote(disturb, frames, tmp_path):
    out, store = tmp_path / "out", Store(tmp_path / "out")
    store.add(frames[0])
    store.add(frames[1])
    disturb(out, frames)
    there = {p: p.read_bytes() for p in out.rglob("*") if p.is_file()}
    with pytest.raises(StoreError, match=r"out: is not as this sequence left it after 2 frames: something else writes"):
        store.add(frames[2])
    assert {p: p.read_bytes() for p in out.rglob("*") if p.is_file()} == there
    assert [p.name for p in tmp_path.iterdir()] == ([] if disturb is nothing_left else ["out"])


def test_what_comes_while_a_frame_is_drawn_is_noticed_too(frames, tmp_path):
    out, store = tmp_path / "out", Store(tmp_path / "out")
    store.add(frames[0])
    with pytest.raises(StoreError, match="something else writes there"):
        store.add(frames[1], lambda result, place: another_sequence(out, frames))
    assert {p.name for p in out.iterdir()} == {"detections.csv", "frame_0000"}


def test_of_two_sequences_in_one_directory_the_first_ends_with_2(tmp_path, monkeypatch, capsys):
    scene, out, real = tmp_path / "plate.toml", tmp_path / "out", sequence.frames
    scene.write_text(PLATE)
    command = ["run", str(scene), "--out", str(out), "--no-pictures", "--frames", "3"]

    def disturbed(*given, **named):
        for frame in real(*given, **named):
            if frame.number == 2:
                monkeypatch.setattr(sequence, "frames", real)
                assert invoke(command) == 0
            yield frame

    monkeypatch.setattr(sequence, "frames", disturbed)
    assert invoke(command) == 2
    assert f"raychan: {out}: is not as this sequence left it after 2 frames" in capsys.readouterr().err
    listed = [row["frame"] for row in csv.DictReader((out / "detections.csv").read_text().splitlines())]
    assert sorted(set(listed)) == ["0", "1", "2"] and listed == sorted(listed)
