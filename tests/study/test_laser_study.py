"""Range errors by sensor errors: slopes are differences, first order holds for small ones, curves are closed forms."""

from __future__ import annotations

import csv
import dataclasses

import numpy as np
import pytest

from raychan.cli import invoke
from raychan.sensors.laser import NO_BODY, SEA, SensorPoses, scan
from raychan.study import laser_detection, laser_errors
from raychan.study.laser_deck import POSE, ranges, slopes, standing, stratified
from raychan.study.laser_errors import ALL, LEVELS, SOURCES, UNITS, departures, effects, harbour, skew


@pytest.fixture(scope="module")
def made():
    return effects(draws=400, seed=1)


def test_ranges_at_many_poses_are_those_of_a_scan_at_each():
    deck, rng = harbour(), np.random.default_rng(0)
    deck = dataclasses.replace(deck, scanner=dataclasses.replace(deck.scanner, moving=False))
    poses = deck.pose + 0.05 * rng.normal(size=(5, 6))
    found, body = ranges(deck, poses)
    for k, (roll, pitch, yaw, *place) in enumerate(poses):
        n, t = deck.scanner.count, deck.targets
        still = SensorPoses(
            position=np.tile(place, (n, 1)), yaw=np.full(n, yaw), pitch=np.full(n, pitch), roll=np.full(n, roll)
        )
        one = scan(deck.scanner, still, t.caster, t.reflectivity, t.sea_reflectivity)
        np.testing.assert_allclose(found[k], one.range, atol=1e-12)
        np.testing.assert_array_equal(body[k], one.body)


def test_slopes_are_central_differences_of_the_ranges():
    deck = harbour()
    deck = dataclasses.replace(deck, pose=deck.pose + np.array([0.0, 0.02, 0.03, 0.3, 0.2, 0.1]))
    steep, h = slopes(deck), 1e-6
    (_,), (body,) = ranges(deck, deck.pose[None])
    assert (body == SEA).sum() > 50 and (body == 0).sum() > 10
    for k in range(6):
        step = h * np.eye(6)[k]
        found, of = ranges(deck, deck.pose + np.array([-1.0, 1.0])[:, None] * step)
        whole = (of == body).all(axis=0) & (body != NO_BODY)
        np.testing.assert_allclose(
            (found[1][whole] - found[0][whole]) / (2.0 * h), steep[whole, k], rtol=1e-5, atol=1e-4
        )
    assert np.isnan(steep[body == NO_BODY]).all()


def test_slope_of_the_sea_abeam_by_roll_is_range_over_the_tangent():
    assert slopes(harbour())[0, POSE.index("roll")] == pytest.approx(
        -5.0 / np.sin(np.radians(10.0)) / np.tan(np.radians(10.0))
    )


def test_stratified_draws_have_the_moments_of_a_standard_normal():
    z = stratified(1000, np.random.default_rng(0))
    assert (
        abs(z.mean()) < 2e-3
        and z.std() == pytest.approx(1.0, abs=3e-3)
        and (z**4).mean() == pytest.approx(3.0, rel=0.03)
    )


def test_first_order_is_monte_carlo_for_small_errors_and_departs_for_large_ones(made):
    for e in made:
        if e.source != ALL and e.sigma == LEVELS[e.unit][0] and e.first_order > 0.0:
            assert e.ratio == pytest.approx(1.0, abs=0.02), e
    apart = departures(made)
    assert apart["sea", "pitch"] == pytest.approx(0.63, abs=0.01)
    assert apart["sea", "roll"] == pytest.approx(5.0)
    assert apart["quay", "roll"] is None
    # What does not change the plane that a beam meets, in the direction of its normal, has no effect.
    assert {s for b, s in apart if b == "sea"} == {"roll", "pitch", "z", "delay"}
    assert {s for b, s in apart if b == "quay"} == {"roll", "pitch", "yaw", "x", "y", "delay"}


def test_typical_errors_together_are_those_of_the_documentation(made):
    found = {e.body: e.monte_carlo for e in made if e.source == ALL}
    assert found == {"sea": pytest.approx(5.8, abs=0.3), "quay": pytest.approx(1.6, abs=0.1)}
    assert departures(made)["quay", "yaw"] == pytest.approx(0.63, abs=0.01)


