"""Phase noise and chirp error: their statistics and closed forms, and groups of paths against the sum path by path."""

from itertools import pairwise

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.range_doppler import range_doppler
from raychan.radar.impairments import ChirpError, Impairments, PhaseNoise
from raychan.radar.waveform import Waveform
from raychan.signal.baseband import synthesize
from raychan.signal.phase_error import PhaseTrack, faulty
from raychan.units import C0, db

MASK = PhaseNoise([[1e4, -70.0], [1e5, -85.0], [1e6, -95.0], [1e7, -110.0]])
WAVE = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 64, 512)
LONG = Waveform(77e9, 1e9, 25.6e-6, 25.6e-6, 256, 512)
"""Ramps without a pause: samples of a frame are one even series."""


def radar(wave: Waveform = WAVE, **impairments):
    return make_radar(wave, impairments=Impairments(**impairments))


def density(series: np.ndarray, step: float, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [Hz] and the two-sided power density of a series: Hann-windowed pieces, averaged (Welch)."""
    parts = series[: len(series) // pieces * pieces].reshape(pieces, -1)
    n = parts.shape[1]
    window = np.hanning(n + 1)[:n]
    spectrum = np.abs(np.fft.fft(parts * window, axis=1)) ** 2
    return np.fft.fftfreq(n, step), spectrum.mean(axis=0) * step / (window**2).sum()


def bands(f: np.ndarray, found: np.ndarray, wanted: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return how far the density is off what is wanted, in dB, in eight bands of equal ratio."""
    edges = np.geomspace(low, high, 9)
    inside = [(f >= a) & (f < b) for a, b in pairwise(edges)]
    return np.array([db(found[at].sum() / wanted[at].sum()) for at in inside])


def test_phase_noise_has_the_power_density_of_its_mask_within_half_a_db():
    total = 0.0
    for seed in range(16):
        track = PhaseTrack(LONG, MASK, None, (0.0, 0.0), np.random.default_rng(seed))
        phase = np.concatenate([track.at(m * LONG.repetition, 0.0) for m in range(LONG.n_chirps)])
        f, found = density(phase, track.step, 32)
        total = total + found / 16.0
    assert np.abs(bands(f, total, MASK.density(f), 2e4, 9e6)).max() < 0.5


@pytest.mark.parametrize("distance", [3.0, 60.0])
def test_beat_of_one_path_has_the_range_correlated_density_within_half_a_db(distance):
    paths = echoes([distance])
    clean = synthesize(paths, radar(LONG)).samples[0]
    total = 0.0
    for seed in range(4):
        cube = faulty(paths, radar(LONG, phase_noise=MASK), np.random.default_rng(seed))
        f, found = density((cube.samples[0] / clean - 1.0).ravel(), LONG.chirp_duration / LONG.n_samples, 32)
        total = total + found / 4.0
    wanted = MASK.beat_density(f, 2.0 * distance / C0)
    assert np.abs(bands(f, total, wanted, 5e4, 9e6)).max() < 0.5


def test_noise_of_a_path_without_delay_cancels():
    paths = echoes([0.0])
    cube = faulty(paths, radar(phase_noise=MASK), np.random.default_rng(2))
    assert np.abs(cube.samples - synthesize(paths, radar()).samples).max() < 1e-6


@pytest.mark.parametrize("iq", [True, False])
def test_groups_of_many_paths_agree_with_the_sum_path_by_path(iq):
    wave = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 32, 512, complex_sampling=iq)
    rng = np.random.default_rng(3)
    n = 60
    paths = echoes(rng.uniform(0.2, 70.0, n), rng.uniform(-20.0, 20.0, n), np.exp(2j * np.pi * rng.random(n)))
    bad = radar(wave, phase_noise=MASK, chirp_error=ChirpError([[0.0, 0.0], [10e-6, 5e5], [25.6e-6, -2e5]]))
    direct = faulty(paths, bad, np.random.default_rng(4), "direct").samples
    grouped = faulty(paths, bad, np.random.default_rng(4), "groups").samples
    clean = synthesize(paths, radar(wave)).samples
    changed = np.mean(np.abs(direct - clean) ** 2)
    bent = faulty(paths, radar(wave, chirp_error=bad.impairments.chirp_error), rng).samples
    noise = np.mean(np.abs(direct - bent) ** 2)
    off = np.mean(np.abs(grouped - direct) ** 2)
    assert changed > 0.0 and db(off / noise) < -25.0


