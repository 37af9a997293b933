"""raychan rcs as a user meets it: what it prints and writes, and how it fails."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import trimesh

from raychan.channel.rcs import Rcs
from raychan.cli import invoke
from raychan.units import C0


@pytest.fixture
def plate(tmp_path):
    file = tmp_path / "plate.ply"
    square = np.array([[0, -0.05, -0.05], [0, 0.05, -0.05], [0, 0.05, 0.05], [0, -0.05, 0.05]])
    trimesh.Trimesh(square, [[0, 1, 2], [0, 2, 3]], process=False).export(file)
    return file


def rows(file):
    with file.open() as f:
        return list(csv.DictReader(f))


def peak_dbsm(area):
    """Flat plate seen head-on (Balanis, eq. 11-44)."""
    return 10 * np.log10(4 * np.pi * area**2 * (77e9 / C0) ** 2)


def test_a_mesh_file_against_angle_is_printed_written_and_drawn(plate, tmp_path, capsys):
    out, png = tmp_path / "plate.csv", tmp_path / "plate.png"
    code = invoke(["rcs", str(plate), "--azimuth", "-2:2:1", "--out", str(out), "--plot", str(png)])
    said = capsys.readouterr()
    assert code == 0 and said.err == ""
    found = rows(out)
    assert f"{float(found[2]['rcs_dbsm']):.2f}" in said.out and "error dB" in said.out
    assert [float(r["azimuth_deg"]) for r in found] == [-2.0, -1.0, 0.0, 1.0, 2.0]
    assert float(found[2]["rcs_dbsm"]) == pytest.approx(peak_dbsm(0.01), abs=0.05)
    assert float(found[1]["sigma_m2"]) == pytest.approx(float(found[3]["sigma_m2"]), rel=1e-2)
    assert all(float(r["error_db"]) <= 0.25 and int(r["rays"]) > 0 for r in found)
    assert png.read_bytes().startswith(b"\x89PNG")
    assert {f.name for f in tmp_path.iterdir()} == {"plate.ply", "plate.csv", "plate.png"}, "nothing left lying about"


def test_unit_and_scale_size_the_mesh(plate, tmp_path):
    out = tmp_path / "small.csv"
    assert invoke(["rcs", str(plate), "--unit", "cm", "--scale", "50", "--out", str(out)]) == 0
    assert float(rows(out)[0]["rcs_dbsm"]) == pytest.approx(peak_dbsm(0.0025), abs=0.05)


def test_a_shape_with_its_parameters_over_both_angles(tmp_path):
    out = tmp_path / "s.csv"
    argv = ["rcs", "--shape", "sphere", "radius=0.1", "--azimuth", "0:10:10", "--elevation=-5:5:5", "--out", str(out)]
    assert invoke([*argv, "--plot", str(tmp_path / "s.svg")]) == 0
    found = rows(out)
    assert [(float(r["elevation_deg"]), float(r["azimuth_deg"])) for r in found[:3]] == [(-5, 0), (-5, 10), (0, 0)]
    assert len(found) == 6
    assert all(float(r["rcs_dbsm"]) == pytest.approx(10 * np.log10(np.pi * 0.01), abs=0.3) for r in found)


def test_near_field_polarisation_and_material_are_passed_on(plate, tmp_path, capsys):
    out = tmp_path / "n.csv"
    argv = ["rcs", str(plate), "--distance", "2", "--polarization", "hh", "--material", "glass", "--out", str(out)]
    assert invoke(argv) == 0
    assert float(rows(out)[0]["rcs_dbsm"]) < peak_dbsm(0.01) - 1.0
    assert "HH, radar at 2 m" in capsys.readouterr().out


def test_many_elevations_are_drawn_as_a_map(plate, tmp_path):
    png = tmp_path / "map.png"
    assert invoke(["rcs", str(plate), "--azimuth=-5:5:1", "--elevation=-5:5:1", "--plot", str(png)]) == 0
    assert png.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        ([], "one mesh file"),
        (["nowhere.ply"], "not found"),
        (["--shape", "spere"], "sphere"),
        (["--shape", "sphere", "radios=1"], "radius"),
        (["--shape", "sphere", "radius=-1"], "positive"),
        (["--shape", "sphere", "radius"], "KEY=VALUE"),
        (["--shape", "plate", "--azimuth", "0:10"], "first:last:step"),
        (["--shape", "plate", "--azimuth", "0:10:-1"], "never ends"),
        (["--shape", "plate", "--azimuth", "0:1:1e-12"], "at most"),
        (["--shape", "plate", "--azimuth", "nan"], "first:last:step"),
        (["--shape", "plate", "--polarization", "VX"], "VV"),
        (["--shape", "plate", "--distance", "-3"], "above 0"),
        (["--shape", "plate", "--distance", "near"], "metres"),
        (["--shape", "plate", "--frequency-ghz", "0"], "above 0"),
        (["--shape", "plate", "--frequency-ghz", "nan"], "above 0"),
        (["--shape", "plate", "--tolerance", "0"], "above 0"),
        (["--shape", "plate", "--max-bounces", "0"], "at least 1"),
        (["--shape", "plate", "--material", "pecc"], "pec"),
        (["--shape", "plate", "--crease", "10"], "built-in shape"),
        (["tests/none.ply", "--crease", "181"], "0 to 180"),
        (["--shape", "plate", "--out", "no/such/place.csv"], "no directory"),
        (["--shape", "plate", "--out", "table.txt"], ".csv"),
        (["--shape", "plate", "--plot", "picture.tiff"], ".png"),
    ],
)
def test_wrong_input_ends_with_2_and_says_what_is_allowed(argv, says, capsys):
    assert invoke(["rcs", *argv]) == 2
    said = capsys.readouterr()
    assert says in said.err and "Traceback" not in said.err
    assert said.out == ""


def test_ctrl_c_ends_with_130_and_writes_nothing(plate, tmp_path, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("raychan.channel.rcs.rcs", stop)
    out = tmp_path / "x.csv"
    assert invoke(["rcs", str(plate), "--out", str(out)]) == 130
    assert not out.exists()
    assert "interrupted" in capsys.readouterr().err


def made(*errors):
    n = len(errors)
    return Rcs(np.ones(n), np.array(errors), np.full(n, 10), np.ones(n, int), np.zeros((n, 2, 2), complex))


def test_missed_tolerance_is_told(capsys, monkeypatch):
    monkeypatch.setattr("raychan.channel.rcs.rcs", lambda *_, **__: made(0.7))
    assert invoke(["rcs", "--shape", "plate"]) == 0
    assert "1 of 1 angles miss the tolerance of 0.25 dB; largest stated error: 0.70 dB" in capsys.readouterr().err


@pytest.mark.parametrize("errors", [(0.1, np.nan, 0.2), (np.nan, np.nan, np.nan)])
def test_an_unknown_error_is_never_a_figure(errors, tmp_path, capsys, monkeypatch):
    known = made(*errors).converged
    assert known.tolist() == [np.isfinite(e) for e in errors]
    # The command asks for one angle at a time where there are few.
    each = iter(errors)
    monkeypatch.setattr("raychan.channel.rcs.rcs", lambda *_, **__: made(next(each)))
    out, png = tmp_path / "a.csv", tmp_path / "a.png"
    assert invoke(["rcs", "--shape", "plate", "--azimuth", "0:2:1", "--out", str(out), "--plot", str(png)]) == 0
    said = capsys.readouterr()
    assert said.out.split("written:")[0].count("unknown") == (~known).sum()
    assert f"{(~known).sum()} of 3 angles did not converge: their error is unknown" in said.err
    assert [(r["error_db"], r["converged"]) for r in rows(out)] == [
        (f"{e:g}", "true") if np.isfinite(e) else ("", "false") for e in errors
    ]
    assert png.read_bytes().startswith(b"\x89PNG")


def test_the_crease_angle_decides_and_doubtful_folds_are_told(tmp_path, capsys):
    """A prism of 24 facets, seen at a corner: round by itself, flat by request."""
    file, out = tmp_path / "prism.ply", tmp_path / "a.csv"
    trimesh.creation.cylinder(0.05, 0.05, sections=24).export(file)
    found = []
    for crease in ("20", "10"):
        assert invoke(["rcs", str(file), "--azimuth", "7.5", "--crease", crease, "--out", str(out)]) == 0
        found.append(float(rows(out)[0]["rcs_dbsm"]))
        told = "24 folds of up to 15 deg are taken for smooth; 24 of them may be edges: --crease decides"
        assert (told in capsys.readouterr().err) == (crease == "20")
    assert abs(found[0] - found[1]) > 1.0
    assert invoke(["info", str(file)]) == 0
    assert "24 folds of up to 15 deg" in " ".join(capsys.readouterr().err.split())
