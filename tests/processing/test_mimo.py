"""MIMO processing: azimuths of movers, folded rates, power and noise, by time and by Doppler division."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.echoes import echoes, make_radar

import raychan as rc
from raychan.processing.beams import BeamBank
from raychan.processing.cfar import Grid, factor, training
from raychan.processing.detector_map import StrongestBeam
from raychan.processing.mimo import virtual_range_doppler
from raychan.processing.range_doppler import range_doppler
from raychan.processing.staggered import ResolvedMap, fold_range, hypotheses
from raychan.radar.processing import Processing
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.run.receiver import aperture_of, detections_in, map_of, noise_of_cell, quiet_map
from raychan.signal.baseband import synthesize
from raychan.units import db

WAVE = Waveform(77e9, 500e6, 15e-6, 20e-6, 192, 64)
"""48.7 m/s do not fold with one transmitter, 16.2 m/s with three."""
LINE = rc.mimo_array(3, 8, 0.5 * WAVE.wavelength)
SETTINGS = Processing()


def mimo(multiplexing, **changes):
    return make_radar(WAVE, **(LINE | {"multiplexing": multiplexing} | changes))


def found(radar, paths, seed=None, settings=SETTINGS):
    rng = None if seed is None else np.random.default_rng(seed)
    rdmap = map_of(synthesize(paths, radar, rng), radar, settings)
    return rdmap, detections_in(rdmap, radar, settings)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
@pytest.mark.parametrize(
    ("rate", "azimuth_deg"),
    [(-20.0, 12.5), (0.0, 55.0), (20.0, -40.0), (33.0, -3.0)],
)
def test_azimuth_and_rate_of_a_mover_are_its_own(multiplexing, rate, azimuth_deg):
    """20 m/s fold and turn the phase by 0.2 turns from transmitter to transmitter: still within 0.5 deg."""
    radar = mimo(multiplexing)
    _, seen = found(radar, echoes([40.0], rate, 1.0, np.radians(azimuth_deg)))
    assert np.degrees(seen.azimuth[0]) == pytest.approx(azimuth_deg, abs=0.1)
    assert seen.rate[0] == pytest.approx(rate, abs=0.05)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_movers_in_noise_keep_their_azimuths(multiplexing):
    """23 dB above the noise of a cell of one receiver, random azimuths and rates: within 0.5 deg."""
    radar, rng = mimo(multiplexing, noise=True), np.random.default_rng(3)
    level = np.sqrt(200.0 * noise_of_cell(radar, SETTINGS))
    for seed in range(12):
        azimuth, rate = rng.uniform(-45.0, 45.0), rng.uniform(-40.0, 40.0)
        _, seen = found(radar, echoes([40.0], rate, level, np.radians(azimuth)), seed)
        assert np.degrees(seen.azimuth[0]) == pytest.approx(azimuth, abs=0.5)
        assert seen.rate[0] == pytest.approx(rate, abs=0.1)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
@pytest.mark.parametrize("settings", [{"doa": "music"}, {"doa": "esprit"}, {"doa": "capon"}, {"beams": "mean"}])
def test_a_mover_at_20_m_per_s_has_its_azimuth_by_any_method(multiplexing, settings):
    """Folded, in noise, through the detector of the default or another: within 0.5 deg."""
    radar = mimo(multiplexing, noise=True)
    level = np.sqrt(300.0 * noise_of_cell(radar, SETTINGS))
    _, seen = found(radar, echoes([30.0], 20.0, level, np.radians(17.0)), 1, Processing(**settings))
    assert np.degrees(seen.azimuth) == pytest.approx([17.0], abs=0.5)
    assert seen.rate == pytest.approx([20.0], abs=0.1)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
@pytest.mark.parametrize("doa", ["bartlett", "capon", "music", "esprit"])
@pytest.mark.parametrize("phase", [0.0, 1.5, 3.0])
def test_two_movers_folded_alike_in_one_cell_are_two_detections(multiplexing, doa, phase):
    radar = mimo(multiplexing, noise=True)
    level = np.sqrt(300.0 * noise_of_cell(radar, SETTINGS))
    paths = echoes([30.0, 30.0], 20.0, level * np.array([1.0, np.exp(1j * phase)]), np.radians([-20.0, 20.0]))
    _, seen = found(radar, paths, 1, Processing(doa=doa))
    assert np.degrees(np.sort(seen.azimuth)) == pytest.approx([-20.0, 20.0], abs=0.5)
    assert seen.rate == pytest.approx([20.0, 20.0], abs=0.1)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
@pytest.mark.parametrize("level_db", [9.0, 40.0, 80.0])
def test_movers_that_only_the_beams_see_and_very_strong_ones_are_one_detection_each(multiplexing, level_db):
    """From 9 dB above the noise of a channel, 23 dB in the beam of 24: no echo has a fold of its neighbour's cell."""
    radar, rng = mimo(multiplexing, noise=True), np.random.default_rng(100)
    level = np.sqrt(10.0 ** (0.1 * level_db) * noise_of_cell(radar, SETTINGS))
    for seed in range(10):
        azimuth, rate = rng.uniform(-30.0, 30.0), rng.uniform(-48.0, 48.0)
        _, seen = found(radar, echoes([30.0], rate, level, np.radians(azimuth)), seed)
        assert np.degrees(seen.azimuth) == pytest.approx([azimuth], abs=0.7)
        assert seen.rate == pytest.approx([rate], abs=0.15)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_noise_keeps_the_false_alarm_rate_though_folds_are_chosen_by_their_beams(multiplexing):
    """The bound is the sum over the folds, which overlap: 0.5 of the rate by time, 0.3 by Doppler division; without
    it 1.4 and 1.3."""
    radar, rng, pfa = mimo(multiplexing, noise=True), np.random.default_rng(5), 1e-3
    bank, alarms, cells = BeamBank(aperture_of(radar)), 0, 0
    while cells * pfa < 200:
        samples = rng.standard_normal((8, WAVE.n_chirps, WAVE.n_samples, 2)).view(complex)[..., 0].astype(np.complex64)
        rdmap = virtual_range_doppler(Cube(samples=samples, noise_power=2.0), radar)
        ring, beams = training(Grid.of(rdmap), (2, 2), (3, 3)), StrongestBeam(rdmap, bank)
        high = np.argwhere(beams.power > 2.0 * beams.noise)
        threshold = factor(bank.single(pfa / hypotheses(radar)), ring.worth, "os") * beams.level(high, ring, "os")
        alarms, cells = alarms + int((beams.power[tuple(high.T)] > threshold).sum()), cells + rdmap.power.size
    assert 0.2 < alarms / (pfa * cells) < 1.0


