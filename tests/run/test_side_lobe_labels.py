"""Detections and cells that no echo's main lobe reaches are side lobes, whatever feeds them; all others are not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from support.results import WAVE, paths, receiver

import raychan as rc
from raychan.run.explanation.labels import chains, explain_cell, response_of

SUV = [(1, 4)]
CELL, RATE = WAVE.range_resolution, WAVE.rate_resolution
ENDS = {"rect": 1.0, "hann": 2.0, "blackman": 3.0}  # nulls of cosine sums


def label(p, away, apart, name="hann", wave=WAVE, place=(9.0, 0.0)):
    """Return the label of a cell so many resolution cells from a place."""
    rx = dataclasses.replace(receiver(name), waveform=wave)
    at = place[0] + away * wave.range_resolution, place[1] + apart * wave.rate_resolution
    return explain_cell(p, chains(p, rx.background), response_of(rx), rx, *at, 1e-30).label


@pytest.mark.parametrize("iq", [True, False], ids=["I/Q", "real"])
@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize(("far", "fast"), [(0, 0), (1, 0), (0, -2)], ids=["in the map", "beyond", "fast"])
def test_an_echo_is_direct_up_to_the_null_of_its_window_and_a_side_lobe_beyond(name, far, fast, iq):
    wave = dataclasses.replace(WAVE, complex_sampling=iq)
    at, rate = 3.0 + far * CELL * wave.n_samples, fast * RATE * wave.n_chirps
    # The frame's middle is where a map shows a mover, and rows are freed of their own shift, not of folds.
    moved = rate * wave.centre + rate * wave.middle / wave.slope
    echo, end = paths([at - moved], [rate], [1.0], [SUV]), ENDS[name]
    smear = 0.5 * abs(rate) * wave.frame_duration / CELL
    for step in (0.0, 0.9 * end, -0.9 * end):
        assert {label(echo, step, 0.0, name, wave, (3.0, 0.0)), label(echo, 0.0, step, name, wave, (3.0, 0.0))} == {
            "direct"
        }
    for step in (end + 0.4 + smear, 12.4, -9.5 if smear < 8.0 else 14.5):
        assert label(echo, step, 0.0, name, wave, (3.0, 0.0)) == "sidelobe"
        assert label(echo, 0.0, step, name, wave, (3.0, 0.0)) == "sidelobe"


def test_a_weak_echo_amid_side_lobes_counts_from_a_tenth_of_the_power_on():
    # In phase, 0.5 and 0.2 of the amplitude of the side lobe: a ninth and a thirty-sixth of the sum's power.
    rx = receiver("rect")
    strong = paths([6.0], [0.0], [1.0], [SUV])
    response = response_of(rx)
    at = 6.0 + 5.5 * CELL
    lobe = response.in_cell(strong.amplitude, strong.length / 299792458.0, np.zeros(1), at, 0.0)[0][0]
    own = response.in_cell(strong.amplitude, 2.0 * np.array([at]) / 299792458.0, np.zeros(1), at, 0.0)[0][0]
    for share, seen in ((0.5, "direct"), (0.2, "sidelobe")):
        both = paths([6.0, at], [0.0, 0.0], [1.0, share * lobe / own], [SUV, SUV])
        assert label(both, 5.5, 0.0, "rect", place=(6.0, 0.0)) == seen


def test_a_weak_echo_amid_stronger_side_lobes_of_another_body_is_named():
    rx, at, other = receiver("rect"), 6.0 + 5.5 * CELL, [(2, 4)]
    response = response_of(rx)
    places = 2.0 * np.array([6.0, at]) / 299792458.0
    lobe, own = response.in_cell(np.ones(2, complex), places, np.zeros(2), at, 0.0)[0]
    both = paths([6.0, at], [0.0, 0.0], [1.0, 0.7 * lobe / own], [SUV, other])
    why = explain_cell(both, chains(both, rx.background), response, rx, at, 0.0, 1e-30)
    assert (why.label, why.bodies) == ("direct", "truck.tail")
    assert why.true_range == pytest.approx(at)
    assert why.contributions[0].share < why.contributions[1].share


@pytest.mark.parametrize("noise", [False, True])
def test_side_lobes_of_a_bench_whose_legs_cancel_in_their_cell_are_named_where_no_noise_covers_them(noise):
    wave = {"bandwidth_mhz": 500.0, "chirp_us": 40.0, "chirps": 16, "samples": 64}
    given = {"name": "bench", "shape": "bench", "position": [7.23, -0.49, 0.0], "yaw_deg": -5.78}
    scene = {"radar": {"noise": noise, "waveform": wave}, "bodies": [given | {"velocity_mps": [-0.64, -0.22, 0.0]}]}
    found = rc.simulate(rc.Scene.from_dict(scene | {"model": {"max_bounces": 1, "tolerance_db": 1.0}}))
    away = np.abs(found.detections.range[:, None] - 0.5 * found.paths.length).min(axis=1)
    elsewhere = away > 2.25 * found.rdmap.range_resolution
    assert [why.label == "sidelobe" for why in found.provenance] == elsewhere.tolist()
    said = [x for x in found.warnings if "side lobe" in x]
    assert (len(elsewhere) - elsewhere.sum(), bool(elsewhere.any()), len(said)) == (2, not noise, not noise)
    for line in said:
        assert line.startswith(f"{elsewhere.sum()} of {len(elsewhere)} detections are side lobes")
        assert f"numbers {', '.join(map(str, np.flatnonzero(elsewhere)[:5] + 1))}" in line
