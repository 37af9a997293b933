"""Folding against closed forms: where an echo shows, and where it truly is."""

from __future__ import annotations

import csv
import dataclasses
import math

import numpy as np
import pytest
from support.echoes import SMALL, make_radar
from support.results import paths, receiver, result
from support.scene_texts import ISOTROPIC, upright, walker

from raychan.cli import invoke
from raychan.processing.detection import detect
from raychan.processing.range_doppler import range_doppler
from raychan.records import SCATTER
from raychan.run.explain import explain
from raychan.run.explanation.folding import aliased
from raychan.run.explanation.labels import chains, explain_cell, provenance, response_of
from raychan.run.messages.results import warned
from raychan.run.result import ExplainedDetections
from raychan.signal.baseband import synthesize
from raychan.units import C0

SUV, WALKER = 1, 3
REAL = dataclasses.replace(SMALL, complex_sampling=False)
CELL = SMALL.range_resolution
TOP = C0 / (4.0 * SMALL.middle * SMALL.repetition)  # unambiguous rate of the map
LINE = 2.0 * TOP / SMALL.n_chirps


def seen(wave, ranges, rates, amplitudes=1e-5, window="hann"):
    """Return detections, plain and explained, of point echoes at ranges [m] at mid frame with rates [m/s]."""
    r, v, a = np.broadcast_arrays(np.atleast_1d(np.asarray(ranges, float)), rates, amplitudes)
    p = paths(r - v * wave.centre, v, a, [[(SUV, SCATTER)]] * len(r))
    rdmap = range_doppler(synthesize(p, make_radar(wave)), wave, window, window)
    found = detect(rdmap, min_snr_db=20.0, method="ca", waveform=wave, windows=(window, window))
    rx = dataclasses.replace(receiver(window), waveform=wave)
    return ExplainedDetections.of(found, provenance(p, rdmap, found, rx, 0.0 * rdmap.power))


def shown(wave, r, v):
    """Range and rate at which a point echo shows, by the closed form of undersampling."""
    period = wave.range_resolution * wave.n_samples
    slow = (v + TOP) % (2.0 * TOP) - TOP
    # A folded rate leaves what its alias lacks in the beat.
    at = r + (v - slow) * wave.middle / wave.slope
    if wave.complex_sampling or at % period < 0.5 * period:
        return at % period, slow
    return -at % period, -slow


@pytest.mark.parametrize("window", ["hann", "rect"])
@pytest.mark.parametrize("ambiguities", [0, 1, 3])
@pytest.mark.parametrize("folds", [0, -1, 1, 4])
def test_an_echo_ambiguities_away_is_folded_and_told_truly(ambiguities, folds, window):
    r = 11.37 + ambiguities * SMALL.unambiguous_range
    v = 6.41 + 2.0 * TOP * folds
    d = seen(SMALL, r, v, window=window)
    at, slow = shown(SMALL, r, v)
    # A mover spreads over as many cells of rate as of range that it crosses within the frame.
    smear = 0.5 * abs(v) * SMALL.frame_duration / CELL
    # Across several cells without a taper its response has ripples of equal height, each a peak: any may be the first.
    equal = np.flatnonzero(d.power > 0.97 * d.power[0])
    k = equal[np.abs(d.range[equal] - at).argmin()]
    assert d.range[k] == pytest.approx(at, abs=0.3 * CELL)
    assert d.rate[k] == pytest.approx(slow, abs=(0.3 + smear) * LINE)
    assert d.folded[k] == bool(ambiguities or folds)
    assert (d.true_range[k], d.true_rate[k]) == (pytest.approx(r, abs=1e-6), pytest.approx(v, abs=1e-9))