def test_the_mean_error_on_the_sea_abeam_is_the_second_orders():
    """R = h / sin(phi): mean of r(phi + e) - r is r'' s^2 / 2 = r (1 / 2 + cot^2 phi) s^2."""
    deck, sigma = harbour(), np.radians(0.5)
    off = laser_errors.pose_errors(deck, "roll", sigma * stratified(20_000, np.random.default_rng(0)))
    found = ranges(deck, deck.pose + off)[0][:, 0]
    r, cot = 5.0 / np.sin(np.radians(10.0)), 1.0 / np.tan(np.radians(10.0))
    assert found.mean() - r == pytest.approx(r * (0.5 + cot**2) * sigma**2, rel=0.02)


def test_all_together_is_the_root_of_the_sum_of_squares_in_first_order(made):
    for body in ("sea", "quay"):
        whole = next(e for e in made if e.body == body and e.source == ALL)
        parts = []
        for s in SOURCES:
            least = next(e for e in made if e.body == body and e.source == s)
            parts.append(least.first_order * laser_errors.TYPICAL[s] / least.sigma)
        assert whole.first_order == pytest.approx(np.sqrt(np.sum(np.square(parts))), rel=1e-9)


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0, 4.0])
def test_a_late_record_errs_by_rate_times_delay(rate):
    """C099: within 10 %, up to 0.2 s."""
    seen, first = skew(rate, np.linspace(0.02, 0.2, 10))
    np.testing.assert_allclose(seen, first, rtol=0.1)
    np.testing.assert_allclose(skew(rate, np.array([1e-5]))[0], skew(rate, np.array([1e-5]))[1], rtol=1e-4)
    assert (np.diff(seen) > 0.0).all()


def test_equal_seeds_give_equal_effects(made):
    again = effects(draws=400, seed=1)
    assert [e for e in again if e.source != ALL] == [e for e in made if e.source != ALL]


def test_detection_falls_with_the_amplitude_as_the_closed_form_says():
    """C100: a tower 40 m off; the share of a sine's time below e / A."""
    rng, deck = np.random.default_rng(0), laser_detection.tower(90.0)
    amplitude = np.array([2.0, 6.0, 8.0, 10.0, 14.0, 20.0])
    found = [laser_detection.probability(deck, a, 0.0, 400, rng) for a in amplitude]
    np.testing.assert_allclose(found, laser_detection.abeam_in_closed_form(amplitude), atol=0.02)
    assert found[0] == found[1] == 1.0 and (np.diff(found[1:]) < 0.0).all()


def test_a_target_ahead_is_lost_by_pitch_and_not_by_roll():
    rng, deck = np.random.default_rng(0), laser_detection.tower(0.0)
    assert laser_detection.probability(deck, 20.0, 0.0, 100, rng) == 1.0
    assert laser_detection.probability(deck, 0.0, 20.0, 400, rng) == pytest.approx(0.23, abs=0.02)


def test_the_command_writes_tables_and_figures(tmp_path, capsys):
    assert invoke(["study", "laser", "--out", str(tmp_path / "out"), "--draws", "20", "--scans", "10"]) == 0
    assert "first order" in capsys.readouterr().out
    rows = list(csv.DictReader((tmp_path / "out" / "laser_errors.csv").read_text().splitlines()))
    assert len(rows) == 2 * (sum(len(LEVELS[UNITS[s]]) for s in SOURCES) + 1)
    assert {r["source"] for r in rows} == {*SOURCES, ALL} and {r["body"] for r in rows} == {"sea", "quay"}
    found = list(csv.DictReader((tmp_path / "out" / "laser_detection.csv").read_text().splitlines()))
    assert len(found) == 3 * 21 + 3 * 20 + 100
    assert all(0.0 <= float(r["probability"]) <= 1.0 for r in found)
    assert len(list((tmp_path / "out").glob("*.png"))) == 4


@pytest.mark.parametrize("wrong", [["--draws", "1"], ["--scans", "0"], ["--draws", "many"]])
def test_the_command_refuses_what_it_cannot_do(tmp_path, wrong):
    assert invoke(["study", "laser", "--out", str(tmp_path / "out"), *wrong]) == 2
    assert not (tmp_path / "out").exists()


def test_slopes_on_waves_are_refused():
    from raychan.sensors.sea import SeaState, waves

    sea = waves(SeaState(1.0, 5.0), np.random.default_rng(0))
    deck = dataclasses.replace(harbour(), targets=dataclasses.replace(standing([], 0.5, 1.0), waves=sea))
    with pytest.raises(ValueError, match="flat sea"):
        slopes(deck)
