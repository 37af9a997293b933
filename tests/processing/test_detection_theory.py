"""Probability of detection: closed forms against each other, against published approximations, and against noise."""

import inspect

import numpy as np
import pytest
from scipy.special import gammainc
from support.echoes import SMALL, echoes, make_radar

import raychan as rc
from raychan.processing.cfar import Grid, factor, training
from raychan.processing.detection import detect
from raychan.processing.detection_theory import (
    Detector,
    albersheim,
    detection_probability,
    fluctuation,
    over_threshold,
    shnidman,
    simulated,
)
from raychan.processing.range_doppler import range_doppler
from raychan.signal.baseband import noisy, synthesize
from raychan.units import db, undb

CASES = (0, 1, 2, 3, 4)
DRAWS = 200_000


@pytest.mark.parametrize("looks", [1, 8])
@pytest.mark.parametrize("swerling", CASES)
@pytest.mark.parametrize("pd", [0.1, 0.5, 0.9])
def test_two_hundred_thousand_noise_draws_agree_within_a_hundredth(pd, swerling, looks):
    detector = Detector(pfa=1e-4, looks=looks)
    snr_db = np.interp(pd, detection_probability(grid := np.linspace(-15.0, 30.0, 451), detector, swerling), grid)
    found = simulated(snr_db, detector, swerling, DRAWS, np.random.default_rng(17))
    assert found == pytest.approx(detection_probability(snr_db, detector, swerling), abs=0.01)
    assert detection_probability(snr_db, detector, swerling) == pytest.approx(pd, abs=1e-3)


@pytest.mark.parametrize("swerling", CASES)
@pytest.mark.parametrize(("cfar", "looks"), [("ca", 1), ("os", 1), ("ca", 4), ("os", 4)])
def test_noise_draws_agree_with_training_cells_within_a_hundredth(cfar, looks, swerling):
    detector = Detector(pfa=1e-4, looks=looks, cfar=cfar, cells=24)
    for snr_db in (6.0, 12.0):
        found = simulated(snr_db, detector, swerling, DRAWS, np.random.default_rng(18))
        assert found == pytest.approx(detection_probability(snr_db, detector, swerling), abs=0.01)


@pytest.mark.parametrize("snr_db", [-10.0, 0.0, 13.0, 25.0])
@pytest.mark.parametrize("pfa", [1e-3, 1e-7, 1e-12])
def test_one_look_of_cases_1_and_2_is_a_power_of_the_false_alarms(snr_db, pfa):
    closed = pfa ** (1.0 / (1.0 + undb(snr_db)))
    for swerling in (1, 2):
        assert detection_probability(snr_db, Detector(pfa), swerling) == pytest.approx(closed, rel=1e-8, abs=1e-14)


@pytest.mark.parametrize("looks", [2, 10])
def test_swerlings_own_formulas_hold_for_cases_1_and_3(looks):
    # Swerling 1960; Richards 2014, table 6.1. That of case 3 is exact for one and two looks.
    snr, t = 3.0, np.array([5.0, 15.0, 30.0])
    s = looks * snr
    first = (
        1.0
        - gammainc(looks - 1, t)
        + (1.0 + 1.0 / s) ** (looks - 1) * gammainc(looks - 1, t / (1.0 + 1.0 / s)) * (np.exp(-t / (1.0 + s)))
    )
    assert over_threshold(snr, t, looks, 1) == pytest.approx(first, abs=1e-12)
    for n in (1, 2):
        half = 1.0 + 0.5 * n * snr
        third = (1.0 + 2.0 / (n * snr)) ** (n - 2) * (1.0 + t / half - 2.0 * (n - 2) / (n * snr)) * np.exp(-t / half)
        assert over_threshold(snr, t, n, 3) == pytest.approx(third, abs=1e-12)


@pytest.mark.parametrize("swerling", CASES)
@pytest.mark.parametrize("looks", [1, 3])
def test_without_a_target_a_detection_is_a_false_alarm(swerling, looks):
    for detector in (Detector(1e-5, looks), Detector(1e-5, looks, "ca", 20), Detector(1e-5, looks, "os", 20)):
        assert detection_probability(-400.0, detector, swerling) == pytest.approx(1e-5, rel=1e-3)


