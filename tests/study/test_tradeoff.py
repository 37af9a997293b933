"""The trade-off study: its lattice and specular points against closed forms, its fronts and files."""

import csv

import numpy as np
import pytest
from truth import po

from raychan.cli import invoke
from raychan.run.cross_section.single_body import facets_of
from raychan.study import cases, methods
from raychan.study.ray_lattice import Window, echoes
from raychan.study.specular_points import specular_points
from raychan.study.tradeoff import Row, beaten_by, comparable, marked, overall, read_csv, tradeoff, write_csv
from raychan.study.verdicts import verdicts
from raychan.tracing.legs import Leg
from raychan.world.ray_caster import RayCaster
from raychan.world.shapes import build


def row(method, rays, seconds, error, default=False):
    return Row("c", "c", "t", 0.05, method, "s", default, rays, seconds, error)


def test_near_plate_truth_equals_the_independent_quadrature():
    case = cases.plate()
    for view, sigma in zip(case.views, case.truth, strict=True):
        tx = po.direction(*np.radians(view[:2])), view[2]
        s = po.polygon(po.rectangle(1.5, 1.5), cases.WAVENUMBER, tx)
        assert 10 * np.log10(sigma / (4 * np.pi * abs(s[0, 0]) ** 2)) == pytest.approx(0.0, abs=1e-3)


def test_uniform_tubes_meet_the_near_plate_and_point_samples_do_not_yet():
    case = cases.plate()
    fine, coarse = methods.lattice(case, 4_096, tubes=True), methods.lattice(case, 4_096, tubes=False)
    assert abs(10 * np.log10(fine.value[0] / case.truth[0])) < 0.02
    assert abs(10 * np.log10(coarse.value[0] / case.truth[0])) > 1.0


def test_uniform_tubes_meet_the_trihedral_closed_form():
    case = cases.trihedral()
    closed = 4 * np.pi * 0.2**4 / (3 * (2 * np.pi / cases.WAVENUMBER) ** 2)
    run = methods.lattice(case, 64_000, tubes=True)
    assert 10 * np.log10(run.value[0] / closed) == pytest.approx(0.0, abs=0.1)
    assert np.abs(10 * np.log10(run.value / case.truth)).max() < 0.05


def test_glint_of_a_sphere_is_its_high_frequency_limit():
    end = np.array([12.0, 1.0, 2.0])
    tracer = RayCaster(facets_of(build("sphere", {"radius": 0.5}), "pec", cases.FREQUENCY))
    found = specular_points(tracer, end, cases.WAVENUMBER)
    reach = np.linalg.norm(end)
    sigma = 4 * np.pi * abs(found.field.sum() * reach**2) ** 2
    assert sigma == pytest.approx(np.pi * 0.25 * (reach / (reach - 0.5)) ** 2, rel=2e-3)


def test_rate_of_a_lattice_echo_is_half_the_rate_of_its_length():
    end, own = np.array([0.0, 0.0, 0.0]), np.array([7.0, 0.5, 0.0])
    mesh = build("dihedral", {"size": 0.2, "height": 0.2})

    def lengths(shift):
        facets = facets_of(mesh, "pec", cases.FREQUENCY)
        turned = facets.vertices * [-1.0, -1.0, 1.0] + [8.0, 0.1, 0.05]
        facets = facets.replace(vertices=turned, velocity=np.array([[3.0, 1.0, -0.5]]))
        facets = facets.replace(vertices=turned + shift * (facets.velocity[0] - own))
        window = Window.onto(end, turned.reshape(-1, 3), np.array([1.0, 0.0, 0.0]))

        def field(d):
            return cases.vertical(d)

        return list(echoes(RayCaster(facets), window, [Leg(end=end)], field, field, 77e9, 40_000, 2, True, own))

    # The shortest way of the double bounce, which a fixed lattice follows as the scene moves.
    step = 0.02
    before, now, after = lengths(-step), lengths(0.0), lengths(step)
    best = np.argmin(now[1].length)
    slope = (after[1].length.min() - before[1].length.min()) / (4.0 * step)
    assert now[1].rate[best] == pytest.approx(slope, abs=0.02)


def test_front_holds_what_none_beats_and_errors_below_the_truth_count_as_equal():
    rows = marked([row("a", 10, 1.0, 3.0), row("b", 20, 2.0, 0.04), row("c", 30, 3.0, 0.01), row("d", 40, 0.5, 9.0)])
    assert [r.front_seconds for r in rows] == [True, True, False, True]
    assert [r.front_rays for r in rows] == [True, True, False, False]
    assert [r.method for r in beaten_by(rows, rows[2])] == ["b"]