@pytest.mark.parametrize("doa", ["bartlett", "music"])
def test_receivers_of_both_polarisations_never_share_a_beam(doa):
    """Co- and cross-polarised receivers stand at the same places: the detections are those of the co-polarised."""
    settings = Processing(doa=doa)
    radar, both = (mimo("tdm", noise=True, rx_polarization=p) for p in (None, "both"))
    level = np.sqrt(300.0 * noise_of_cell(radar, SETTINGS))
    cube = synthesize(echoes([30.0], 20.0, level, 0.3), radar, np.random.default_rng(1))
    alone = detections_in(map_of(cube, radar, settings), radar, settings)
    twice = cube.replace(samples=np.concatenate([cube.samples, 1j * cube.samples]))
    for cross in (False, True):
        rdmap = map_of(twice, both, settings, cross)
        seen = detections_in(rdmap, both, settings)
        assert len(rdmap.spectrum) == 24 and len(seen.range) == 1
        assert seen.azimuth == pytest.approx(alone.azimuth) and seen.power == pytest.approx(alone.power)


def test_without_the_phase_of_its_doppler_shift_a_mover_would_be_elsewhere():
    """What the hypotheses are for: a folded mover misses the 0.5 deg."""
    radar, paths = mimo("tdm"), echoes([40.0], 20.0, 1.0, 0.2)
    cube = synthesize(paths, radar)
    bare = virtual_range_doppler(cube, radar, resolve=False)
    off = np.degrees(detections_in(bare, radar, replace(SETTINGS, doa="music")).azimuth[0]) - np.degrees(0.2)
    assert abs(off) > 0.5