@pytest.mark.parametrize("cells", [8, 32])
def test_cfar_of_case_1_is_that_of_gandhi_and_kassam(cells):
    snr = np.array([1.0, 10.0, 100.0])
    scale = factor(1e-5, cells, "ca")
    mean = detection_probability(db(snr), Detector(1e-5, 1, "ca", cells), 1)
    assert mean == pytest.approx((1.0 + scale / cells / (1.0 + snr)) ** -cells, abs=5e-6)
    scale = factor(1e-5, cells, "os") / (1.0 + snr[:, None])
    i = np.arange(cells // 2)
    ordered = detection_probability(db(snr), Detector(1e-5, 1, "os", cells), 1)
    assert ordered == pytest.approx(np.prod((cells - i) / (cells - i + scale), axis=1), abs=5e-6)


def test_defaults_are_those_of_processing():
    assert Detector().pfa == rc.Processing().pfa
    assert inspect.signature(rc.doa).parameters["method"].default == rc.Processing().doa


def test_many_training_cells_are_known_noise():
    for swerling in CASES:
        known = detection_probability(11.0, Detector(1e-5), swerling)
        assert detection_probability(11.0, Detector(1e-5, 1, "ca", 1e7), swerling) == pytest.approx(known, abs=1e-4)


@pytest.mark.parametrize("looks", [1, 8, 1000])
@pytest.mark.parametrize("cells", [1e6, 1e9, 1e12, 1e15, 1e17, 1e18])
def test_however_many_training_cells_are_known_noise(cells, looks):
    snr_db = {1: 10.0, 8: 0.0, 1000: -10.0}[looks]
    known = detection_probability(snr_db, Detector(looks=looks))
    for cfar in ("ca", "os"):
        found = detection_probability(snr_db, Detector(looks=looks, cfar=cfar, cells=cells))
        assert found == pytest.approx(known, abs=100.0 / cells + 1e-10)


def test_the_factor_of_many_training_cells_continues_that_of_fewer():
    for looks in (1, 8, 100):
        few, many = (factor(1e-6, cells, "ca", looks) for cells in (9999.0, 10001.0))
        assert many == pytest.approx(few, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        *(({"cells": x}, f"Detector.cells = {x!r}: must be 1 or more") for x in (float("nan"), -1.0, 0.0)),
        *(
            ({"cells": x, "cfar": cfar}, r"Detector.cells = .*: a CFAR needs 1 to 1e\+18 training cells")
            for x in (float("nan"), 0.0, 1e-300, 0.5, 1e300, np.inf)
            for cfar in ("ca", "os")
        ),
        ({"cells": np.array([1, 2])}, "Detector.cells = array.*: a number is wanted"),
        ({"cells": 16}, "Detector.cells = 16.0: only with cfar = 'ca' or 'os', which learn the noise"),
        ({"cells": 10**400}, "Detector.cells = 1000.*: a number is wanted"),
        ({"min_snr_db": 2**70}, "Detector.min_snr_db = 1.18.*e.21: must be a number, at most 300 dB"),
        ({"looks": 10**7}, "Detector.looks = 10000000: must be a whole number from 1 on, to 1,000,000"),
        ({"cfar": np.array(["ca", "os"])}, "Detector.cfar = array.*: must be None or one of ca, os"),
    ],
)
def test_a_detector_that_cannot_be_is_told_where_it_is_declared(given, said):
    with pytest.raises(ValueError, match=said):
        Detector(**given)


def test_scalars_of_numpy_and_large_whole_numbers_make_a_detector():
    some = Detector(cfar="ca", cells=np.array(24), looks=np.float32(2), pfa=np.array(1e-4), min_snr_db=np.int64(3))
    assert some == Detector(cfar="ca", cells=24.0, looks=2, pfa=1e-4, min_snr_db=3.0)
    assert detection_probability(10.0, some) > 0.0
    assert detection_probability(10.0, Detector(cells=2**70)) == detection_probability(10.0)