@pytest.mark.parametrize("halves", [0, 1, 2, 3, 6])
@pytest.mark.parametrize("folds", [0, -1, 2])
def test_real_sampling_mirrors_every_other_ambiguity_and_its_rate(halves, folds):
    half = REAL.unambiguous_range
    r = 3.21 + halves * half
    v = 6.41 + 2.0 * TOP * folds
    d = seen(REAL, r, v)
    at, slow = shown(REAL, r, v)
    assert (d.range[0], d.rate[0]) == (pytest.approx(at, abs=0.3 * CELL), pytest.approx(slow, abs=0.3 * LINE))
    assert d.folded[0] == bool(halves or folds)
    assert (d.true_range[0], d.true_rate[0]) == (pytest.approx(r, abs=1e-6), pytest.approx(v, abs=1e-9))


@pytest.mark.parametrize("iq", [True, False])
def test_within_a_cell_of_the_border_folded_says_whether_the_place_shown_is_the_true_one(iq):
    rng = np.random.default_rng(5)
    wave = SMALL if iq else REAL
    period, marked = CELL * wave.n_samples, set()
    for _ in range(40):
        r = max(0.3 * CELL, rng.integers(0, 3) * wave.unambiguous_range + rng.uniform(-1, 1) * CELL)
        v = rng.choice([0.4, 1.0, -1.0, 3.0]) * TOP + rng.uniform(-1, 1) * LINE
        d = seen(wave, r, v)
        assert (d.true_range[0], d.true_rate[0]) == (pytest.approx(r, abs=1e-6), pytest.approx(v, abs=1e-9))
        assert abs(d.rate[0]) <= TOP * (1.0 + 1e-12)
        off_r, off_v = abs(d.range[0] - r), abs(d.rate[0] - v)
        marked.add(bool(d.folded[0]))
        if not d.folded[0]:
            assert off_r < 2.0 * CELL and off_v < 1.5 * LINE
        else:
            mirrored = not iq and abs((d.rate[0] + v + TOP) % (2.0 * TOP) - TOP) < 2.0 * LINE
            assert off_r > 0.5 * period or off_v > TOP or mirrored
    assert marked == {True, False}


def test_no_echo_within_the_ambiguities_is_folded():
    rng = np.random.default_rng(6)
    for wave in (SMALL, REAL):
        r = rng.uniform(1.0, wave.unambiguous_range - 4.0 * CELL, 12)
        v = rng.uniform(-1.0, 1.0, 12) * (TOP - 3.0 * LINE)
        d = seen(wave, r, v, 10.0 ** rng.uniform(-5, -4, 12))
        echoes = d.power > 1e-11  # no side lobe of a mirror image
        assert echoes.sum() > 6 and not d.folded[echoes].any()
        near = np.min(np.hypot((d.true_range[:, None] - r) / CELL, (d.true_rate[:, None] - v) / LINE), axis=1)
        assert (near[echoes] < 0.8).all()


def test_the_stronger_of_two_echoes_that_alias_to_one_cell_is_the_one_told():
    far = 11.37 + SMALL.unambiguous_range
    for strong, weak in ((far, 11.37), (11.37, far)):
        d = seen(SMALL, [strong, weak], 5.0, [2e-5, 1e-5])
        assert d.true_range[0] == pytest.approx(strong, abs=1e-6)
        assert d.folded[0] == (strong == far)


def test_a_folded_peak_of_the_profile_is_told_too():
    r = 11.37 + 2.0 * SMALL.unambiguous_range
    p = paths([r], [0.0], [1e-5], [[(SUV, SCATTER)]])
    rx = dataclasses.replace(receiver(), waveform=SMALL)
    why = explain_cell(p, chains(p, ()), response_of(rx), rx, 11.37, None, 1e-10)
    assert why.folded and why.true_range == pytest.approx(r)


def test_noise_has_no_true_place_and_is_not_folded():
    p = paths([5.0], [0.0], [1e-5], [[(SUV, SCATTER)]])
    rx = dataclasses.replace(receiver(), waveform=SMALL)
    why = explain_cell(p, chains(p, ()), response_of(rx), rx, 12.0, 3.0, 1.0)
    assert math.isnan(why.true_range) and math.isnan(why.true_rate) and not why.folded