def test_csv_has_a_line_a_row(tmp_path):
    rows = [row("a, b", 10, 1.0, 3.0), row("b", 20, 2.0, 0.04, default=True)]
    with write_csv(rows, tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert [r["method"] for r in read] == ["a, b", "b"] and float(read[1]["error_db"]) == 0.04


def test_table_comes_back_as_it_was_written_and_another_file_is_refused(tmp_path):
    rows = marked([row("a, b", 10.0, 1.0, 3.0), row("b", 20.0, 2.0, 0.04, default=True)])
    assert read_csv(write_csv(rows, tmp_path / "t.csv")) == rows
    text = (tmp_path / "t.csv").read_text()
    (tmp_path / "cut.csv").write_text(text[:-20])
    with pytest.raises(ValueError, match="line 3 is not one"):
        read_csv(tmp_path / "cut.csv")
    (tmp_path / "other.csv").write_text(text.replace("rays", "tubes"))
    with pytest.raises(ValueError, match="column 'rays' is missing"):
        read_csv(tmp_path / "other.csv")
    assert invoke(["study", "tradeoff", "--beside", str(tmp_path / "none.csv"), "--out", str(tmp_path / "o")]) == 2


@pytest.mark.parametrize(("column", "value"), [("error_db", "inf"), ("seconds", "-1"), ("default", "maybe")])
def test_rows_that_cannot_be_are_refused_by_their_line(tmp_path, column, value):
    with write_csv([row("a", 10.0, 1.0, 3.0)], tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        (line,) = csv.DictReader(file)
    head, body = ",".join(line), ",".join((line | {column: value}).values())
    (tmp_path / "bad.csv").write_text(f"{head}\n{body}\n")
    with pytest.raises(ValueError, match="line 2 is not one"):
        read_csv(tmp_path / "bad.csv")
    (tmp_path / "empty.csv").write_text(f"{head}\n")
    with pytest.raises(ValueError, match="no rows"):
        read_csv(tmp_path / "empty.csv")


def of_cases(*names):
    """Return rows of one setting on cases, each of a second and 1 dB, and those of all."""
    rows = [Row(name, name, "t", 0.01, "m", "s", True, 10.0, 1.0, 1.0) for name in names]
    return rows + overall(rows)


def test_an_earlier_run_is_compared_on_the_cases_of_both():
    """Of five cases and two the front of all is that of the two; where it lacks one there is none, and a line."""
    both, said = comparable(of_cases("plate", "sphere"), of_cases("plate", "sphere", "car", "urban"))
    (whole,) = (r for r in both if r.case == "all")
    assert whole.seconds == 2.0 and "2 targets" in whole.title and "car, urban" in said[0]
    both, said = comparable(of_cases("plate", "sphere"), of_cases("plate", "car"))
    assert {r.case for r in both} == {"plate"} and "lacks sphere" in said[0] and "has car" in said[1]
    assert comparable(of_cases("plate"), of_cases("plate"))[1] == []


def test_a_case_named_twice_runs_once(tmp_path):
    rows = tradeoff(("dihedral", "dihedral"), quick=True)
    assert len({(r.method, r.setting) for r in rows}) == len(rows)


def test_verdict_names_what_beats_the_default_and_where_that_fails():
    def on(case, method, rays, seconds, error, default=False, setting="s"):
        return Row(case, case, "t", 0.01, method, setting, default, rays, seconds, error)

    rows = [
        on("plate", methods.ADAPTIVE, 100.0, 1.0, 0.1, default=True),
        on("plate", methods.ADAPTIVE, 40.0, 0.4, 0.1, setting="launch 1"),
        on("plate", methods.MIRRORS, 3.0, 2.0, 0.05),
        on("dihedral", methods.MIRRORS, 3.0, 2.0, 40.0),
    ]
    title, rays, seconds = verdicts(rows)
    assert title == "default on plate: 0.10 dB, 100 rays, 1 s"
    assert "beaten by mirror paths only, s (0.05 dB, 3 rays, 2 s, but 40.00 dB off on dihedral)" in rays
    assert "on the front but for single launches of its own, which state no error (0.10 dB, 40 rays" in seconds


@pytest.mark.parametrize(
    ("errors", "told"),
    [
        ((3.0, 0.2, 0.6), "never, 0.60 dB at 3,000 rays: 30 times the rays and 300 times the time"),
        ((3.0, 0.2, 0.4), "from 2,000 rays on: 20 times the rays and 200 times the time"),
    ],
)
def test_point_samples_reach_a_level_only_where_they_stay_below_it(errors, told):
    rows = [Row("sphere", "c", "t", 0.01, methods.ADAPTIVE, "s", True, 100.0, 0.01, 0.1)]
    for i, error in enumerate(errors, 1):
        rows.append(Row("sphere", "c", "t", 0.01, methods.POINT, str(i), False, 1000.0 * i, float(i), error))
    assert told in verdicts(rows)[-1] and verdicts(rows)[-1].startswith("point samples within 0.5 dB on sphere")


def test_command_writes_figures_and_table_and_says_where_the_default_stands(tmp_path, capsys):
    assert invoke(["study", "tradeoff", "--quick", "--case", "dihedral", "--out", str(tmp_path / "o")]) == 0
    names = {f.name for f in (tmp_path / "o").iterdir()}
    assert names == {"tradeoff.csv", "tradeoff.png", "tradeoff_dihedral.png"}
    assert "default on dihedral" in capsys.readouterr().out


def test_unknown_case_is_refused_by_name(tmp_path, capsys):
    assert invoke(["study", "tradeoff", "--case", "spehre", "--out", str(tmp_path / "o")]) == 2
    assert "spehre" in capsys.readouterr().err and not (tmp_path / "o").exists()