@pytest.mark.parametrize("looks", [1, 10, 100])
@pytest.mark.parametrize("pfa", [1e-3, 1e-5, 1e-7])
def test_albersheim_is_within_a_third_of_a_decibel_where_it_is_meant_to_be_used(pfa, looks):
    wanted = np.array([0.4, 0.5, 0.9, 0.95])
    snr_db = albersheim(wanted, pfa, looks)
    fine = np.linspace(-15.0, 20.0, 3501)
    exact = np.interp(wanted, detection_probability(fine, Detector(pfa, looks)), fine)
    assert snr_db == pytest.approx(exact, abs=0.33)


@pytest.mark.parametrize("swerling", CASES)
@pytest.mark.parametrize("looks", [1, 10, 60])
def test_shnidman_is_within_half_a_decibel_of_the_exact_curves(looks, swerling):
    wanted = np.array([0.2, 0.5, 0.8, 0.9])
    fine = np.linspace(-15.0, 40.0, 2751)
    exact = np.interp(wanted, detection_probability(fine, Detector(1e-6, looks), swerling), fine)
    assert shnidman(wanted, 1e-6, looks, swerling) == pytest.approx(exact, abs=0.5)


def test_nine_tenths_at_one_in_a_million_take_13_and_21_decibels():
    assert albersheim(0.9, 1e-6) == pytest.approx(13.11, abs=0.01)
    # 10 log10(ln(1e-6) / ln(0.9) - 1)
    assert detection_probability(21.14, Detector(1e-6), 1) == pytest.approx(0.9, abs=1e-3)


@pytest.mark.parametrize("swerling", CASES)
def test_draws_of_the_rcs_have_the_mean_and_variance_of_their_case(swerling):
    found = fluctuation(swerling, 5, 200_000, np.random.default_rng(3))
    assert found.mean() == pytest.approx(1.0, abs=0.01)
    assert found.var() == pytest.approx((0.0, 1.0, 1.0, 0.5, 0.5)[swerling], abs=0.02)
    together = np.mean((found[:, 0] - 1.0) * (found[:, 1] - 1.0))
    assert together == pytest.approx((0.0, 1.0, 0.0, 0.5, 0.0)[swerling], abs=0.02)


@pytest.mark.parametrize("method", ["ca", "os"])
def test_the_detector_finds_a_steady_target_as_often_as_theory_says(method):
    """The whole chain: windows, padding, training cells on a correlated map, local maxima, least SNR."""
    radar = make_radar(SMALL, noise=True)
    runs, near = 300, 1.5
    at, rate = 40 * SMALL.range_resolution, 5 * SMALL.rate_resolution
    one = echoes([at], rate)
    quiet = synthesize(one, make_radar(SMALL, noise=False))
    empty = range_doppler(noisy(quiet, radar, np.random.default_rng(0)), SMALL)
    signal = range_doppler(quiet, SMALL).power.max()
    ring = training(Grid.of(empty), (2, 2), (3, 3))
    for snr_db in (10.0, 12.0):
        gain = np.sqrt(undb(snr_db) * empty.noise / signal)
        weak = quiet.replace(samples=(quiet.samples * gain).astype(np.complex64))
        rng, hits = np.random.default_rng(5), 0
        for _ in range(runs):
            found = detect(range_doppler(noisy(weak, radar, rng), SMALL), pfa=1e-4, min_snr_db=-100.0, method=method)
            away = np.hypot(
                (found.range - at - rate * SMALL.centre) / SMALL.range_resolution,
                (found.rate - rate) / SMALL.rate_resolution,
            )
            hits += bool((away < near).any())
        wanted = float(detection_probability(snr_db, Detector(1e-4, 1, method, ring.worth)))
        spread = np.sqrt(wanted * (1.0 - wanted) / runs)
        # A peak beside the true cell may stand higher: up to 0.06 more than theory, which has one cell.
        assert wanted - 3.0 * spread < hits / runs < wanted + 3.0 * spread + 0.06, (snr_db, hits / runs, wanted)


def test_bad_arguments_are_told():
    with pytest.raises(ValueError, match="swerling = 5"):
        detection_probability(10.0, Detector(), 5)
    with pytest.raises(ValueError, match="pfa"):
        Detector(pfa=0.0)
    with pytest.raises(ValueError, match="looks"):
        Detector(looks=0)
    with pytest.raises(ValueError, match="training cells"):
        Detector(cfar="ca")
    with pytest.raises(ValueError, match="pd"):
        albersheim(1.0)
