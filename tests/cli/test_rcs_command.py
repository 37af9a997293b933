"""raychan rcs as a user meets it: what it prints and writes, and how it fails."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import trimesh

from raychan.cli import invoke
from raychan.run.rcs import Rcs
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
    angles = ["--azimuth", "-2:2:1", "--tolerance", "0.5"]
    code = invoke(["rcs", str(plate), *angles, "--out", str(out), "--plot", str(png)])
    said = capsys.readouterr()
    assert code == 0 and said.err == "warning: not watertight: 4 open and 0 non-manifold edges\n"
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


def drawn(monkeypatch, dbsm, error, polar=False, azimuth=None, elevation=(0.0,)):
    """Return the axes of a picture of RCS against angle."""
    from raychan.report import rcs_figure

    made = []
    # The picture is looked at before it is bytes.
    monkeypatch.setattr(rcs_figure, "drawn_as", lambda figure, suffix: made.append(figure) or memoryview(b""))
    azimuth = np.arange(float(np.shape(dbsm)[1])) if azimuth is None else np.array(azimuth)
    rcs_figure.rcs_picture(azimuth, np.array(elevation), np.array(dbsm), np.array(error), "title", polar=polar)
    return made[0].axes[0]


@pytest.mark.parametrize("polar", [False, True])
def test_the_plot_clips_nothing_and_leaves_gaps_where_nothing_returns(polar, monkeypatch):
    dbsm = np.array([[-137.0, -np.inf, 3.0, 41.0, -350.0]])
    axes = drawn(monkeypatch, dbsm, [[0.5, np.nan, 0.1, np.nan, 0.2]], polar)
    low, high = axes.get_ylim()
    assert low < -137.5 and high > 41.0
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [-137.0, np.nan, 3.0, 41.0, np.nan])
    assert axes.lines[2].get_ydata()[1] == 41.0, "a cross where the error is unknown"
    note = axes.get_legend().get_title().get_text()
    assert "0.1 to 0.5 dB" in note and "error unknown (2 of 5" in note and "no return (2 of 5" in note
    assert axes.name == ("polar" if polar else "rectilinear")


def test_a_polar_plot_turns_as_the_target_does_from_above(monkeypatch):
    axes = drawn(monkeypatch, [[0.0, 1.0, 2.0]], [[0.1, 0.1, 0.1]], True, azimuth=[0.0, 90.0, 180.0])
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [0.0, np.pi / 2, np.pi])
    assert axes.get_theta_offset() == pytest.approx(np.pi / 2) and axes.get_theta_direction() == 1.0


def test_one_angle_is_written_as_a_figure(monkeypatch):
    axes = drawn(monkeypatch, [[10.0]], [[0.25]], azimuth=[30.0])
    said = " ".join(t.get_text() for t in axes.texts)
    assert "10.00 dBsm" in said and "0.25 dB" in said and "10 m²" in said and "azimuth 30 deg" in said
    assert not axes.lines and not axes.axison
    said = " ".join(t.get_text() for t in drawn(monkeypatch, [[-np.inf]], [[np.nan]]).texts)
    assert "no return" in said and "error unknown" in said


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
        (["--shape", "plate", "--frequency-ghz", "0"], "between 0.1 and 1000 GHz"),
        (["--shape", "plate", "--frequency-ghz", "nan"], "between 0.1 and 1000 GHz"),
        (["--shape", "plate", "--tolerance", "0"], "between 0.001 and 40 dB"),
        (["--shape", "plate", "--max-bounces", "0"], "between 1 and 12"),
        (["--shape", "plate", "--max-bounces", "99"], "between 1 and 12"),
        (["--shape", "plate", "--max-rays", "0"], "between 1 and"),
        (["--shape", "plate", "--tolerance", "inf"], "between 0.001 and 40 dB"),
        (["--shape", "plate", "--azimuth", "1e30"], "ten turns"),
        (["--shape", "plate", "--material", "pecc"], "pec"),
        (["--shape", "plate", "--crease", "10"], "built-in shape"),
        (["tests/none.ply", "--crease", "181"], "between 0 and 180 deg"),
        (["--shape", "plate", "--out", "no/such/place.csv"], "no directory"),
        (["--shape", "plate", "--out", "table.txt"], ".csv"),
        (["--shape", "plate", "--out", "{directory}"], "is a directory; name a file"),
        (["--shape", "plate", "--plot", "picture.tiff"], ".png"),
        (["--shape", "plate", "--polar"], "--plot"),
        (["--shape", "plate", "--polar", "--plot", "a.png", "--azimuth=0:9:1", "--elevation=0:8:1"], "at most 8"),
    ],
)
def test_wrong_input_ends_with_2_and_says_what_is_allowed(argv, says, tmp_path, capsys):
    directory = tmp_path / "taken.csv"
    directory.mkdir()
    assert invoke(["rcs", *(word.format(directory=directory) for word in argv)]) == 2
    said = capsys.readouterr()
    assert says in said.err and "Traceback" not in said.err
    assert said.out == ""


def test_ctrl_c_ends_with_130_and_writes_nothing(plate, tmp_path, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    # Ctrl-C comes while it computes.
    monkeypatch.setattr("raychan.run.rcs.rcs", stop)
    out = tmp_path / "x.csv"
    assert invoke(["rcs", str(plate), "--out", str(out)]) == 130
    assert not out.exists()
    assert "interrupted" in capsys.readouterr().err


def made(*errors, numerical=None):
    n = len(errors)
    return Rcs(
        sigma=np.ones(n), error_db=np.array(errors), numerical_db=np.array(numerical or errors), rays=np.full(n, 10),
        bounces=np.ones(n, int), amplitude=np.zeros((n, 2, 2), complex), further_db=np.zeros(n), edges_db=np.zeros(n),
        too_near=np.zeros(n, bool),
    )  # fmt: skip


def test_missed_tolerance_is_told(capsys, monkeypatch):
    # The command's words are tested here, of an error that is known.
    monkeypatch.setattr("raychan.run.rcs.rcs", lambda *_, **__: made(0.7))
    assert invoke(["rcs", "--shape", "plate"]) == 0
    assert "1 of 1 angles miss the tolerance of 0.25 dB; largest stated error: 0.70 dB" in capsys.readouterr().err


@pytest.mark.parametrize("errors", [(0.1, np.nan, 0.2), (np.nan, np.nan, np.nan)])
def test_an_unknown_error_is_never_a_figure(errors, tmp_path, capsys, monkeypatch):
    known = made(*errors).converged
    assert known.tolist() == [np.isfinite(e) for e in errors]
    # The command asks for one angle at a time where there are few.
    each = iter(errors)
    monkeypatch.setattr("raychan.run.rcs.rcs", lambda *_, **__: made(next(each)))
    out, png = tmp_path / "a.csv", tmp_path / "a.png"
    assert invoke(["rcs", "--shape", "plate", "--azimuth", "0:2:1", "--out", str(out), "--plot", str(png)]) == 0
    said = capsys.readouterr()
    assert said.out.split("written:")[0].count("unknown") == 2 * (~known).sum()
    assert f"{(~known).sum()} of 3 angles did not converge: their error is unknown" in said.err
    assert [(r["error_db"], r["numerical_db"], r["converged"]) for r in rows(out)] == [
        (f"{e:g}", f"{e:g}", "true") if np.isfinite(e) else ("", "", "false") for e in errors
    ]
    assert png.read_bytes().startswith(b"\x89PNG")


def test_what_only_the_mesh_leaves_open_is_not_said_to_want_rays(capsys, monkeypatch):
    monkeypatch.setattr("raychan.run.rcs.rcs", lambda *_, **__: made(np.nan, numerical=[0.2]))
    assert invoke(["rcs", "--shape", "plate"]) == 0
    said = capsys.readouterr()
    assert "1 of 1 angles are converged, but their level is open: other surfaces that the mesh may" in said.err
    assert "--max-rays" not in said.err and said.out.count("unknown") == 1 and "0.200" in said.out


def test_the_crease_angle_decides_and_doubtful_folds_are_told(tmp_path, capsys):
    """A prism of 24 facets, seen at a corner: round by itself, flat by request."""
    file, out = tmp_path / "prism.ply", tmp_path / "a.csv"
    trimesh.creation.cylinder(0.05, 0.05, sections=24).export(file)
    found = []
    for crease in ([], ["--crease", "20"], ["--crease", "10"]):
        assert invoke(["rcs", str(file), "--azimuth", "7.5", *crease, "--out", str(out)]) == 0
        found.append(rows(out)[0])
        told = "24 folds of up to 15 deg are taken for smooth; 24 of them may be edges: --crease decides"
        assert (told in capsys.readouterr().err) == (not crease)
    guessed, smooth, flat = (float(one["rcs_dbsm"]) for one in found)
    assert guessed == smooth and abs(smooth - flat) > 1.0
    # What is said to be smooth is in no doubt to be so.
    assert float(found[0]["error_db"]) > abs(smooth - flat) > float(found[1]["error_db"])
    assert invoke(["info", str(file)]) == 0
    assert "24 folds of up to 15 deg" in " ".join(capsys.readouterr().err.split())


def test_more_rays_make_an_unknown_error_known(tmp_path):
    said = []
    for rays in ("5000", "2000000"):
        out = tmp_path / f"{rays}.csv"
        view = ["--azimuth", "20", "--elevation", "10", "--tolerance", "0.5", "--out", str(out)]
        assert invoke(["rcs", "--shape", "car", *view, "--max-rays", rays]) == 0
        with out.open() as file:
            said.append(next(csv.DictReader(file)))
    few, many = said
    assert (few["converged"], few["error_db"], many["converged"]) == ("false", "", "true")
    assert float(many["error_db"]) < 3.0 and 20 * int(few["rays"]) < int(many["rays"])


def test_rays_beyond_the_budget_and_zeros_are_told(capsys, monkeypatch):
    """A plate returns nothing in the other polarisation: zero, not what rounding leaves of it."""
    assert invoke(["rcs", "--shape", "plate", "--polarization", "VH", "--azimuth", "10"]) == 0
    said = capsys.readouterr()
    assert "no return" in said.out and "1 of 1 angles return nothing in physical optics" in said.err
    monkeypatch.setattr("raychan.run.rcs.rcs", lambda *_, **__: made(0.1))
    for most, told in (("4", True), ("5", False)):
        assert invoke(["rcs", "--shape", "plate", "--max-rays", most]) == 0
        assert ("1 of 1 angles took more rays than --max-rays (4), up to 10" in capsys.readouterr().err) == told


def test_a_parameter_given_twice_and_a_folder_are_refused_by_name(tmp_path, capsys):
    assert invoke(["rcs", "--shape", "sphere", "radius=1", "radius=2"]) == 2
    assert "'radius' is given twice" in capsys.readouterr().err
    assert invoke(["rcs", str(tmp_path)]) == 2
    assert "is a folder" in capsys.readouterr().err
