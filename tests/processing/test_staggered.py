"""Staggered repetition: movers beyond the rate that any one distance of ramps tells apart have their true rate."""

from __future__ import annotations

import numpy as np
import pytest
from support.echoes import echoes, make_radar

import raychan as rc
from raychan.cli import invoke
from raychan.processing.staggered import ResolvedMap
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.run.receiver import detections_in, map_of, noise_of_cell, quiet_map
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

STAGGER = (40e-6, 50e-6, 60e-6)
WAVE = Waveform(77e9, 100e6, 15e-6, n_chirps=192, n_samples=128, stagger=STAGGER)
"""The ramps' mean distance folds beyond 19.5 m/s, each third ramp beyond 6.5 m/s; 10 us, their divisor, at 97 m/s."""
SETTINGS = Processing(min_snr_db=15.0)


def formula(paths, wave):
    """Return samples ramp by ramp, straight from the convention of radar.waveform."""
    starts = np.array([sum(STAGGER[k % 3] for k in range(m)) for m in range(wave.n_chirps)])[:, None]
    t = np.arange(wave.n_samples) * wave.chirp_duration / wave.n_samples
    total = np.zeros((wave.n_chirps, wave.n_samples), complex)
    for a, tau0, v in zip(paths.amplitude, paths.delay, paths.range_rate, strict=True):
        grown = 2.0 * v * (starts + t) / C0
        tau = tau0 + grown
        total += a * np.exp(-2j * np.pi * (wave.carrier * grown + wave.slope * t * tau - 0.5 * wave.slope * tau**2))
    return total


@pytest.mark.parametrize("method", ["direct", "nufft"])
def test_samples_are_those_of_ramps_at_their_own_times(method):
    paths = echoes([12.0, 31.0, 7.0], [-44.0, 3.0, 20.0], [1.0, 0.3j, -0.5])
    got = synthesize(paths, make_radar(WAVE), method=method).samples[0]
    assert db((np.abs(got - formula(paths, WAVE)) ** 2).max()) < -95.0


@pytest.mark.parametrize("rate", [-70.0, -33.0, -6.4, 0.0, 6.6, 19.6, 42.0, 85.0])
def test_a_mover_beyond_the_unambiguous_rate_has_its_true_rate(rate):
    rdmap = map_of(synthesize(echoes([20.0], rate), make_radar(WAVE)), make_radar(WAVE), SETTINGS)
    found = detections_in(rdmap, make_radar(WAVE), SETTINGS)
    assert isinstance(rdmap, ResolvedMap)
    assert rdmap.unambiguous_rate == pytest.approx(6.5, rel=0.02)
    assert found.rate[0] == pytest.approx(rate, abs=0.03)
    # At the middle of the frame; the beat of the whole Doppler shift is taken off, not only that of its alias.
    assert found.range[0] == pytest.approx(20.0 + rate * 0.5 * WAVE.frame_duration, abs=0.05)
    assert db(found.power[0]) == pytest.approx(0.0, abs=0.15)


def test_movers_in_noise_have_their_true_rates():
    """20 dB over the noise of a cell, random rates up to the limit of the divisor: 60 of 60."""
    radar, rng = make_radar(WAVE, noise=True), np.random.default_rng(2)
    level = np.sqrt(100.0 * noise_of_cell(radar, SETTINGS))
    for seed in range(60):
        rate = rng.uniform(-90.0, 90.0)
        cube = synthesize(echoes([20.0], rate, level), radar, np.random.default_rng(seed))
        found = detections_in(map_of(cube, radar, SETTINGS), radar, SETTINGS)
        assert found.rate[0] == pytest.approx(rate, abs=0.1)


def test_noise_and_power_without_folds_are_those_of_all_ramps():
    radar = make_radar(WAVE, noise=True)
    rdmap = map_of(synthesize(echoes([]), radar, np.random.default_rng(1)), radar, SETTINGS)
    assert db(rdmap.power.mean() / rdmap.noise) == pytest.approx(0.0, abs=0.1)
    assert rdmap.noise == pytest.approx(noise_of_cell(radar, SETTINGS), rel=0.02)
    quiet = synthesize(echoes([20.0], 42.0), make_radar(WAVE)).samples
    # Between two cells of a map of twice the samples a Hann window loses up to 0.37 dB along each axis.
    assert -0.74 < db(quiet_map(quiet, make_radar(WAVE), SETTINGS).max()) < 0.01


def test_a_scene_file_holds_the_stagger():
    radar = rc.Radar(rc.Waveform(77e9, 500e6, 15e-6, n_chirps=48, n_samples=64, stagger=STAGGER))
    again = rc.Scene.from_text(rc.Scene(radar=radar).to_toml()).radar.waveform
    assert again == radar.waveform and again.repetition == pytest.approx(50e-6)
    assert again.start_of(4) == pytest.approx(190e-6) and again.fold_count == 15


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stagger": (10e-6, 20e-6)}, "at least the chirp"),
        ({"stagger": (20e-6, 25e-6, 30e-6, 35e-6, 41e-6)}, "multiple of the 5"),
        ({"stagger": (20e-6, 30e-6), "repetition": 20e-6}, "either repetition or stagger"),
    ],
)
def test_staggers_that_cannot_be_are_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        Waveform(77e9, 500e6, 15e-6, n_chirps=192, n_samples=128, **changes)
    with pytest.raises(ValueError, match="one transmitter"):
        make_radar(WAVE, tx_elements=np.zeros((2, 3)), multiplexing="tdm")


def test_rates_that_staggered_times_tell_apart_are_not_warned_of(tmp_path, capsys):
    text = (
        "[radar.waveform]\nbandwidth_mhz = 500.0\nchirp_us = 20.0\nstagger_us = [40, 50, 60]\nchirps = 48\n"
        'samples = 64\n[[bodies]]\nname = "fast"\nshape = "box"\nposition = [9.0, 0.0, 0.5]\n'
        "velocity_mps = [%g, 0, 0]\n"
    )
    for speed, words in ((-30.0, None), (-130.0, "beyond the unambiguous range rate 97.03 m/s: it appears near")):
        scene = tmp_path / "s.toml"
        scene.write_text(text % speed)
        assert invoke(["info", str(scene)]) == 0
        told = capsys.readouterr()
        assert "+-97.03 m/s" in told.out and "40, 50, 60 us in turn" in told.out
        assert words in " ".join(told.err.split()) if words else "unambiguous" not in told.err
