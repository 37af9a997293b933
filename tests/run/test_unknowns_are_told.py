"""What a run does not know is said: detections without an error that is a figure, and what was left out."""

from __future__ import annotations

import csv
import dataclasses
import json
import math

import numpy as np
import pytest
from PIL import Image
from support.results import paths, result
from support.scene_texts import ISOTROPIC, walker

from raychan.channel.error import LARGEST, LARGEST_DB, SCATTER, stated_error
from raychan.cli import invoke, show
from raychan.records import REFLECT
from raychan.records import SCATTER as SCATTERS
from raychan.report.canvas import figure as drawing
from raychan.report.figures import rdmap_picture
from raychan.run.convergence import figure
from raychan.run.ledger_entry import UNKNOWN, Entry
from raychan.run.messages.results import counts, marks, noted, warned
from raychan.run.storage import load_result, save_result, summary
from raychan.study.sweep import Seen, Step, cells
from raychan.study.validation.sections import Echo
from raychan.study.visibility import Visibility
from raychan.tracing.occlusion import Occlusion

TAIL, GHOST = [(1, SCATTERS)], [(2, REFLECT), (3, SCATTERS)]


@pytest.fixture
def half():
    """Two detections, of which two launches know the first to a tenth and the second to its own size."""
    p = paths([9.0, 5.0], [-7.0, 0.0], [2e-5, 1e-5], [TAIL, GHOST])
    return result(p, [(9.0, -7.0, 4e-10), (5.0, 0.0, 1e-10)], differ=[1e-4, 1.0])


def test_a_level_error_is_a_figure_while_its_own_scatter_is_less_than_it():
    rng = np.random.default_rng(0)
    size = np.abs(rng.normal(size=400_000) + 1j * rng.normal(size=400_000))
    assert pytest.approx(size.std() / size.mean(), rel=5e-3) == SCATTER

    def shaken(x, step=1e-6):
        change = (math.log1p(-(x - step)) - math.log1p(-(x + step))) / (2.0 * step)
        return SCATTER * x * change / -math.log1p(-x)

    assert shaken(LARGEST) == pytest.approx(1.0, abs=1e-3)
    assert shaken(0.9 * LARGEST) < 1.0 < shaken(1.05 * LARGEST)


def test_the_error_is_stated_as_before_below_the_limit_and_is_no_figure_above_it():
    for change in np.geomspace(1e-4, 10.0, 60):
        stated = stated_error(2.0, 2.0 * change)
        got = figure(4.0, 4.0 * change**2)
        assert got == stated if stated <= LARGEST_DB else math.isnan(got)
    assert math.isnan(figure(0.0, 1.0)) and figure(0.0, 0.0) < 1e-3


def test_a_detection_that_is_not_converged_has_no_error_figure_in_any_file(half, tmp_path):
    d = half.detections
    assert d.converged.tolist() == [True, False]
    assert 0.0 < d.error_db[0] < 1.0 and math.isnan(d.error_db[1])
    save_result(half, tmp_path)
    with open(tmp_path / "detections.csv", newline="") as file:
        known, unknown = csv.DictReader(file)
    assert (known["converged"], unknown["converged"], unknown["error_db"]) == ("true", "false", "")
    assert float(known["error_db"]) == pytest.approx(d.error_db[0], abs=0.006)
    back = load_result(tmp_path)
    assert back.detections.converged.dtype == bool and back.detections.converged.tolist() == [True, False]
    np.testing.assert_array_equal(back.detections.error_db, d.error_db)
    assert [why.converged for why in back.provenance] == [True, False]
    assert "NaN" not in (tmp_path / "summary.json").read_text()


def test_noise_is_judged_by_the_power_that_is_seen():
    p = paths([9.0], [0.0], [1e-5], [TAIL])
    r = result(p, [(15.0, 0.0, 1e-8), (12.0, 0.0, 1e-8)], differ=[1e-4, 1.0])
    assert [why.bodies for why in r.provenance] == ["noise", "noise"]
    assert r.detections.converged.tolist() == [True, False]


def test_counts_are_of_those_that_are_figures(half):
    found = half.detections
    assert counts(found, 3.0) == {
        "reached_db": found.error_db[0], "over_tolerance": 0, "not_converged": 1, "folded": 0,
    }  # fmt: skip
    assert counts(found, 1e-3)["over_tolerance"] == 1
    assert marks(found) == ", 1 not converged"
    none = result(paths([], [], [], []), []).detections
    assert counts(none, 1.0)["reached_db"] == 0.0 and marks(none) == ""


def test_what_is_not_converged_is_warned_of_with_what_would_help(half):
    (line,) = warned(half.detections, 0.5, half.rdmap)
    assert line.startswith("1 of 2 detections is not converged (number 2)")
    assert "a smaller tolerance than 0.5 dB (--tolerance, model.tolerance_db)" in line


def test_errors_above_the_tolerance_are_counted_as_such(half):
    assert noted(half.detections, 3.0, {}) == ["1 of 2 detections within the tolerance of 3 dB"]
    (line,) = noted(half.detections, 0.01, {})
    stated = half.detections.error_db[0]
    assert line == (
        "0 of 2 detections within the tolerance of 0.01 dB; above it is number 1, the largest error stated is "
        f"{stated:.1f} dB"
    )
    fine = result(paths([9.0], [0.0], [2e-5], [TAIL]), [(9.0, 0.0, 4e-10)], differ=0.0).detections
    assert noted(fine, 0.5, {}) == []


