"""Maps of arrays made part by part, against all at once: the slow, obvious form."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal.windows
import scipy.stats
from support.arrays import plane

import raychan as rc
from raychan import parallel
from raychan.processing.beams import BeamBank
from raychan.processing.cfar import factor
from raychan.processing.mimo import virtual_range_doppler
from raychan.processing.range_azimuth import PER_BEAM, range_azimuth
from raychan.processing.range_doppler import mean_power, range_doppler
from raychan.radar.windows import window
from raychan.records import Cube
from raychan.run.receiver import aperture_of, map_error, receivers
from raychan.units import C0

HALF = 1.5e8 / 77e9
ARRAYS = {
    "line": {"elements": rc.uniform_array(8, HALF)},
    "plane": {"elements": plane(4, 3) * 2.0 * HALF},
    "tdm": {**rc.mimo_array(2, 3, HALF), "multiplexing": "tdm"},
    "ddm": {**rc.mimo_array(2, 3, HALF), "multiplexing": "ddm"},
    "dual": {"elements": rc.uniform_array(4, HALF), "rx_polarization": "both"},
}


def radar_of(kind, complex_sampling=True):
    wave = rc.Waveform(77e9, 300e6, 20e-6, n_chirps=24, n_samples=50, complex_sampling=complex_sampling)
    return rc.Radar(wave, noise=False, **ARRAYS[kind])


def noise(radar, seed, scale=1e-6):
    rng = np.random.default_rng(seed)
    wave, count = radar.waveform, len(radar.elements) * (2 if radar.rx_polarization == "both" else 1)
    shape = count, wave.n_chirps, wave.n_samples
    return (scale * (rng.normal(size=shape) + 1j * rng.normal(size=shape))).astype(np.complex64)


@pytest.mark.parametrize("complex_sampling", [True, False])
@pytest.mark.parametrize("pad", [(1, 1), (2, 2), (3, 1)])
def test_the_map_is_the_two_windowed_transforms_of_each_antenna(complex_sampling, pad):
    radar = radar_of("line", complex_sampling)
    wave, samples = radar.waveform, noise(radar, 0)
    found = range_doppler(cube(samples), wave, "hann", "hamming", pad)
    cells = pad[1] * wave.n_chirps
    doppler = (np.arange(cells) - cells // 2) / (cells * wave.repetition)
    slow, fast = window("hamming", wave.n_chirps), window("hann", wave.n_samples)
    chirp = np.arange(wave.n_chirps)
    first = np.exp(2j * np.pi * np.outer(doppler, chirp) * wave.repetition) * (slow / slow.sum())
    t = (np.arange(wave.n_samples) - 0.5 * (wave.n_samples - 1)) * wave.chirp_duration / wave.n_samples
    rows = np.einsum("vc,acs->avs", first, samples) * np.exp(2j * np.pi * doppler[:, None] * t) * (fast / fast.sum())
    beat = np.arange(pad[0] * wave.n_samples)[:, None] * np.arange(wave.n_samples) / (pad[0] * wave.n_samples)
    true = (1.0 if complex_sampling else 2.0) * np.einsum("avs,rs->avr", rows, np.exp(2j * np.pi * beat))
    true = true[..., : found.spectrum.shape[2]]
    assert np.abs(found.spectrum - true).max() < 1e-6 * np.abs(true).max()
    np.testing.assert_allclose(found.power, (np.abs(found.spectrum.astype(complex)) ** 2).mean(axis=0), rtol=1e-12)


def cube(samples):
    return Cube(samples=samples, noise_power=0.0)


@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 40, 1000), (5, 1, 7), (2, 33, 16384)])
def test_the_mean_power_of_antennas_is_that_of_all_at_once(shape):
    rng = np.random.default_rng(1)
    spectrum = (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype(np.complex64)
    np.testing.assert_allclose(mean_power(spectrum), (np.abs(spectrum.astype(complex)) ** 2).mean(axis=0), rtol=1e-12)


@pytest.mark.parametrize("kind", [k for k in ARRAYS if k != "dual"])
def test_the_strongest_beam_of_a_cell_is_that_of_all_beams(kind):
    radar = radar_of(kind)
    made = virtual_range_doppler(cube(noise(radar, 2)), radar, resolve=False)
    bank = BeamBank(aperture_of(radar))
    power, beam = bank.strongest(made.spectrum)
    every = np.abs(np.einsum("ba,avr->bvr", bank.rows.astype(complex), made.spectrum)) ** 2
    np.testing.assert_allclose(power, every.max(axis=0), rtol=1e-5)
    np.testing.assert_allclose(np.take_along_axis(every, beam[None], axis=0)[0], every.max(axis=0), rtol=1e-5)


@pytest.mark.parametrize("kind", ARRAYS)
def test_the_error_of_an_arrays_map_is_that_of_all_receivers_at_once(kind):
    """In the beam towards a cell's echo, or the mean over orthogonal beams where that is more."""
    radar = radar_of(kind)
    own, wrong = noise(radar, 3), noise(radar, 4, 1e-8)
    own[:, :, :20] += 1e-5
    found = map_error(cube(own), cube(own - wrong), radar, radar.processing).power
    wrong = own - (own - wrong)
    if kind == "dual":
        own, wrong = own[: len(radar.elements)], wrong[: len(radar.elements)]
    given = radar.processing
    echo, off = (
        virtual_range_doppler(cube(x), radar, given.range_window, given.rate_window, given.pad, resolve=False).spectrum
        for x in (own, wrong)
    )
    echo, off = echo.astype(complex), off.astype(complex)
    towards = np.abs((off * np.exp(-1j * np.angle(echo))).mean(axis=0)) ** 2
    mean = (np.abs(off) ** 2).mean(axis=0) / len(off)
    np.testing.assert_allclose(found, np.maximum(towards, mean), rtol=1e-3)


