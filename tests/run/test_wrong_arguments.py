"""Arguments of another type, and records of another radar, are refused by functions in words that name them."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import raychan as rc
from raychan.radar.impairments import Impairments
from raychan.records import Cube

WAVE = rc.Waveform(77e9, 5e8, 2e-5, n_chirps=16, n_samples=32)
RADAR = rc.Radar(WAVE, elements=rc.uniform_array(4, 2e-3))
CUBE = Cube(np.zeros((4, 16, 32), np.complex64), 1e-12)
RDMAP = rc.range_doppler(CUBE, RADAR)
SCENE = rc.Scene(bodies=[rc.Body("t", shape="box", rcs_dbsm=10.0, position=(12, 0, 0))], radar=RADAR)
PATHS = rc.transfer(rc.trace(SCENE), RADAR)
LINE = rc.uniform_array(8, 2e-3)
WORDS = np.array(["a", "b"])
OTHERS = (None, 3, "x", [], SCENE)


@pytest.mark.parametrize("given", OTHERS, ids=lambda x: type(x).__name__)
@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda x: rc.visibility(x, "t"), "result = .*: a Result is wanted"),
        (lambda x: rc.transfer(x, RADAR), "routes = .*: a SceneRoutes is wanted"),
        (lambda x: rc.transfer(rc.trace(SCENE), x), "radar = .*: a Radar is wanted"),
        (lambda x: rc.synthesize(x, RADAR), "paths = .*: a Paths is wanted"),
        (lambda x: rc.synthesize(PATHS, x), "radar = .*: a Radar is wanted"),
        (lambda x: rc.range_doppler(x, RADAR), "cube = .*: a Cube is wanted"),
        (lambda x: rc.range_doppler(CUBE, x), "radar = .*: a Radar is wanted"),
        (lambda x: rc.detect(x, RADAR), "rdmap = .*: a RangeDoppler is wanted"),
        (lambda x: rc.detect(RDMAP, x), "radar = .*: a Radar is wanted"),
        (lambda x: rc.range_azimuth(x, RADAR), "data = .*: a Cube or a RangeDoppler is wanted"),
        (lambda x: rc.range_azimuth(RDMAP, x), "radar = .*: a Radar is wanted"),
        (lambda x: rc.detection_probability(10, x), "detector = .*: a Detector is wanted"),
    ],
)
def test_stages_name_the_argument_that_is_of_another_type(call, said, given):
    with pytest.raises(ValueError, match=said):
        call(given)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: rc.trace("urban"), r"scene: 'urban' is not possible; allowed: a Scene, as Scene.load\('urban'\)"),
        (lambda: rc.trace(SCENE, check="no"), "check = 'no': must be true or false"),
        (lambda: rc.range_doppler(CUBE, RADAR, cross=None), "cross = None: must be true or false"),
        (lambda: rc.explain(None, 3.0), "result = None: a Result or a text or a path is wanted"),
        (lambda: rc.explain(3, detection=1), "result = 3: a Result or a text or a path is wanted"),
        (lambda: rc.load_result(None), "path = None: a text or a path is wanted"),
        (lambda: rc.simulate(SCENE, progress=3), "progress = 3: a function is wanted, or None"),
        (
            lambda: rc.spectrogram(SCENE, 0.01, resolution=1, ranges=(1,)),
            r"ranges = \(1,\): two numbers are wanted",
        ),
        (
            lambda: rc.spectrogram(SCENE, 0.01, resolution=1, ranges=3),
            "ranges = 3: two numbers are wanted",
        ),
        (lambda: rc.spectrogram(SCENE, 0.01, resolution=1, ranges="ab"), "ranges = 'ab': numbers are wanted"),
        (lambda: rc.detection_probability("x"), "snr_db = 'x': numbers are wanted"),
        (lambda: rc.detection_probability(10, swerling="1"), "swerling = '1': must be a whole number"),
        (lambda: rc.detection_probability(10, swerling=1.5), "swerling = 1.5: must be a whole number"),
        (lambda: rc.detection_probability(10, swerling=7), "swerling = 7: must be one of 0, 1, 2, 3, 4"),
        (lambda: rc.Detector(looks=np.inf), "Detector.looks = inf: must be a whole number"),
        (lambda: rc.Detector(looks=0), "Detector.looks = 0: must be a whole number from 1 on"),
        (lambda: rc.Detector(pfa="x"), "Detector.pfa = 'x': must be finite, a number"),
        (lambda: rc.Detector(min_snr_db="x"), "Detector.min_snr_db = 'x': a number is wanted"),
        (lambda: rc.Detector(cells="3"), "Detector.cells = '3': a number is wanted"),
        (lambda: rc.Detector(cells=[1, 2]), r"Detector.cells = \[1, 2\]: a number is wanted"),
        (lambda: rc.doa(["1"] * 8, LINE, 4e-3), "snapshots = .*: numbers are wanted"),
        (lambda: rc.uniform_array(10**12, 0.1), "n = 1000000000000: must lie between 1 and 4096"),
        (lambda: rc.uniform_array(True, 0.1), "n = True: must be a whole number"),
        (lambda: rc.uniform_array(4, "0.1"), "spacing = '0.1': must be finite, a number"),
        (lambda: rc.doa(np.ones(8), LINE, "0.004"), "wavelength = '0.004': must be finite, a number"),
        (lambda: rc.doa(np.ones(8), LINE, 4e-3, sources="1"), "sources = '1': must be a whole number"),
        (lambda: rc.doa(np.ones(8), LINE, 4e-3, smoothing="3"), "smoothing = '3': must be finite, a number"),
        (lambda: rc.doa("x", LINE, 4e-3), "snapshots = 'x': numbers are wanted"),
        (lambda: rc.doa(np.ones(8), LINE, 4e-3, method=WORDS), "method array.*: must be one of bartlett"),
        (lambda: rc.doa(np.ones(8), LINE, 4e-3, criterion=WORDS), "criterion array.*: must be one of mdl, aic"),
        (lambda: rc.visibility(rc.simulate(SCENE), WORDS), "no body array.*; there are t"),
        *(
            (lambda x=x, name=name: rc.simulate(SCENE, **{name: x}), f"{name} = array.*: a (whole )?number is wanted")
            for name in ("seed", "tolerance_db", "max_bounces")
            for x in (np.array([1, 2]), np.array([]))
        ),
        (lambda: rc.frames(SCENE, np.array([1, 2])), "count = array.*: a whole number is wanted"),
        (lambda: rc.frames(SCENE, 2, np.array([])), "interval = array.*: a number is wanted"),
        (lambda: rc.spectrogram(SCENE, np.array([])), "duration = array.*: a number is wanted"),
        *(
            (lambda name=name: rc.spectrogram(SCENE, 0.01, **{name: np.array([])}), f"{name} = array.*: a number is")
            for name in ("resolution", "tracings_per_second")
        ),
        (lambda: rc.doa(np.ones(8), "x", 4e-3), "elements = 'x': numbers are wanted"),
    ],
)
def test_functions_name_the_argument_that_cannot_be(call, said):
    with pytest.raises(ValueError, match=said):
        call()


def test_scalars_of_numpy_are_seeds_counts_and_levels():
    some = rc.simulate(SCENE, seed=np.array(3), tolerance_db=Fraction(1), max_bounces=np.array(1))
    assert some.seed == 3 and type(some.seed) is int
    again = rc.simulate(SCENE, seed=3, tolerance_db=1.0, max_bounces=1)
    np.testing.assert_array_equal(some.rdmap.power, again.rdmap.power)
    times = [frame.time for frame in rc.frames(SCENE, np.array(2), np.array(0.5))]
    assert times == [0.0, 0.5] and SCENE.at(np.array(0.5)).radar.position.tolist() == RADAR.position.tolist()


def test_whole_floats_stand_for_whole_numbers_everywhere_and_truth_values_nowhere():
    some = rc.simulate(SCENE, seed=3.0, max_bounces=np.float64(1.0))
    assert type(some.seed) is int and some.stats == rc.simulate(SCENE, seed=3, max_bounces=1).stats
    assert len(list(rc.frames(SCENE, 2.0, seed=1.0))) == 2
    flat, wave = rc.Body("p", shape="plate").geometry, {"carrier": 77e9, "bandwidth": 1e9, "chirp_duration": 2e-5}
    assert rc.rcs(flat, 10e9, 0.0, max_bounces=1.0, max_rays=1e5).sigma == rc.rcs(flat, 10e9, 0.0, max_bounces=1).sigma
    assert rc.Waveform(**wave, n_chirps=16.0) == rc.Waveform(**wave, n_chirps=16)
    for wrong in (True, np.True_, 2.5, math.inf, math.nan):
        for call in (
            lambda wrong: rc.simulate(SCENE, seed=wrong),
            lambda wrong: rc.frames(SCENE, wrong),
            lambda wrong: rc.rcs(flat, 10e9, 0.0, max_bounces=wrong),
            lambda wrong: rc.Waveform(**wave, n_chirps=wrong),
        ):
            with pytest.raises(ValueError, match="whole number"):
                call(wrong)


def test_a_result_that_is_not_there_is_told_by_a_public_error():
    with pytest.raises(rc.StoreError, match="nosuch: no such file"):
        rc.load_result("nosuch")


def test_whole_floats_and_scalars_of_numpy_are_numbers():
    assert rc.detection_probability(np.float32(10), swerling=1.0) == rc.detection_probability(10, swerling=np.int8(1))
    assert len(rc.uniform_array(np.float64(4.0), np.float32(0.1))) == 4
    assert len(rc.doa(np.ones(8), LINE.tolist(), np.float32(4e-3), sources=1.0).azimuth) == 1
    assert rc.detect(RDMAP, replace(RADAR, power=1, impairments=Impairments())).range.size == 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"waveform": replace(WAVE, carrier=24e9)}, "rdmap of 4 antennas and cells of 0.2998 m by .*; the radar has 4"),
        ({"waveform": replace(WAVE, bandwidth=1e9)}, "rdmap of .* 0.2998 m by .*; the radar has .* 0.1499 m by"),
        ({"elements": rc.uniform_array(3, 2e-3)}, "rdmap of 4 antennas .*; the radar has 3 antennas"),
    ],
)
def test_a_map_of_another_radar_is_refused(change, said):
    for run in (rc.detect, rc.range_azimuth):
        with pytest.raises(ValueError, match=said):
            run(RDMAP, replace(RADAR, **change))


@pytest.mark.parametrize(
    "change",
    [{"waveform": replace(WAVE, n_chirps=8)}, {"elements": rc.uniform_array(3, 2e-3)}, {"rx_polarization": "both"}],
)
def test_samples_of_another_radar_are_refused(change):
    for run in (rc.range_doppler, rc.range_azimuth):
        with pytest.raises(ValueError, match=r"cube of shape \(4, 16, 32\) \(receiver, chirp, sample\); the radar"):
            run(CUBE, replace(RADAR, **change))


def test_whole_numbers_of_scene_files_may_be_written_as_floats():
    text = "[radar.waveform]\nbandwidth_mhz = 500.0\nchirp_us = 20.0\nchirps = 64.0\n[model]\nmax_rays = 1e6\n"
    scene = rc.Scene.from_text(text)
    assert (scene.model.max_rays, scene.radar.waveform.n_chirps) == (1_000_000, 64)
    assert type(scene.model.max_rays) is int
    for wrong in ("64.5", "true", "inf"):
        with pytest.raises(ValueError, match="a whole number"):
            rc.Scene.from_text(text.replace("64.0", wrong))
