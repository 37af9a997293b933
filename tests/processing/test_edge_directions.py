"""Directions near +-90 deg, where the grating lobes of elements half a wavelength apart meet."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.doa import METHODS
from raychan.processing.spectra import BEAMS_PER_BEAM, Bartlett, peaks
from raychan.radar.aperture import Aperture, cosines
from raychan.units import C0

AZIMUTHS = np.radians([-88, -85, -80, -75, -70, -65, -40, -10, 0, 10, 40, 65, 70, 75, 80, 85, 88])
WAVE = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=20e-6, n_chirps=48, n_samples=64)


def plane(rows: int, columns: int, pitch: float) -> np.ndarray:
    """Elements (a, 3) of a plane array."""
    return np.array([[0.0, y * pitch, z * pitch] for y in range(rows) for z in range(columns)])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("count", [2, 4, 8, 16])
@pytest.mark.parametrize("axis", ["y", "z"])
def test_a_line_of_half_wavelengths_finds_a_wave_where_it_is_as_well_on_either_side(axis, count, method):
    """Its grid of directions ends at +90 deg, whose other end is at -90."""
    for truth in AZIMUTHS:
        for pitch in (0.45, 0.5):
            line = rc.uniform_array(count, pitch, axis)
            wave = Aperture(line, 1.0).steering(cosines(truth) if axis == "y" else cosines(0.0, truth))
            found = rc.doa(wave, line, 1.0, method=method, sources=1)
            angle = found.azimuth if axis == "y" else found.elevation
            assert np.sin(angle) == pytest.approx([np.sin(truth)], abs=1e-4 / count)
            assert found.ambiguous.tolist() == [False]


@pytest.mark.parametrize("method", ["bartlett", "capon", "music"])
@pytest.mark.parametrize("pitch", [0.45, 0.5])
def test_a_plane_of_elements_finds_a_wave_at_all_edges_of_what_is_visible(pitch, method):
    aperture = Aperture(plane(4, 4, pitch), 1.0)
    for turn in np.radians(np.arange(0.0, 360.0, 15.0)):
        for size in (0.9, 0.95, 0.99):
            truth = size * np.array([[np.cos(turn), np.sin(turn)]])
            found = rc.doa(aperture.steering(truth), aperture.elements, 1.0, method=method, sources=1)
            np.testing.assert_allclose(cosines(found.azimuth, found.elevation), truth, atol=1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_a_wave_from_the_side_says_ambiguous_where_the_other_side_looks_alike(method):
    """At half a wavelength +90 and -90 deg do; at 0.51 what lies beyond 74 deg does, and is given nearest boresight."""
    for pitch, azimuth, alike in [(0.5, 90.0, -90.0), (0.5, -90.0, 90.0), (0.51, 80.0, -77.2), (0.51, -80.0, 77.2)]:
        line = rc.uniform_array(4, pitch)
        wave = Aperture(line, 1.0).steering(cosines(np.radians(azimuth)))
        found = rc.doa(wave, line, 1.0, method=method, sources=1)
        assert min(abs(np.sin(found.azimuth[0]) - np.sin(np.radians([azimuth, alike])))) < 1e-3
        assert found.ambiguous.tolist() == [True]


def test_phase_monopulse_that_noise_turns_past_one_side_reads_as_bartlett_does():
    line = rc.uniform_array(4, 0.5)
    rng = np.random.default_rng(5)
    wave = Aperture(line, 1.0).steering(cosines(np.radians([86.0])))
    sides = []
    for _ in range(40):
        heard = wave + 0.2 * (rng.normal(size=wave.shape) + 1j * rng.normal(size=wave.shape))
        one, other = (
            np.sin(rc.doa(heard, line, 1.0, method=m, sources=1).azimuth[0]) for m in ("monopulse", "bartlett")
        )
        sides.append(np.sign(one))
        assert abs(np.exp(1j * np.pi * one) - np.exp(1j * np.pi * other)) < 0.5
        assert abs(one) < 1.0
    assert set(sides) == {-1.0, 1.0}


def test_directions_at_both_sides_are_near_each_other_where_grating_lobes_meet():
    one, other = np.array([0.98, 0.0]), np.array([-0.98, 0.0])
    assert Aperture(rc.uniform_array(8, 0.5), 1.0).apart(one, other) == pytest.approx(0.04 / 0.25)
    assert Aperture(rc.uniform_array(8, 0.45), 1.0).apart(one, other) == pytest.approx(1.96 * 8 * 0.45)


def test_a_grid_of_three_directions_still_finds_the_maximum_between_them():
    """Elements so near each other that a beam is wider than all directions."""
    line = Aperture(rc.uniform_array(2, 0.01), 1.0, axes=(True, False))
    wave = line.steering(cosines(0.4))
    assert peaks(Bartlett(wave), line, 1, BEAMS_PER_BEAM)[0, 0] == pytest.approx(np.sin(0.4), abs=2e-3)


@pytest.mark.parametrize("doa", ["bartlett", "capon", "music", "esprit"])
@pytest.mark.parametrize("wavelength", [C0 / WAVE.carrier, C0 / WAVE.middle])
def test_a_radar_detects_a_target_near_its_side_once_and_where_it_is(wavelength, doa):
    radar = rc.Radar(WAVE, elements=rc.uniform_array(4, wavelength / 2), processing=rc.Processing(doa=doa))
    for azimuth in (-80.0, -75.0, -70.0, 70.0, 75.0, 80.0):
        found = seen(radar, azimuth)
        assert np.degrees(found.azimuth) == pytest.approx([azimuth], abs=0.3)
        assert not found.ambiguous.any()


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm", "plane", "z"])
def test_so_do_virtual_arrays_planes_and_upright_lines(multiplexing):
    half = 0.5 * C0 / WAVE.carrier
    arrays = {"plane": {"elements": plane(4, 4, half)}, "z": {"elements": rc.uniform_array(4, half, "z")}}
    given = arrays.get(multiplexing) or {"multiplexing": multiplexing, **rc.mimo_array(2, 4, half)}
    for angle in (-78.0, -72.0, 72.0, 78.0):
        found = seen(rc.Radar(WAVE, **given), angle, upright=multiplexing == "z")
        assert np.degrees(found.elevation if multiplexing == "z" else found.azimuth) == pytest.approx([angle], abs=0.4)


def test_the_range_azimuth_map_shows_a_target_near_its_side_on_that_side():
    radar = rc.Radar(WAVE, elements=rc.uniform_array(4, 0.5 * C0 / WAVE.middle))
    for azimuth in (-82.0, 82.0):
        shown = rc.range_azimuth(result(radar, azimuth).rdmap, radar)
        sines, peak = np.sin(shown.azimuth), shown.power.max(axis=1)
        np.testing.assert_allclose(sines, -sines[::-1], atol=1e-9)
        near = np.abs(sines - np.sin(np.radians(azimuth))).argmin()
        assert peak[near] == pytest.approx(peak.max(), rel=1e-3)


def seen(radar: rc.Radar, angle: float, upright: bool = False) -> rc.Detections:
    """Return the detections of `result`."""
    return result(radar, angle, upright).detections


def result(radar: rc.Radar, angle: float, upright: bool = False) -> rc.Result:
    """Return the result of a strong point 12 m away, in a direction [deg] of azimuth or elevation."""
    ahead, aside = 12.0 * np.cos(np.radians(angle)), 12.0 * np.sin(np.radians(angle))
    place = (ahead, 0.0, aside) if upright else (ahead, aside, 0.0)
    place = tuple(np.add(place, radar.position))
    target = rc.Body(name="t", shape="sphere", params={"radius": 0.05}, position=place, rcs_dbsm=30.0)
    return rc.simulate(rc.Scene([target], radar=radar))