@pytest.mark.parametrize("kind", ["line", "plane", "tdm"])
def test_the_range_azimuth_map_is_the_strongest_of_all_rates_and_heights_for_any_number_of_threads(kind):
    radar = radar_of(kind)
    made = virtual_range_doppler(cube(noise(radar, 5)), radar, resolve=False)
    given = made, receivers(radar), C0 / radar.waveform.middle
    before, maps = parallel.threads(), []
    try:
        for count in (1, 3):
            parallel.set_threads(count)
            shown = range_azimuth(*given)
            maps.append(shown.power)
    finally:
        parallel.set_threads(before)
    np.testing.assert_array_equal(*maps)
    aperture = aperture_of(radar)
    sines, true = np.sin(shown.azimuth), np.zeros_like(maps[0])
    np.testing.assert_allclose(sines[: len(aperture.grid(PER_BEAM).u)], aperture.grid(PER_BEAM).u, atol=1e-12)
    for w in aperture.grid(2).w:
        seen = sines**2 + w**2 <= 1.0
        look = np.stack([sines[seen], np.full(seen.sum(), w)], axis=1)
        rows = aperture.steering(look).conj() / len(aperture.elements)
        level = (np.abs(np.einsum("ba,avr->bvr", rows, made.spectrum)) ** 2).max(axis=1)
        true[seen] = np.maximum(true[seen], level)
    np.testing.assert_allclose(maps[0], true, rtol=1e-5)


@pytest.mark.parametrize("n", [2, 3, 17, 1024])
def test_cosine_windows_are_those_of_scipy_without_zeros_at_their_ends(n):
    known = scipy.signal.windows
    np.testing.assert_allclose(window("hann", n), known.hann(n + 2)[1:-1], atol=1e-15)
    np.testing.assert_allclose(window("blackman", n), known.blackman(n + 2)[1:-1], atol=1e-15)
    np.testing.assert_allclose(window("hamming", n), known.hamming(n), atol=1e-15)


@pytest.mark.parametrize("looks", [1, 4, 32])
@pytest.mark.parametrize("count", [5.5, 40.0])
def test_the_threshold_of_cell_averaging_is_the_quantile_of_an_f_distribution(looks, count):
    assert factor(1e-4, count, "ca", looks) == pytest.approx(scipy.stats.f.isf(1e-4, 2 * looks, 2 * looks * count))
    for pfa in (1e-3, 1e-8, 1e-14):
        assert factor(pfa, count, "ca", 1) == pytest.approx(count * (pfa ** (-1.0 / count) - 1.0), rel=1e-12)
