"""Converter, I/Q imbalance and thermal noise against their closed forms."""

import numpy as np
import pytest
from support.echoes import SMALL, echoes, make_radar

from raychan.radar.impairments import Converter, Impairments
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.signal.baseband import noisy, synthesize
from raychan.signal.converter import digitized, image_rejection_db, images, imbalanced, quantized
from raychan.units import db, dbm, watt


def sine(n: int, size: float, turns: float = 0.12345678) -> np.ndarray:
    """Return a complex sine of n samples whose phases are as good as random."""
    return size * np.exp(2j * np.pi * turns * np.arange(n))


@pytest.mark.parametrize("bits", [6, 8, 10, 12, 14])
def test_full_scale_sine_has_the_quantisation_snr_of_6_02_bits_plus_1_76_db(bits):
    adc = Converter(bits, -10.0)
    # A little short of full scale: two's complement has one code less above zero than below.
    x = sine(1 << 17, np.sqrt(watt(-10.0)) - 0.6 * adc.step)
    y, clipped = quantized(x, adc)
    snr = db(np.mean(np.abs(x) ** 2) / np.mean(np.abs(y - x) ** 2))
    assert snr == pytest.approx(6.02 * bits + 1.76, abs=0.2)
    assert adc.snr_db == pytest.approx(6.02 * bits + 1.76, abs=0.02)
    assert clipped == 0
    assert dbm(np.mean(np.abs(y - x) ** 2)) == pytest.approx(dbm(adc.noise_power()), abs=0.2)


@pytest.mark.parametrize("bits", [2, 6, 10])
def test_the_strongest_sine_that_is_not_clipped_is_half_a_step_short_of_full_scale(bits):
    adc, full = Converter(bits, 0.0), np.sqrt(watt(0.0))
    assert quantized(sine(1 << 17, full - 0.501 * adc.step), adc)[1] == 0
    assert quantized(sine(1 << 17, full - 0.48 * adc.step), adc)[1] > 0


@pytest.mark.parametrize(("bits", "lost_db"), [(6, 1.5), (10, 0.4)])
def test_clipped_crests_of_a_full_scale_sine_take_what_the_theory_page_says(bits, lost_db):
    adc, full = Converter(bits, 0.0), np.sqrt(watt(0.0))
    x = sine(1 << 17, full)
    y, _ = quantized(x, adc)
    found = db(np.mean(np.abs(x) ** 2) / np.mean(np.abs(y - x) ** 2))
    # Where the sine is beyond the last level by half a step or more it errs by all that it is beyond.
    beyond = full * np.cos(2.0 * np.pi * (np.arange(1 << 16) + 0.5) / (1 << 16)) - (full - adc.step)
    noise = 2.0 * np.mean(np.where(beyond > 0.5 * adc.step, beyond**2, adc.step**2 / 12.0))
    assert found == pytest.approx(db(full**2 / noise), abs=0.15)
    assert adc.snr_db - db(full**2 / noise) == pytest.approx(lost_db, abs=0.05)


@pytest.mark.parametrize("over", [1.5, 2.0, 10.0])
def test_overdriven_sine_is_clipped_in_the_share_of_time_that_it_is_over(over):
    adc = Converter(12, -10.0)
    x = sine(1 << 16, over * np.sqrt(watt(-10.0)))
    y, clipped = quantized(x.real + 0j, adc, complex_sampling=False)
    assert clipped / len(x) == pytest.approx(2.0 / np.pi * np.arccos(1.0 / over), abs=0.01)
    assert np.abs(y.real).max() <= np.sqrt(watt(-10.0)) * (1.0 + 1e-12)
    assert not y.imag.any()


def test_signal_below_half_a_step_is_lost_and_noise_of_a_step_brings_it_back():
    adc = Converter(8, 0.0)
    x = sine(1 << 16, 0.3 * adc.step)
    assert not quantized(x, adc)[0].any()
    rng = np.random.default_rng(0)
    noise = adc.step * rng.standard_normal((len(x), 2)).view(complex)[:, 0]
    found = np.mean(quantized(x + noise, adc)[0] * x.conj()) / np.mean(np.abs(x) ** 2)
    assert found == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("gain", "phase"), [(0.5, 0.0), (0.0, 2.0), (1.0, -5.0), (-0.3, 1.0)])
