"""Explain by detection and by path: what is listed adds up to what the map shows."""

from __future__ import annotations

import numpy as np
import pytest
from support.results import paths, result
from support.scene_texts import ISOTROPIC, upright, walker

import raychan as rc
from raychan.cli import invoke
from raychan.records import REFLECT, SCATTER
from raychan.run.explain import explain
from raychan.run.storage import load_result
from raychan.view.drawing import rays_in

TAIL, GHOST = [(1, SCATTER)], [(2, REFLECT), (3, SCATTER)]
CELL = 0.149896  # of records.WAVE


@pytest.fixture(scope="module", params=["I/Q", "real"])
def ran(request, tmp_path_factory):
    """Return a ghost scene without noise, a house nearer than the fold and, with real sampling, one mirrored."""
    folder = tmp_path_factory.mktemp("cell")
    text = ISOTROPIC.replace("power_dbm = 30.0", "power_dbm = 30.0\nnoise = false")
    if request.param == "real":
        text = text.replace("samples = 256", "samples = 128\niq = false")
    (folder / "s.toml").write_text(text + upright("house", 13.5, 0.5) + walker(8.0, 1.0))
    out = folder / "out"
    assert invoke(["run", str(folder / "s.toml"), "--out", str(out), "--no-pictures"]) == 0
    return load_result(out), out


def test_the_paths_of_a_cell_add_up_to_the_level_of_the_map(ran):
    r, _ = ran
    for number in range(1, min(5, len(r.detections.range)) + 1):
        why = explain(r, detection=number)
        level = r.rdmap.power[tuple(r.detections.cell[number - 1])]
        assert abs(why.paths.wave.sum()) ** 2 == pytest.approx(level, rel=2e-2)
        assert why.predicted == pytest.approx(level, rel=2e-2)
        assert len(why.paths.row) == len(r.paths.delay)
        assert (np.diff(np.abs(why.paths.wave)) <= 0.0).all()


def test_a_paths_own_figures_are_those_of_the_result(ran):
    r, _ = ran
    told = explain(r, detection=1).paths
    mine = r.paths.amplitude[told.row]
    assert np.exp(1j * told.phase) == pytest.approx(mine / np.abs(mine))
    assert told.power == pytest.approx(np.abs(mine) ** 2 * r.receiver.power)
    assert told.rate == pytest.approx(r.paths.range_rate[told.row])
    away = r.paths.departure[told.row].astype(float)
    azimuth, elevation = told.departure.T
    assert np.cos(elevation) * np.cos(azimuth) == pytest.approx(away[:, 0], abs=1e-6)
    assert np.sin(elevation) == pytest.approx(away[:, 2], abs=1e-6)
    look = r.paths.arrival[told.row]
    assert np.cos(told.arrival[:, 1]) * np.sin(told.arrival[:, 0]) == pytest.approx(look[:, 1], abs=1e-6)
    used = (r.paths.kind[told.row] > 0).sum(axis=1)
    assert (told.interactions == used).all()  # no layer is passed here
    for chain, met in zip(told.chains, told.met, strict=True):
        assert [word.split(" ", 1)[1] for word in met] == list(chain)


def test_a_single_path_has_the_phase_of_its_way():
    p = paths([9.0], [0.0], [2e-5 * np.exp(0.7j)], [GHOST])
    told = explain(result(p, [(9.0, 0.0, 4e-10)]), detection=1).paths
    assert told.phase[0] == pytest.approx(0.7)
    assert told.power[0] == pytest.approx(4e-10) == pytest.approx(abs(told.wave[0]) ** 2, rel=0.05)
    assert told.met == (("reflect truck.tail", "scatter walker"),)
    assert told.departure[0].tolist() == [0.0, 0.0]


@pytest.fixture
def several():
    where = [(9.0, -7.0, 1e-10), (9.0, 0.0, 4e-10), (9.1, 3.0, 1e-11), (12.0, 0.0, 1e-9)]
    rows = np.array(where)
    return result(paths(rows[:, 0], rows[:, 1], np.sqrt(rows[:, 2]), [TAIL, GHOST, TAIL, TAIL]), where)


@pytest.mark.parametrize(
    ("place", "taken", "others"),
    [
        ({"detection": 1}, 1, ()),
        ({"detection": 4}, 4, ()),
        ({"range": 9.0}, 2, (1, 3)),  # of equally near ones the strongest
        ({"range": 9.11}, 3, (2, 1)),
        ({"range": 9.0, "speed": 0.0}, 1, ()),  # with the ego speed of 7 m/s taken out
        ({"range": 12.1}, 4, ()),
        ({"range": 12.0 + 1.1 * CELL}, 0, ()),
        ({"range": 12.0, "cell": True}, 0, ()),
        ({"range": 9.0, "speed": 20.0}, 0, ()),
    ],
)
def test_the_detection_asked_for_or_the_nearest_within_a_cell_is_taken(place, taken, others, several):
    why = explain(several, **place)
    assert (why.detection, why.others) == (taken, others)
    if taken:
        d = several.detections
        assert (why.range, why.rate, why.power) == (d.range[taken - 1], d.rate[taken - 1], d.power[taken - 1])
        assert why.label == several.provenance[taken - 1].label


def test_of_detections_a_period_of_the_map_apart_the_one_of_that_speed_is_taken():
    period = 2.0 * 24.3
    where = [(9.0, 0.0, 1e-10), (9.0, period, 4e-10)]
    r = result(paths([9.0, 9.0], [0.0, period], [1e-5, 2e-5], [TAIL, TAIL]), where)
    for number, speed in ((1, 7.0), (2, 7.0 + period)):
        why = explain(r, 9.0, speed)
        assert (why.detection, why.others) == (number, ())


