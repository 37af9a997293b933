"""The link budget's sensitivity is the noise of the map."""

import dataclasses

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.records import Cube
from raychan.run.receiver import map_of
from raychan.signal.baseband import noisy
from raychan.units import C0, dbm

WAVE = rc.Waveform(77e9, 300e6, 20e-6, n_chirps=64, n_samples=128)
HALF = 0.5 * C0 / 77e9
PLAIN = rc.Processing(range_window="rect", rate_window="rect", pad=(1, 1))
REAL = dataclasses.replace(WAVE, complex_sampling=False)
STAGGERED = dataclasses.replace(WAVE, stagger=(20e-6, 25e-6), repetition=None)


@pytest.mark.parametrize(
    ("radar", "channels"),
    [
        (rc.Radar(WAVE, processing=PLAIN), 1),
        (rc.Radar(REAL, processing=PLAIN), 1),
        (rc.Radar(WAVE, processing=PLAIN, elements=rc.uniform_array(8, HALF)), 8),
        (rc.Radar(WAVE, processing=PLAIN, multiplexing="tdm", **rc.mimo_array(2, 4, HALF)), 8),
        (rc.Radar(REAL, processing=PLAIN, multiplexing="tdm", **rc.mimo_array(2, 4, HALF)), 8),
        (rc.Radar(WAVE, processing=PLAIN, multiplexing="ddm", ddm_slots=4, **rc.mimo_array(3, 4, HALF)), 12),
        (rc.Radar(STAGGERED, processing=PLAIN), 1),
    ],
)
def test_the_sensitivity_is_the_noise_of_one_channels_map(radar, channels):
    quiet = np.zeros((len(radar.elements), radar.waveform.n_chirps, radar.waveform.n_samples), np.complex64)
    rdmap = map_of(noisy(Cube(quiet, 0.0), radar, np.random.default_rng(1)), radar, PLAIN)
    budget = radar.link_budget()
    assert budget["sensitivity_dbm"] == pytest.approx(float(dbm(rdmap.noise)), abs=1e-6)
    assert budget["sensitivity_dbm"] == pytest.approx(float(dbm(rdmap.power.mean())), abs=0.2)
    beam = np.abs(rdmap.spectrum.mean(axis=0)) ** 2
    assert budget["beam_sensitivity_dbm"] == pytest.approx(float(dbm(beam.mean())), abs=0.2)
    assert budget["array_gain_db"] == pytest.approx(10.0 * np.log10(channels))


def test_a_sensitivity_that_is_given_is_that_of_a_channel():
    budget = rc.Radar(WAVE, elements=rc.uniform_array(10, HALF)).link_budget(-120.0)
    assert (budget["sensitivity_dbm"], budget["beam_sensitivity_dbm"]) == pytest.approx((-120.0, -130.0))


def test_info_tells_the_noise_of_channels_and_of_beams(tmp_path, capsys):
    for elements, words in ((rc.uniform_array(8, HALF), True), (np.zeros((1, 3)), False)):
        (tmp_path / "s.toml").write_text(rc.Scene(radar=rc.Radar(WAVE, elements=elements)).to_toml())
        assert invoke(["info", str(tmp_path / "s.toml")]) == 0
        told = capsys.readouterr().out
        assert "of the map of one channel" in told and ("cell of a beam's map" in told) == words
