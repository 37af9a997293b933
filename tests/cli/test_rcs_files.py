"""raychan rcs keeps what it computed where a file cannot be written."""

from __future__ import annotations

from raychan.cli import invoke


def test_a_figure_that_cannot_be_written_leaves_the_table(tmp_path, capsys):
    """The directory takes files, but the figure's name is that of a directory."""
    out, png = tmp_path / "t.csv", tmp_path / "f.png"
    png.mkdir()
    assert invoke(["rcs", "--shape", "plate", "--out", str(out), "--plot", str(png)]) == 2
    told = capsys.readouterr()
    assert "is a directory" in told.err and str(out) in told.err and "RCS dBsm" in told.out
    assert len(out.read_text().splitlines()) == 2
    out.unlink()
    out.mkdir()
    png.rmdir()
    assert invoke(["rcs", "--shape", "plate", "--out", str(out), "--plot", str(png)]) == 2
    assert "RCS dBsm" in capsys.readouterr().out and not png.exists()


def test_a_ball_too_large_for_its_sag_is_named_by_its_own_radius(capsys):
    assert invoke(["rcs", "--shape", "sphere", "radius=300"]) == 2
    assert "an arc of radius 300 m" in capsys.readouterr().err
