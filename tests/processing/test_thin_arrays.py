"""Arrays that are all but a line, straight or slanted: what they spread beside it tells no direction, and counts as
none."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.records import Cube
from raychan.units import C0

WAVE = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=20e-6, n_chirps=18, n_samples=32)
LAMBDA = C0 / WAVE.middle
NOISE = 1e-14
SNR_DB = 40.0  # in the beam of all elements
EXTENTS = [0.0, 1e-9, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 2e-4, 4e-4, 6e-4, 8e-4, 9e-4, 1e-3]  # [m]
LINE = np.outer((np.arange(12) - 5.5) * 0.5 * LAMBDA, [0.0, 1.0, 0.0])
LINES = {
    "y": LINE,
    "z": LINE[:, [0, 2, 1]],
    "rolled": LINE @ np.array([[1.0, 0.0, 0.0], [0.0, np.cos(0.4), np.sin(0.4)], [0.0, -np.sin(0.4), np.cos(0.4)]]),
    "tilted": LINE @ np.array([[np.cos(0.4), np.sin(0.4), 0.0], [-np.sin(0.4), np.cos(0.4), 0.0], [0.0, 0.0, 1.0]]),
    "uneven": LINE[[0, 1, 2, 4, 7, 8, 11]],
}


def look(azimuth: float, elevation: float) -> np.ndarray:
    """Return the direction (3,) of an azimuth and an elevation [deg]."""
    az, el = np.radians([azimuth, elevation])
    return np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])


def detected(elements, towards, snr_db=SNR_DB, **array) -> rc.Detections:
    """Return the detections of a wave from a direction (3,) at 8 m, in noise."""
    radar = rc.Radar(WAVE, elements=elements, **array)
    places = radar.virtual_elements
    rng, count = np.random.default_rng(0), (WAVE.n_chirps, WAVE.n_samples)
    beat = np.exp(-2j * np.pi * 16.0 * np.arange(count[1]) / count[1])
    size = np.sqrt(NOISE * 2.25 / np.prod(count) / len(places) * 10.0 ** (0.1 * snr_db))
    wave = size * np.exp(2j * np.pi / LAMBDA * places @ towards)
    noise = rng.standard_normal((len(places), *count, 2)) @ [1.0, 1.0j] * np.sqrt(0.5 * NOISE)
    cube = Cube((wave[:, None, None] * beat + noise).astype(np.complex64), NOISE)
    return rc.detect(rc.range_doppler(cube, radar), radar)


def is_one_at_full_level(found, elements, azimuth) -> None:
    """Check that a wave of elevation 0 is one detection at its level, from its azimuth [deg] where one is measured:
    across the line, of which beams are wide, to four standard deviations."""
    assert len(found.range) == 1
    assert found.snr[0] == pytest.approx(SNR_DB, abs=0.5)
    upright = np.ptp(elements[:, 2]) > np.ptp(elements[:, 1])
    along, across = (found.elevation[0], found.azimuth[0]) if upright else (found.azimuth[0], found.elevation[0])
    assert np.degrees(along) == pytest.approx(0.0 if upright else azimuth, abs=0.5)
    if np.isfinite(across):
        assert np.degrees(across) == pytest.approx(azimuth if upright else 0.0, abs=8.0)


@pytest.mark.parametrize("extent", EXTENTS)
@pytest.mark.parametrize("name", LINES)
def test_a_line_that_spreads_a_little_sees_a_wave_as_a_straight_one(name, extent):
    rng = np.random.default_rng(1)
    off = rng.uniform(-0.5, 0.5, (len(LINES[name]), 3)) * extent
    off[0], off[1] = 0.5 * extent, -0.5 * extent
    elements = LINES[name] + off * ([0.0, 1.0, 0.0] if name == "z" else [0.0, 0.0, 1.0])
    is_one_at_full_level(detected(elements, look(-20.0, 0.0)), elements, -20.0)


@pytest.mark.parametrize("extent", [1e-6, 2e-5, 2e-4, 6e-4])
@pytest.mark.parametrize("elevation", [-40.0, 0.0, 25.0])
def test_levels_are_those_of_the_sum_over_the_elements(elevation, extent):
    elements = LINE.copy()
    elements[:, 2] += np.random.default_rng(2).uniform(-0.5, 0.5, 12) * extent
    found = detected(elements, look(30.0, elevation))
    assert len(found.range) == 1 and not found.ambiguous[0] and np.isnan(found.elevation[0])
    assert found.snr[0] == pytest.approx(SNR_DB, abs=0.5)


@pytest.mark.parametrize("extent", [1e-5, 2e-4, 9e-4])
@pytest.mark.parametrize("elevation", [20.0, 45.0])
def test_a_strong_wave_from_above_is_one_detection(elevation, extent):
    """What the spread along z makes of its phase, up to 20 dB below it, is no echo of its own."""
    elements = LINE.copy()
    elements[:, 2] += np.random.default_rng(5).uniform(-0.5, 0.5, 12) * extent
    assert len(detected(elements, look(20.0, elevation), snr_db=60.0).range) == 1


def test_one_element_off_the_line_by_a_little_changes_nothing():
    elements = LINE.copy()
    elements[3, 2] = 2e-5
    is_one_at_full_level(detected(elements, look(-20.0, 0.0)), elements, -20.0)


@pytest.mark.parametrize("extent", [1e-9, 2e-5, 2e-4, 1e-3])
@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_transmitters_that_stand_a_little_off_the_line_change_nothing(multiplexing, extent):
    array = rc.mimo_array(2, 4, 0.5 * LAMBDA)
    senders = array["tx_elements"] + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, extent]])
    found = detected_by_two(array["elements"], senders, multiplexing)
    assert len(found.range) == 1
    assert np.degrees(found.azimuth[0]) == pytest.approx(-20.0, abs=0.5)
    level = detected_by_two(array["elements"], array["tx_elements"], multiplexing).snr[0]
    assert found.snr[0] == pytest.approx(level, abs=0.1)


def detected_by_two(elements, senders, multiplexing) -> rc.Detections:
    """Return the detections of a run of a point 10 m away at azimuth -20 deg before two transmitters."""
    body = rc.Body("t", shape="sphere", params={"radius": 0.01}, position=10.0 * look(-20.0, 0.0), rcs_dbsm=10.0)
    radar = rc.Radar(
        WAVE, position=(0.0, 0.0, 0.0), elements=elements, tx_elements=senders, multiplexing=multiplexing
    )  # fmt: skip
    return rc.simulate(rc.Scene([body], radar=radar), seed=1).detections


@pytest.mark.parametrize("roll", [0.01, 0.1, 1.0, 5.0, 30.0, 44.0, -60.0])
@pytest.mark.parametrize("method", ["bartlett", "music", "esprit"])
def test_a_slanted_line_measures_one_angle_at_full_gain(roll, method):
    c, s = np.cos(np.radians(roll)), np.sin(np.radians(roll))
    elements = np.stack([LINE[:, 0], c * LINE[:, 1], s * LINE[:, 1]], axis=1)
    along_y = abs(roll) < 45.0
    towards = look(-20.0, 0.0) if along_y else look(0.0, -20.0)
    found = detected(elements, towards, processing=rc.Processing(doa=method))
    assert len(found.range) == 1 and not found.ambiguous[0]
    angle, other = (found.azimuth, found.elevation) if along_y else (found.elevation, found.azimuth)
    assert np.degrees(angle[0]) == pytest.approx(-20.0, abs=0.5) and np.isnan(other[0])
    assert found.snr[0] == pytest.approx(SNR_DB, abs=0.5)


@pytest.mark.parametrize("extent", [1e-9, 1e-4, 5e-4])
@pytest.mark.parametrize("axes", [[1], [1, 2]])
def test_what_a_line_ahead_cannot_tell_is_ambiguous(axes, extent):
    elements = LINE[:, [1, 0, 2]].copy()
    off = np.random.default_rng(3).uniform(-0.5, 0.5, (12, 3)) * extent
    elements[:, axes] += off[:, axes]
    found = detected(elements, look(20.0, 0.0))
    assert len(found.range) == 1
    told = np.isfinite(found.azimuth[0]) and not found.ambiguous[0]
    assert not told or np.degrees(found.azimuth[0]) == pytest.approx(20.0, abs=3.0)


def test_a_short_part_of_a_line_measures_its_angle_too():
    elements = np.outer(np.arange(6) * 0.05 * LAMBDA, [0.0, 1.0, 0.0])
    wave = np.exp(2j * np.pi / LAMBDA * elements @ look(25.0, 0.0))
    found = rc.doa(wave, elements, LAMBDA, "music", sources=1, smoothing=0.5)
    assert np.degrees(found.azimuth) == pytest.approx([25.0], abs=0.5)
