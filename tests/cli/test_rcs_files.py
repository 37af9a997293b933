"""raychan rcs keeps what it computed where a file cannot be written."""

from __future__ import annotations

from importlib import import_module

import pytest

from raychan.cli import invoke


@pytest.mark.parametrize("taken", ["t.csv", "f.png"])
def test_a_directory_in_the_place_of_a_file_is_refused_before_anything_is_computed(taken, tmp_path, capsys):
    out, png = tmp_path / "t.csv", tmp_path / "f.png"
    (tmp_path / taken).mkdir()
    assert invoke(["rcs", "--shape", "plate", "--out", str(out), "--plot", str(png)]) == 2
    told = capsys.readouterr()
    assert f"{taken}: is a directory; name a file" in told.err and told.out == ""
    assert [path.name for path in tmp_path.iterdir()] == [taken]


@pytest.mark.parametrize("taken", ["t.csv", "f.png"])
def test_where_one_file_cannot_be_written_the_table_is_printed(taken, tmp_path, monkeypatch, capsys):
    """The directory takes files, but a name is taken by another directory while the angles are computed."""
    out, png = tmp_path / "t.csv", tmp_path / "f.png"
    monkeypatch.setattr(
        import_module("raychan.cli.rcs"), "writable", lambda *_: (tmp_path / taken).mkdir(exist_ok=True)
    )
    assert invoke(["rcs", "--shape", "plate", "--out", str(out), "--plot", str(png)]) == 2
    told = capsys.readouterr()
    assert "is a directory" in told.err and "RCS dBsm" in told.out
    assert out.is_dir() or (str(out) in told.err and len(out.read_text().splitlines()) == 2)
    assert png.is_dir() or not png.exists()


def test_a_ball_too_large_for_its_sag_is_named_by_its_own_radius(capsys):
    assert invoke(["rcs", "--shape", "sphere", "radius=300"]) == 2
    assert "an arc of radius 300 m" in capsys.readouterr().err