@pytest.mark.parametrize(
    ("stated", "tolerance", "shown"),
    [(0.5014, 0.5, "0.501"), (1.0261, 1.0, "1.03"), (1.26, 1.0, "1.3"), (0.50004, 0.5, "0.500040")],
)
def test_the_largest_error_never_looks_like_the_tolerance_that_it_exceeds(half, stated, tolerance, shown):
    found = half.detections.replace(error_db=[0.0, stated], converged=[True, True])
    (line,) = noted(found, tolerance, {})
    assert line.endswith(f"above it is number 2, the largest error stated is {shown} dB")


def test_only_what_the_ledger_puts_above_the_weakest_detection_is_listed(half):
    ledger = {
        "further bounces": Entry(18.7, "estimate", ""),
        "diffraction": Entry(2.4, "bound", ""),
        "diffuse scattering": Entry(37.8, "estimate", ""),
        "transmission": Entry(-3.0, "estimate", ""),
        "range migration": Entry("none", "exact", ""),
        "intra-frame motion": Entry(UNKNOWN, "none", ""),
    }
    known = half.detections.replace(error_db=[0.0, 0.0], converged=[True, True])
    above, below = noted(known, 3.0, ledger)
    assert above == (
        "left out, above the weakest detection: diffuse scattering +38 dB, further bounces +19 dB, "
        "diffraction at most +2 dB (see left_out in summary.json of raychan run)"
    )
    assert below == "left out, below the weakest detection but may move it by over 3 dB: transmission -3 dB"


def test_what_may_move_the_weakest_detection_by_more_than_the_tolerance_is_listed(half):
    known = half.detections.replace(error_db=[0.0, 0.0], converged=[True, True])
    # An echo 24.5 dB weaker that adds in phase moves a level by 0.5 dB: 20 log10(1 + 10^(-24.5 / 20)) = 0.503.
    for level, count in ((-24.4, 1), (-24.6, 0)):
        assert len(noted(known, 0.5, {"diffraction": Entry(level, "bound", "")})) == count


def test_the_table_lists_apart_what_is_not_converged_and_numbers_all(half, capsys):
    first, second = show.detections(half)
    assert first.title == "2 detections" and second.title == "1 of 2 detections: not converged, error unknown"
    assert [next(iter(t.columns[0].cells)).plain for t in (first, second)] == ["1", "2"]
    assert [c.header for c in first.columns].count("error dB") == 1
    assert [c.header for c in second.columns].count("error dB") == 0


def test_the_map_marks_them_hollow_and_the_legend_says_so(half, tmp_path):
    axes = drawing(3.0, 3.0).add_subplot()
    far = half.detections.replace(folded=[True, False])
    rdmap_picture(dataclasses.replace(half, detections=far), axes=axes)
    lines = {str(line.get_label()): line for line in axes.lines if not str(line.get_label()).startswith("_")}
    assert set(lines) == {"direct (1)", "multipath, not converged (1)", "folded, true place elsewhere (1)"}
    assert lines["multipath, not converged (1)"].get_markerfacecolor() == "none"
    assert lines["direct (1)"].get_markerfacecolor() != "none"
    assert lines["folded, true place elsewhere (1)"].get_xdata() == [9.0]
    with Image.open(rdmap_picture(half, tmp_path / "map.png")) as picture:
        assert picture.width > 1000


def test_a_run_says_what_its_ledger_puts_above_its_weakest_detection(tmp_path, capsys):
    scene, out = tmp_path / "road.toml", tmp_path / "out"
    road = '[[bodies]]\nname = "road"\nshape = "ground"\nmaterial = "asphalt"\n'
    weak = walker(10.0, 1.0).replace("rcs_dbsm = 0.0", "rcs_dbsm = -10.0")
    scene.write_text(ISOTROPIC.replace("power_dbm = 30.0", "power_dbm = 40.0") + weak + road)
    assert invoke(["run", str(scene), "--out", str(out), "--no-pictures"]) == 0
    said = capsys.readouterr()
    told = json.loads((out / "summary.json").read_text())
    above = {k: v["level_db"] for k, v in told["left_out"].items() if isinstance(v["level_db"], float)}
    above = {k: level for k, level in above.items() if level >= 0.5}
    assert "diffuse scattering" in above
    (line,) = (x for x in said.out.splitlines() if x.startswith("left out, above the weakest detection"))
    assert line in told["warnings"] and line not in said.err
    assert all(f"{name} " in line and f"{level:+.0f} dB" in line for name, level in above.items())
    assert line.count(" dB") == len(above)
    assert summary(load_result(out))["warnings"] == told["warnings"]


def test_studies_print_no_figure_for_an_unknown_error():
    seen = Seen(9.0, 0.0, 0.0, 30.0, math.nan, "direct", "suv")
    step = Step((1.0,), seen, Visibility("suv", Occlusion(0.0, None, None, 0.0, (), None), {}, ()), 20.0)
    assert cells(step)[:8] == ["yes", "direct", "9.0000", "0.0000", "0.0000", "30.00", "", "suv"]
    assert Echo(9.0, 30.0, math.nan).text() == "9.00 m, 30.0 dB ± ?"