def test_image_of_an_echo_is_below_it_by_the_image_rejection(gain, phase):
    n = 1024
    x = sine(n, 1.0, 100 / n)
    spectrum = np.fft.fft(imbalanced(x, gain, phase)) / n
    found = db(abs(spectrum[100]) ** 2 / abs(spectrum[-100]) ** 2)
    assert found == pytest.approx(image_rejection_db(gain, phase), abs=1e-6)
    # Small errors: the image is (g - 1)^2 / 4 + p^2 / 4 of the echo.
    small = (10.0 ** (gain / 20.0) - 1.0) ** 2 / 4.0 + np.radians(phase) ** 2 / 4.0
    assert found == pytest.approx(-db(small), abs=0.6)


def test_dc_offset_is_a_constant_of_its_power():
    cube = Cube(samples=np.zeros((1, 4, 8), np.complex64), noise_power=0.0)
    found, clipped = digitized(cube, Impairments(dc_offset_dbm=-60.0))
    assert clipped == 0
    assert dbm(np.mean(np.abs(found.samples) ** 2)) == pytest.approx(-60.0, abs=1e-4)
    assert np.ptp(found.samples) == 0.0


def test_a_receiver_without_impairments_gives_the_cube_itself():
    cube = synthesize(echoes([10.0]), make_radar(SMALL))
    assert digitized(cube, Impairments()) == (cube, 0)


@pytest.mark.parametrize(("kelvin", "dbw"), [(0.0, -np.inf), (40.0, -140.4), (290.0, -131.8)])
def test_noise_of_16_4_mhz_at_0_40_and_290_k_is_minus_infinity_minus_140_4_and_minus_131_8_dbw(kelvin, dbw):
    wave = Waveform(77e9, 1e9, 512 / 16.4e6, n_chirps=64, n_samples=512)
    radar = make_radar(wave, noise=True, noise_figure_db=0.0, noise_temperature_k=kelvin)
    assert db(radar.noise_power) == pytest.approx(dbw, abs=0.05)
    quiet = Cube(samples=np.zeros((1, 64, 512), np.complex64), noise_power=0.0)
    drawn = noisy(quiet, radar, np.random.default_rng(0))
    assert db(np.mean(np.abs(drawn.samples) ** 2)) == pytest.approx(db(radar.noise_power), abs=0.1)


def test_antenna_at_290_k_gives_k_t0_f_to_the_last_digit_and_another_adds_to_the_receivers_own():
    from raychan.units import K_BOLTZMANN, T0, undb

    for figure in (0.0, 3.7, 15.0):
        radar = make_radar(SMALL, noise_figure_db=figure)
        assert radar.noise_power == float(K_BOLTZMANN * T0 * SMALL.sample_rate * undb(figure))
        cold = make_radar(SMALL, noise_figure_db=figure, noise_temperature_k=40.0)
        wanted = K_BOLTZMANN * SMALL.sample_rate * (40.0 + 290.0 * (undb(figure) - 1.0))
        assert cold.noise_power == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("bits", [0, 25, 7.5])
def test_converters_that_cannot_be_are_refused(bits):
    with pytest.raises(ValueError, match="whole number from 1 to 24"):
        Converter(bits, 0.0)


def test_imbalance_without_iq_sampling_is_refused():
    real = Waveform(77e9, 1e9, 20e-6, complex_sampling=False)
    with pytest.raises(ValueError, match="I/Q sampling"):
        make_radar(real, impairments=Impairments(iq_gain_db=0.5))


@pytest.mark.parametrize(("gain", "phase"), [(0.5, 2.0), (-6.0, 20.0), (1.8, 80.0)])
def test_images_in_samples_are_those_that_the_mixer_made(gain, phase):
    recorded = imbalanced(sine(256, 1.0, 30 / 256), gain, phase)
    share, found = images(recorded, gain, phase)
    given, image = (np.fft.fft(x) / 256 for x in (recorded, found))
    assert image[-30] == pytest.approx(given[-30], rel=1e-9)
    assert -db(share) == pytest.approx(image_rejection_db(gain, phase), abs=1e-9)
    assert images(recorded, gain, 100.0)[0] == 0.0
