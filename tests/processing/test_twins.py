"""Directions that an array cannot tell from another, on any lattice or none, exactly or in noise, say `ambiguous`."""

from __future__ import annotations

import numpy as np
import pytest
from support.arrays import line, noise, plane

import raychan as rc
from raychan.processing.doa import by_turns
from raychan.processing.twins import ambiguous
from raychan.radar.aperture import Aperture, cosines
from raychan.units import C0

QUINCUNX = np.array([[0.0, i + 0.5 * (j % 2), 0.5 * j] for j in range(4) for i in range(4)])
"""Rows half a wavelength apart, a wavelength of pitch in each, every other row shifted by half of that."""
LATTICE = np.array(
    [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0], [2.0, 0.0], [-2.0, 0.0], [0.0, 2.0], [0.0, -2.0]]
)
TRIANGLE = np.array([[0.0, 0.0, 0.0], [0.0, 1.1, 0.2], [0.0, 0.4, 0.9]])
SPARSE = line(12)[[0, 1, 4, 9, 11]]
BENT = line(16, 1.0) + np.outer(np.linspace(-1.0, 1.0, 16) ** 2, [0.003, 0.0, 0.0])


def looks(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return cosines (count, 2) of directions within 0.97 of the visible."""
    radius, turn = 0.97 * np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
    return radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


@pytest.mark.parametrize("method", ["bartlett", "music", "capon"])
def test_on_a_skewed_lattice_all_twins_count_and_the_nearest_to_boresight_is_given(method):
    aperture = Aperture(QUINCUNX, 1.0)
    for true in looks(np.random.default_rng(0), 40):
        alike = np.concatenate([true[None], true + LATTICE])
        seen = alike[(alike**2).sum(axis=1) <= 1.0]
        found = rc.doa(aperture.steering(true[None]), QUINCUNX, 1.0, method, sources=1)
        at = cosines(found.azimuth, found.elevation)
        np.testing.assert_allclose(at, seen[[(seen**2).sum(axis=1).argmin()]], atol=2e-3)
        assert found.ambiguous.tolist() == [len(seen) > 1]


def test_three_receivers_wide_in_wavelengths_give_the_nearest_to_boresight_of_their_dual_lattice():
    """Places p are a lattice of three: all cosines that differ by whole multiples of the rows of inv(p) look alike."""
    aperture = Aperture(26.0 * np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.23], [0.0, 0.31, 1.0]]), 1.0)
    twins = np.indices((121, 121)).reshape(2, -1).T - 60
    away = twins @ np.linalg.inv(aperture.elements[1:, 1:]).T
    assert len(aperture.skewed) > 5000
    for true in np.array([[0.11, 0.23], [-0.4, 0.05]]):
        alike = true + away
        found = by_turns(aperture.steering(true[None]), aperture, 1)
        np.testing.assert_allclose(found, alike[[(alike**2).sum(axis=1).argmin()]], atol=1e-6)
        assert ambiguous(aperture, found).all()


def test_two_echoes_on_a_skewed_lattice_are_two_and_none_is_told_twice():
    aperture = Aperture(QUINCUNX, 1.0)
    true = np.array([[0.15, 0.1], [-0.3, -0.25]])
    found = rc.doa(np.array([1.0, 0.8j]) @ aperture.steering(true), QUINCUNX, 1.0, sources=2)
    np.testing.assert_allclose(cosines(found.azimuth, found.elevation), true, atol=1e-4)


@pytest.mark.parametrize("elements", [TRIANGLE, BENT, SPARSE], ids=["triangle", "bent", "sparse"])
def test_what_is_told_is_what_a_search_over_all_directions_finds(elements):
    """The triangle is a lattice of its own, the bent line almost one, the sparse line one without a twin."""
    aperture, rng = Aperture(elements, 1.0), np.random.default_rng(1)
    axis = np.linspace(-1.0, 1.0, 401)
    tried = np.array([[u, w] for u in axis for w in (axis if aperture.scans[1] else [0.0]) if u * u + w * w <= 1.0])
    beams = aperture.steering(tried).conj() / len(elements)
    told = []
    for true in looks(rng, 40) * np.array(aperture.scans):
        lost = 1.0 - np.abs(beams @ aperture.steering(true[None])[0]) ** 2
        apart = np.linalg.norm((tried - true) / np.where(aperture.scans, aperture.beamwidth, 1.0), axis=1) > 0.5
        told.append(ambiguous(aperture, true[None], np.array([1e3]))[0])
        # A twin on the edge of the visible, or between the directions tried, may be missed by the search.
        if (lost[apart] < 0.005).any() or (lost[apart] > 0.05).all():
            assert told[-1] == (lost[apart] < 0.012).any()
    assert any(told) == (elements is not SPARSE)


def test_a_twin_that_noise_could_hide_counts_and_one_that_it_could_not_does_not():
    """Without a lattice a twin loses a share of the beam: the chance that noise makes up for it decides."""
    elements = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.04, 0.0], [0.0, 3.1, 0.0]])
    aperture, rng, true = Aperture(elements, 1.0), np.random.default_rng(2), np.array([[0.45, 0.0]])
    for snr_db in (18.0, 24.0, 30.0, 36.0):
        snr = 10.0 ** (0.1 * snr_db)
        wrong = 0
        for _ in range(200):
            heard = aperture.steering(true) * np.sqrt(snr / 4.0) + noise(rng, 1, 4)
            wrong += abs(by_turns(heard, aperture, 1)[0, 0] - 0.45) > 0.3
        told = ambiguous(aperture, true, np.array([snr]))[0]
        assert told or wrong <= 2
        assert told == (snr_db < 33.0)


@pytest.mark.parametrize("elements", [line(8), plane(4, 4)], ids=["line", "plane"])
def test_an_echo_that_noise_pushes_over_an_end_says_ambiguous(elements):
    aperture, rng, snr = Aperture(elements, 1.0), np.random.default_rng(3), 10.0**2.6
    pushed = told = 0
    for azimuth in (80.0, 83.0, 86.0, 88.0, 90.0):
        for _ in range(40):
            wave = aperture.steering(cosines(np.radians(azimuth))) * np.sqrt(snr / len(elements))
            found = by_turns(wave + noise(rng, 1, len(elements)), aperture, 1)
            over = found[0, 0] < 0.0
            pushed, told = pushed + over, told + (over and ambiguous(aperture, found, np.array([snr]))[0])
    assert pushed > 20 and told == pushed


def test_where_no_noise_reaches_nothing_is_ambiguous():
    aperture = Aperture(line(8), 1.0)
    at = cosines(np.radians([-72.0, 0.0, 40.0, 72.0]))
    assert not ambiguous(aperture, at, np.full(4, 400.0)).any()
    assert not ambiguous(aperture, cosines(np.radians([88.0])), np.array([1e7])).any()


@pytest.mark.parametrize("multiplexing", ["none", "tdm"])
def test_a_radar_with_shifted_rows_says_that_directions_are_ambiguous(multiplexing):
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=20e-6, n_chirps=32, n_samples=64)
    elements = QUINCUNX * C0 / wave.middle
    senders = {} if multiplexing == "none" else {"tx_elements": elements[[0, 4]] * 4.0, "multiplexing": "tdm"}
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.0), elements=elements, **senders)
    place = 10.0 * np.array([np.sqrt(1.0 - 0.58**2 - 0.49**2), 0.58, 0.49])
    body = rc.Body("target", shape="sphere", params={"radius": 0.01}, position=place, rcs_dbsm=30.0)
    result = rc.simulate(rc.Scene([body], radar=radar))
    assert result.detections.ambiguous[0]
    assert any("ambiguous in direction" in x or "in rate and direction" in x for x in result.warnings)


@pytest.mark.parametrize("spread", [0.003, 0.01, 0.03, 0.06])
def test_depth_that_tells_a_direction_from_its_grating_lobe_tells_it(spread):
    """Elements stand off a line of a wavelength's pitch, by too little to be sought as deep ones."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        elements = line(11, 0.8) + spread * rng.standard_normal((11, 3)) * [1.0, 0.0, 1.0]
        aperture, true, snr = Aperture(elements, 1.0), cosines(rng.uniform(-1.2, 1.2)), 10.0**5
        found = by_turns(aperture.steering(true) * np.sqrt(snr / 11.0) + noise(rng, 1, 11), aperture, 1)
        right = abs(found[0, 0] - true[0, 0]) < 0.01
        assert right or ambiguous(aperture, found, np.array([snr]))[0]


@pytest.mark.parametrize("azimuth", [5.0, 20.0])
def test_of_nearly_equal_ones_that_noise_leaves_open_the_nearest_to_boresight_is_given(azimuth):
    near = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        elements = line(10, 1.0) + 0.002 * rng.standard_normal((10, 3)) * [1.0, 0.0, 0.0]
        wave = Aperture(elements, 1.0).steering(cosines(np.radians(azimuth))) * np.sqrt(100.0)
        found = rc.doa(wave + noise(rng, 1, 10), elements, 1.0, sources=1)
        near += abs(found.azimuth[0] - np.radians(azimuth)) < 0.05
    assert near >= 38