def rows_of(folder):
    with open(folder / "detections.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_a_target_beyond_range_and_rate_is_told_by_the_run_its_table_and_its_files(tmp_path, capsys):
    # 256 cells of 0.15 m: 38.37 m; 24.3 m/s.
    text = ISOTROPIC + walker(60.0, 0.0) + "velocity_mps = [-60.0, 0.0, 0.0]\n" + upright("house", 9.0, 0.0)
    text = text.replace("position = [9.0, 0.0, 1.0]", "position = [9.0, 3.0, 1.0]")
    scene, out = tmp_path / "far.toml", tmp_path / "out"
    scene.write_text(text.replace("power_dbm = 30.0", "power_dbm = 60.0"))
    assert invoke(["run", str(scene), "--out", str(out), "--seed", "1", "--no-pictures"]) == 0
    said = capsys.readouterr()
    rows = rows_of(out)
    held = next(i for i, row in enumerate(rows) if row["bodies"].startswith("walker"))
    walking, rest = rows[held], [row for row in rows if row["bodies"] == "house"]
    assert walking["folded"] == "true" and walking["label"] == "direct"
    centre = 0.5 * 32 * 40e-6
    assert float(walking["true_range_m"]) == pytest.approx(60.0 - 60.0 * centre, abs=0.1)
    assert float(walking["true_range_rate_mps"]) == pytest.approx(-60.0, abs=0.1)
    assert float(walking["range_m"]) == pytest.approx((60.0 - 60.0 * centre) % 38.37, abs=0.3)
    assert rest and all(row["folded"] == "false" for row in rest)
    line = next(x for x in said.err.splitlines() if "folded" in x)
    assert f"number {held + 1} is at {float(walking['true_range_m']):.2f} m, -60.0" in line
    assert "folded: true m" in said.out
    assert explain(out, detection=held + 1).true_rate == pytest.approx(-60.0, abs=0.1)
    assert invoke(["explain", str(out), "--detection", str(held + 1)]) == 0
    assert "folded: truly at 59.9" in capsys.readouterr().out


def test_only_what_is_folded_is_warned_of():
    rdmap = range_doppler(synthesize(paths([9.0], [0.0], [1.0], [[]]), make_radar(SMALL)), SMALL)
    d = seen(SMALL, [9.0, 15.0 + SMALL.unambiguous_range], 3.0, [2e-5, 1e-5])
    (line,) = warned(d, 0.5, rdmap)
    assert line.startswith("1 of 2 detections is folded (number 2): beyond 19.19 m or 24.18 m/s")
    assert warned(seen(SMALL, [9.0, 15.0], 3.0, [2e-5, 1e-5]), 0.5, rdmap) == []


@pytest.mark.parametrize(
    ("wave", "at", "far", "folded"),
    [
        (SMALL, 11.0, 0.0, False),
        (SMALL, 11.2 + SMALL.unambiguous_range, 0.2, True),
        (SMALL, -11.0 + 2.0 * SMALL.unambiguous_range, 22.0 - SMALL.unambiguous_range, True),
        (REAL, 2.0 * REAL.unambiguous_range - 11.1, 0.1, True),
        (REAL, 11.0 + 6.0 * REAL.unambiguous_range, 0.0, True),
    ],
)
def test_the_nearest_alias_in_range_is_told_where_rates_are_unknown(wave, at, far, folded):
    rx = dataclasses.replace(receiver(), waveform=wave)
    away, other = aliased(np.array([at]), 11.0, response_of(rx))
    assert away[0] == pytest.approx(abs(far), abs=1e-9) and other[0] == folded


def test_the_leading_chain_stands_where_the_true_range_is():
    """One rule: power-weighted over the paths of the chain that feed the cell; chains that do not lead too."""
    p = paths([9.0, 9.1, 9.2], [0.0] * 3, [3e-5, 1e-5, 1e-5], 3 * [[(SUV, SCATTER)]])
    why = explain(result(p, [(9.0, 0.0, 9e-10)]), 9.0)
    assert why.contributions[0].range == why.true_range
    assert why.contributions[0].rate == why.true_rate