def test_a_slope_off_by_one_percent_moves_a_target_by_one_percent_of_its_range():
    wave = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 16, 1024)
    slope = ChirpError([[0.0, 0.0], [wave.chirp_duration, 0.01 * wave.bandwidth]])
    ranges = np.array([20.0, 60.0])
    for r in ranges:
        cube = faulty(echoes([r]), radar(wave, chirp_error=slope), np.random.default_rng(0))
        rdmap = range_doppler(cube, wave, pad=(16, 1))
        found = rdmap.range[np.argmax(rdmap.power.max(axis=0))]
        assert found == pytest.approx(1.01 * r, abs=0.001 * r)


def test_chirp_error_is_the_phase_of_the_bent_ramp_less_the_same_one_delay_later():
    # A sine on the ramp: psi(t) by numerical integration of the frequency error.
    t = np.linspace(-1e-6, WAVE.chirp_duration, 400)
    error = ChirpError(np.column_stack([t, 3e5 * np.sin(2e5 * np.pi * t)]))
    fine = np.linspace(-0.5e-6, WAVE.chirp_duration, 200_001)
    steps = 0.5 * (error.frequency(fine[1:]) + error.frequency(fine[:-1])) * np.diff(fine)
    whole = np.concatenate([[0.0], 2.0 * np.pi * np.cumsum(steps)])
    s = np.arange(WAVE.n_samples) * WAVE.chirp_duration / WAVE.n_samples
    paths = echoes([45.0])
    turn = np.interp(s - paths.delay[0], fine, whole) - np.interp(s, fine, whole)
    cube = faulty(paths, radar(chirp_error=error), np.random.default_rng(0))
    wanted = synthesize(paths, radar()).samples[0] * np.exp(1j * turn)
    assert np.abs(cube.samples[0] - wanted).max() < 2e-5
    grouped = faulty(paths, radar(chirp_error=error), np.random.default_rng(0), "groups")
    assert np.abs(grouped.samples[0] - wanted).max() < 2e-4


@pytest.mark.parametrize(
    ("carrier", "bandwidth", "ends"),
    [
        (1e12, 1e9, (1e6, 5e6)),
        (1e8, 5e7, (-1e6, 3e6)),
        (1e12, 9.99e11, (0.0, 2e9)),
        (77e9, 1e3, (0.0, -5e3)),
        (77e9, 1e3, (0.0, -1e3)),
    ],
    ids=["highest carrier", "lowest carrier", "bandwidth near the carrier", "ramp that falls", "no ramp is left"],
)
def test_a_straight_chirp_error_beyond_the_limits_of_radars_turns_by_its_closed_form(carrier, bandwidth, ends):
    wave = Waveform(carrier, bandwidth, 25.6e-6, 30e-6, 4, 128)
    slope = (ends[1] - ends[0]) / wave.chirp_duration
    error = ChirpError([[-1e-6, ends[0] - 1e-6 * slope], [wave.chirp_duration, ends[1]]])
    t = np.arange(wave.n_samples) * wave.chirp_duration / wave.n_samples
    paths = echoes([45.0])
    late = paths.delay[0]
    turn = np.pi * (slope * ((t - late) ** 2 - t**2) - 2.0 * ends[0] * late)
    wanted = synthesize(paths, radar(wave)).samples[0] * np.exp(1j * turn)
    for method in ("direct", "groups"):
        cube = faulty(paths, radar(wave, chirp_error=error), np.random.default_rng(0), method)
        assert np.abs(cube.samples[0] - wanted).max() < 2e-5


def test_equal_seeds_give_equal_bytes_and_no_impairment_changes_nothing():
    paths = echoes([10.0, 20.0, 30.0, 31.0, 32.0, 50.0])
    bad = radar(phase_noise=MASK)
    one, two = (faulty(paths, bad, np.random.default_rng(5)).samples.tobytes() for _ in range(2))
    assert one == two
    assert np.array_equal(faulty(paths, radar(), np.random.default_rng(5)).samples, synthesize(paths, radar()).samples)


def test_a_frame_too_long_for_its_sample_rate_is_refused_before_it_fills_the_memory():
    long = Waveform(77e9, 1e9, 25.6e-6, 1.0, 64, 512)
    with pytest.raises(ValueError, match="a shorter frame"):
        faulty(echoes([10.0]), radar(long, phase_noise=MASK), np.random.default_rng(0))


@pytest.mark.parametrize(
    ("mask", "said"),
    [
        ([[1e4, -90.0], [1e5, -80.0]], "rises"),
        ([[0.0, -90.0]], "positive"),
        ([[1e5, -90.0], [1e4, -95.0]], "does not rise"),
        ([[1e5, 3.0]], "above the carrier"),
        ([], "pair"),
    ],
)
def test_masks_that_cannot_be_are_refused(mask, said):
    with pytest.raises(ValueError, match=said):
        PhaseNoise(mask)
