"""The line of raychan rcs on fringe fields of edges."""

from raychan.cli import invoke


def test_fringe_fields_of_edges_are_told_where_they_exceed_the_tolerance(capsys, tmp_path):
    box = ["rcs", "--shape", "box", "length=0.1", "width=0.1", "height=0.1", "--azimuth", "0:45:45"]
    out = tmp_path / "box.csv"
    assert invoke([*box, "--out", str(out)]) == 0
    assert "at 1 of 2 angles the error does not include fringe fields of edges" in capsys.readouterr().err
    rows = [line.split(",") for line in out.read_text().split()]
    assert rows[0][-1] == "edges_db" and float(rows[1][-1]) < 0.25 and not 0.0 < float(rows[2][-1] or "nan") < 1.0
    assert invoke(["rcs", "--shape", "sphere", "--azimuth", "0"]) == 0
    assert "fringe" not in capsys.readouterr().err
