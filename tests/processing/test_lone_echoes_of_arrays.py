"""A lone echo is one detection, however transmitters are told apart and samples are taken: neither its side lobes at
the ends of a map of a share of the rates, nor those of its mirror image, nor those under another fold are others."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.cfar import Grid
from raychan.processing.peaks import MARGIN, SideLobes
from raychan.processing.range_doppler import range_doppler
from raychan.radar.array import mimo_array, uniform_array
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of
from raychan.signal.baseband import synthesize
from raychan.units import C0

STEP = 0.5 * C0 / 77e9
ARRAYS = {
    "one": {},
    "line": {"elements": uniform_array(6, STEP)},
    "tdm": {**mimo_array(3, 4, STEP), "multiplexing": "tdm"},
    "ddm": {**mimo_array(3, 4, STEP), "multiplexing": "ddm"},
}


def made(array, complex_sampling, windows, pad, chirps=48, **given):
    """Return a radar of an array, without noise unless given."""
    wave = Waveform(77e9, 5e8, 20e-6, 40e-6, chirps, 128, complex_sampling=complex_sampling)
    settings = Processing(range_window=windows[0], rate_window=windows[1], pad=pad)
    return make_radar(wave, processing=settings, **ARRAYS[array], **given)


def found(radar, ranges, rates, amplitudes, azimuth, seed=0):
    """Return the detections of echoes at ranges [m] at mid frame."""
    rates = np.asarray(rates)
    sent = echoes(np.asarray(ranges) - rates * radar.waveform.centre, rates, amplitudes, azimuth)
    cube = synthesize(sent, radar, np.random.default_rng(seed))
    return detections_in(map_of(cube, radar, radar.processing), radar, radar.processing)


@pytest.mark.parametrize("complex_sampling", [True, False])
@pytest.mark.parametrize("array", ARRAYS)
def test_a_lone_echo_is_one_detection(array, complex_sampling):
    rng = np.random.default_rng(7)
    for _ in range(7):
        windows, pad = tuple(rng.choice(["hann", "hamming", "rect"], 2)), tuple(int(x) for x in rng.integers(1, 5, 2))
        radar = made(array, complex_sampling, windows, pad, noise=bool(rng.integers(2)))
        wave = radar.waveform
        place, rate = rng.uniform(3.0, 0.9 * wave.unambiguous_range), rng.uniform(-0.9, 0.9) * radar.resolved_rate
        seen = found(radar, [place], [rate], [3e-5], rng.uniform(-1.1, 1.1), seed=int(rng.integers(99)))
        assert seen.range == pytest.approx([place], abs=0.3 * wave.range_resolution)
        assert seen.rate == pytest.approx([rate], abs=0.3 * wave.rate_resolution)


@pytest.mark.parametrize("complex_sampling", [True, False])
@pytest.mark.parametrize("array", ARRAYS)
def test_a_weak_mover_beside_a_strong_echo_is_found(array, complex_sampling):
    radar = made(array, complex_sampling, ("hann", "hann"), (2, 2), chirps=96)
    rate = 8.3 * radar.waveform.rate_resolution
    seen = found(radar, [6.0, 7.4], [0.0, rate], [3e-5, 3e-7], [0.2, -0.3])
    assert sorted(np.round(seen.rate / rate, 1)) == [0.0, 1.0]


def test_a_fast_echo_under_staggered_ramps_has_no_side_lobes_where_it_migrates():
    wave = Waveform(77e9, 1e9, 20e-6, None, 81, 128, stagger=(40e-6, 44e-6, 50e-6))
    for window in ("rect", "hamming", "hann"):
        radar = make_radar(wave, processing=Processing(range_window="hann", rate_window=window, pad=(2, 2)))
        seen = found(radar, [9.0], [90.0], [3e-5], 0.0)
        assert seen.rate == pytest.approx([90.0], abs=0.3 * wave.rate_resolution)


@pytest.mark.parametrize("window", ["rect", "hamming", "hann"])
def test_side_lobes_bound_the_map_of_an_echo_and_of_its_image(window):
    radar = made("one", False, (window, window), (3, 3), chirps=20)
    place, rate = 5.1, 0.31 * radar.waveform.unambiguous_rate
    sent = echoes([place - rate * radar.waveform.centre], [rate], 1.0)
    map = range_doppler(synthesize(sent, radar), radar.waveform, window, window, (3, 3))
    at = np.array([(rate - map.rate[0]) / map.rate_resolution, place / map.range_resolution])
    cells = np.stack(np.meshgrid(*(np.arange(n) / 3.0 for n in map.power.shape), indexing="ij"), axis=-1)
    lobes = SideLobes.of(Grid.of(map), (window, window), radar.waveform, None)
    smear = rate * radar.waveform.frame_duration / map.range_resolution
    shown = lobes.at(cells, at, 1.0, smear) + lobes.of_images(cells, at, 1.0, smear)
    assert (map.power <= MARGIN * shown).all()


@pytest.mark.parametrize("windows", [("rect", "rect"), ("taylor(35)", "hamming"), ("hann", "hann")])
def test_side_lobes_round_the_end_of_the_rates_are_no_detections(windows):
    radar = made("one", True, windows, (2, 2), chirps=64, noise=True)
    for share in (0.89, 0.95, -0.93):
        rate = share * radar.waveform.unambiguous_rate
        assert found(radar, [10.1], [rate], [3e-5], 0.0).rate == pytest.approx([rate], abs=0.05)


@pytest.mark.parametrize("array", ["tdm", "ddm"])
def test_ranges_are_right_at_the_end_of_a_span_of_rates(array):
    radar = made(array, True, ("hann", "hann"), (2, 2))
    span = radar.waveform.unambiguous_rate / radar.slots
    for share in (0.9, 0.995, 1.01, -0.99):
        seen = found(radar, [9.12], [share * span], [3e-5], 0.3)
        assert seen.range == pytest.approx([9.12], abs=0.02 * radar.waveform.range_resolution)


@pytest.mark.parametrize("complex_sampling", [True, False])
@pytest.mark.parametrize("array", ARRAYS)
def test_rates_and_ranges_are_right_all_round_the_end_of_the_rates(array, complex_sampling):
    """Neighbours beyond the end stand 0.9 range cells away, or that by the number of transmitters or slots."""
    wave = Waveform(77e9, 5e8, 20e-6, 22e-6, 48, 128, complex_sampling=complex_sampling)
    radar = make_radar(wave, **ARRAYS[array])
    span = C0 / (4.0 * wave.middle * wave.repetition * radar.slots)
    for share in (-0.995, -0.97, 0.96, 0.985, 0.998):
        seen = found(radar, [9.12], [share * span], [3e-5], 0.3)
        assert seen.rate == pytest.approx([share * span], abs=0.05 * wave.rate_resolution)
        assert seen.range == pytest.approx([9.12], abs=0.02 * wave.range_resolution)
        assert 10.0 * np.log10(seen.power / 9e-10) == pytest.approx([0.0], abs=0.1)


@pytest.mark.parametrize("pad", [1, 2])
@pytest.mark.parametrize("place", [0.2, 0.4, 1.4, 126.4, 127.4])
def test_peaks_at_the_ends_of_the_ranges_are_interpolated(place, pad):
    radar = made("one", True, ("hann", "hann"), (pad, 2))
    seen = found(radar, [place * radar.waveform.range_resolution], [0.0], [3e-5], 0.0)
    assert seen.range == pytest.approx([place * radar.waveform.range_resolution], abs=0.003)
    assert 10.0 * np.log10(seen.power / 9e-10) == pytest.approx([0.0], abs=0.03)