@pytest.fixture(scope="module")
def unfolded(tmp_path_factory):
    """Return a stored run of staggered ramps, which unfold the rate of a walker at 61 m/s."""
    folder = tmp_path_factory.mktemp("staggered")
    wave = "bandwidth_mhz = 300.0\nchirp_us = 30.0\nchirps = 48\nsamples = 64\nstagger_us = [37.0, 49.0, 55.0]\n"
    radar = f'[radar]\npower_dbm = 30.0\nantenna = {{ kind = "isotropic" }}\n[radar.waveform]\n{wave}'
    (folder / "s.toml").write_text(radar + walker(17.0, 0.0) + "velocity_mps = [61.0, 0.0, 0.0]\n")
    assert invoke(["run", str(folder / "s.toml"), "--out", str(folder / "out"), "--no-pictures"]) == 0
    return load_result(folder / "out"), folder / "out"


def test_an_unfolded_detection_is_found_by_the_range_and_speed_that_it_prints(unfolded, tmp_path, capsys):
    r, out = unfolded
    d = r.detections
    assert d.speed[0] > 2.0 * r.rdmap.unambiguous_rate
    assert rc.explain(r, range=float(d.range[0]), speed=float(d.speed[0])).detection == 1
    place = ["--range", f"{d.range[0]:.2f}", "--speed", f"{d.speed[0]:.2f}"]
    capsys.readouterr()
    assert invoke(["explain", str(out), *place]) == 0
    assert capsys.readouterr().out.startswith(f"detection 1: {d.range[0]:.2f} m, range rate {d.rate[0]:+.2f} m/s")
    assert invoke(["view", str(out), *place, "--html", str(tmp_path / "v.html")]) == 0
    assert f"{d.range[0]:.2f} m, {d.speed[0]:+.2f} m/s" in (tmp_path / "v.html").read_text()


def test_an_explanation_has_the_place_of_its_detection(unfolded):
    r, _ = unfolded
    d = r.detections
    assert abs(d.range[0] - r.rdmap.range[d.cell[0, 1]]) > 0.2  # its cell stands where its Doppler shift moves it
    for i, why in enumerate(r.provenance):
        assert (why.range, why.rate, why.speed) == (d.range[i], d.rate[i], d.speed[i])
    told = explain(r, detection=1)
    assert told.range == d.range[0]
    assert abs(told.paths.wave.sum()) ** 2 == pytest.approx(told.predicted, rel=1e-2)
    assert [ray.name for ray in rays_in(r, told)] == ["walker"]


def test_the_very_cell_is_taken_where_told(several):
    why = explain(several, 9.02, 5.3, cell=True)
    m = several.rdmap
    assert why.range == m.range[np.argmin(abs(m.range - 9.02))]
    assert why.rate == m.rate[np.argmin(abs(m.rate - (5.3 - 7.0)))]
    assert why.power == m.power[np.argmin(abs(m.rate - (5.3 - 7.0))), np.argmin(abs(m.range - 9.02))]


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ({}, "either a range or the number"),
        ({"range": 9.0, "detection": 1}, "either a range or the number"),
        ({"detection": 0}, "no detection has the number 0: they are numbered from 1 to 4"),
        ({"detection": 5}, "no detection has the number 5"),
        ({"detection": 1, "speed": 3.0}, "stands alone"),
        ({"detection": 1, "cell": True}, "stands alone"),
        ({"range": float("nan")}, "range = nan: must be finite"),
        ({"range": 9.0, "speed": float("inf")}, "speed = inf: must be finite"),
        ({"range": "22"}, "range = '22': must be finite, a number"),
        ({"range": True}, "range = True: must be finite, a number"),
        ({"range": [1, 2]}, r"range = \[1, 2\]: must be finite, a number"),
        ({"detection": "1"}, "detection = '1': must be a whole number"),
        ({"detection": True}, "detection = True: must be a whole number"),
        ({"range": 9.0, "cell": "yes"}, "cell = 'yes': must be true or false"),
    ],
)
def test_what_cannot_be_explained_is_told(place, words, several):
    with pytest.raises(ValueError, match=words):
        rc.explain(several, **place)


def test_the_command_says_which_it_took_and_lists_paths(ran, capsys):
    r, out = ran
    first = r.detections.range[0]
    assert invoke(["explain", str(out), "--range", f"{first + 0.05:.3f}", "--paths", "2"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("detection 1") and "2 of " in said and "weaker ones add up to" in said
    assert "departs deg" in said and "scatter house" in said
    assert invoke(["explain", str(out), "--detection", "1", "--paths", "0"]) == 0
    assert "departs deg" not in capsys.readouterr().out
    assert invoke(["explain", str(out), "--range", f"{first:.3f}", "--cell"]) == 0
    assert capsys.readouterr().out.startswith("map cell: ")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "either a range"),
        (["--detection", "99"], "no detection has the number 99"),
        (["--detection", "-1"], "no detection has the number -1"),
        (["--range", "nan"], "range = nan: must be finite"),
        (["--range", "9", "--speed", "nan"], "speed = nan: must be finite"),
        (["--cell", "--detection", "1"], "stands alone"),
        (["--range", "9", "--paths", "-1"], "--paths"),
    ],
)
def test_a_bad_question_ends_with_2_and_no_traceback(options, words, ran, capsys):
    assert invoke(["explain", str(ran[1]), *options]) == 2
    said = capsys.readouterr()
    assert words in said.err and "Traceback" not in said.err and not said.out