def test_slots_of_doppler_division_share_the_rates_that_do_not_fold():
    """By default one more than transmitters; with as many, folds are open where the steps between them are whole."""
    for slots in (None, 3, 6):
        radar = mimo("ddm", ddm_slots=slots)
        rdmap, seen = found(radar, echoes([40.0], 2.0, 1.0, 0.3))
        assert rdmap.unambiguous_rate == pytest.approx(WAVE.unambiguous_rate / (slots or 4), rel=0.01)
        assert seen.rate[0] == pytest.approx(2.0, abs=0.05) and seen.azimuth[0] == pytest.approx(0.3, abs=2e-3)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_a_lone_echo_reads_its_power_and_noise_that_of_the_chirps_of_a_channel(multiplexing):
    radar = mimo(multiplexing)
    rdmap, seen = found(radar, echoes([40.0], 7.0, 1e-5, 0.1))
    assert rdmap.spectrum.shape[0] == 24 and isinstance(rdmap, ResolvedMap)
    assert db(seen.power[0] / 1e-10) == pytest.approx(0.0, abs=0.1)
    loud = mimo(multiplexing, noise=True)
    maps = [map_of(synthesize(echoes([]), loud, np.random.default_rng(seed)), loud, SETTINGS) for seed in (1, 2)]
    noise = maps[0]
    assert db(np.mean([m.power.mean() for m in maps]) / noise.noise) == pytest.approx(0.0, abs=0.05)
    assert noise.noise == pytest.approx(noise_of_cell(loud, SETTINGS), rel=1e-6)
    # All three transmit at once by Doppler division: each chirp brings three times the power.
    alone = noise_of_cell(make_radar(WAVE, noise=True), SETTINGS)
    assert db(noise.noise / alone) == pytest.approx(db(3.0) if multiplexing == "tdm" else 0.0, abs=0.1)


def test_one_transmitter_has_the_map_of_the_plain_processor_to_the_last_digit():
    radar = make_radar(WAVE, elements=LINE["elements"])
    cube = synthesize(echoes([40.0, 20.0], [3.0, -9.0], [1.0, 0.1], 0.2), radar)
    rdmap = map_of(cube, radar, SETTINGS)
    assert not isinstance(rdmap, ResolvedMap)
    assert np.array_equal(rdmap.spectrum, range_doppler(cube, WAVE).spectrum)
    assert np.array_equal(quiet_map(cube.samples, radar, SETTINGS), rdmap.power)


def test_one_receiver_leaves_folds_open():
    """A fold then looks like another azimuth: no hypothesis is better, and the rate stays folded."""
    radar = make_radar(WAVE, tx_elements=rc.uniform_array(3, 0.5 * WAVE.wavelength), multiplexing="tdm")
    rdmap, seen = found(radar, echoes([40.0], 5.0, 1.0, 0.2))
    assert not rdmap.fold.any() and seen.azimuth[0] == pytest.approx(0.2, abs=5e-3)


def test_folds_cover_the_rates_of_the_chirps():
    assert fold_range(3) == [0, -1, 1] and fold_range(4) == [0, -1, 1, 2] and fold_range(1) == [0]


def test_chirps_that_are_no_multiple_of_the_transmitters_are_refused():
    radar = make_radar(Waveform(77e9, 500e6, 15e-6, 20e-6, 64, 128), **LINE, multiplexing="tdm")
    with pytest.raises(ValueError, match="64 chirps cannot be shared among 3"):
        map_of(synthesize(echoes([10.0]), radar), radar, SETTINGS)
