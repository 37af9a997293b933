"""The stability study judges honestly, and the regimes whose truth is exact stand."""

import csv

import numpy as np
import pytest

from raychan.study import stability as study
from raychan.study.regimes_base import LAMBDA, K, Outcome, Regime, Row, at_most, plate_far, plate_near, same_db
from raychan.study.regimes_rays import dish


def test_near_field_quadrature_far_away_is_the_plate_s_closed_form():
    assert plate_near(0.1, 0.05, 1e5) == pytest.approx(plate_far(0.1, 0.05, 0.0), rel=1e-6)


@pytest.mark.parametrize(("width", "distance"), [(0.3, 0.5), (0.5, 3.0)])
def test_near_field_quadrature_is_a_plain_sum_over_small_squares(width, distance):
    n = 1500
    y = (np.arange(n) + 0.5) / n * width - width / 2
    r = np.sqrt(y[:, None] ** 2 + y**2 + distance**2)
    e = K / (2 * np.pi) * np.sum(distance / r**3 * np.exp(-2j * K * r)) * (width / n) ** 2
    assert plate_near(width, width, distance) == pytest.approx(4 * np.pi * distance**4 * abs(e) ** 2, rel=2e-3)


def test_plate_seen_head_on_has_the_area_s_cross_section():
    assert plate_far(0.1, 0.2, 0.0) == pytest.approx(4 * np.pi * (0.02 / LAMBDA) ** 2)


def test_bowl_stands_on_its_sphere_and_has_its_area():
    bowl = dish(0.5, 0.2, 24, 256)
    assert np.allclose(np.linalg.norm(bowl.vertices - [0.5, 0, 0], axis=1), 0.5)
    assert bowl.areas.sum() == pytest.approx(2 * np.pi * 0.25 * (1 - np.cos(0.2)), rel=1e-3)
    winding = np.cross(bowl.corners[:, 1] - bowl.corners[:, 0], bowl.corners[:, 2] - bowl.corners[:, 0])
    assert (np.einsum("ij,ij->i", winding, bowl.normals[:, 0]) > 0).all()


@pytest.mark.parametrize("seen", [np.nan, np.inf, 1.2])
def test_what_is_not_finite_or_too_far_off_fails(seen):
    assert not Row("case", 1.0, seen, 0.1, "", "").passed
    assert not at_most("case", seen, 1.1, "", "").passed


def test_no_power_where_some_is_due_fails():
    assert not same_db("case", 0.0, 1.0, 100.0, "").passed


def test_a_regime_that_raises_is_a_failure_and_the_next_one_runs(monkeypatch):
    def breaks(quick):
        raise ZeroDivisionError("by zero")

    good = Regime("good", "Good", lambda quick: Outcome([Row("case", 1.0, 1.0, 0.0, "", "")]))
    # No regime of the study raises.
    monkeypatch.setattr(study, "REGIMES", (Regime("bad", "Bad", breaks), good))
    bad, after = study.stability()
    assert [r.note for r in bad.failed] == ["ZeroDivisionError: by zero"]
    assert not after.failed


def test_table_holds_every_row_and_lists_failures_with_their_cause(tmp_path):
    rows = [Row("well", 1.0, 1.0, 0.1, "dB", "law"), Row("ill", 1.0, 2.0, 0.1, "dB", "law", "the | cause")]
    done = [study.Tried(Regime("r", "Regime", lambda quick: Outcome(rows)), Outcome(rows), 0.1)]
    with study.write_csv(done, tmp_path / "s.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [(r["case"], r["passed"], r["note"]) for r in table] == [
        ("well", "pass", ""),
        ("ill", "FAIL", "the | cause"),
    ]
    text = study.write_markdown(done, tmp_path / "s.md").read_text(encoding="utf-8")
    failures = text.split("## Failures")[1].split("## Regime")[0]
    assert "ill" in failures and "the \\| cause" in failures and "well" not in failures


def test_unknown_regime_is_told_with_the_known_ones():
    with pytest.raises(ValueError, match="'nonsense': must be one of grazing"):
        study.stability(only=["nonsense"])


@pytest.mark.parametrize(
    "key",
    [
        "grazing",
        "edge_on",
        "bistatic",
        "brewster",
        "total",
        "layers",
        "vacuum",
        "folding",
        "dynamic",
        "split",
        "panes",
        "joined",
        "worlds",
        "open_sheets",
        "on_a_plane",
    ],
)
def test_regimes_with_an_exact_truth_stand(key):
    (tried,) = study.stability(quick=True, only=[key])
    assert not tried.failed, [(r.name, r.expected, r.seen, r.note) for r in tried.failed]
    assert tried.outcome.rows


def test_any_number_of_paths_is_summed_within_bounded_memory():
    (tried,) = study.stability(quick=True, only=["paths"])
    sums = [r for r in tried.outcome.rows if "time" not in r.name]
    assert len(sums) == 12 and all(r.passed for r in sums)


def test_edges_do_not_leak_and_vertices_are_counted_apart():
    (tried,) = study.stability(quick=True, only=["leaks"])
    edges = [r for r in tried.outcome.rows if "vertices" not in r.name]
    assert len(edges) > 20 and all(r.passed for r in edges)
