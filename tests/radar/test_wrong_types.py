"""Wrong types and empty tables of receivers, interferers and rough surfaces are told in a sentence."""

from dataclasses import replace

import pytest

import raychan as rc
from raychan.em.diffuse import Diffuse
from raychan.radar.impairments import ChirpError, Converter
from raychan.radar.interferer import Interferer
from raychan.world.errors import SceneError

WAVE = rc.Waveform(77e9, 500e6, 20e-6)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: rc.Impairments(phase_noise=[[1e4, -80.0]]), "phase_noise = .*: a PhaseNoise is wanted, or None"),
        (lambda: rc.Impairments(chirp_error=[[0, 1], [1, 2]]), "chirp_error = .*: a ChirpError is wanted, or None"),
        (lambda: rc.Impairments(converter=8), "converter = 8: a Converter is wanted, or None"),
        (lambda: rc.Impairments(iq_gain_db="a"), "iq_gain_db = 'a': must be finite, a number"),
        (lambda: rc.Impairments(iq_gain_db=None), "iq_gain_db = None: must be finite, a number"),
        (lambda: rc.Impairments(dc_offset_dbm=float("inf")), "dc_offset_dbm = inf: must be finite"),
        (lambda: rc.PhaseNoise([]), r"PhaseNoise.mask: at least 1 pair .*, \[offset Hz, level dBc/Hz\]; none given"),
        (lambda: rc.PhaseNoise([[1e4]]), r"at least 1 pair .*; \[\[10000.0\]\] given"),
        (lambda: rc.PhaseNoise([["a", 1.0]]), "at least 1 pair of finite numbers wanted"),
        (lambda: rc.PhaseNoise([[1e4, -80.0], [1e5]]), "at least 1 pair of finite numbers wanted"),
        (lambda: rc.PhaseNoise(None), "at least 1 pair of finite numbers wanted"),
        (lambda: ChirpError([]), "at least 2 pairs of finite numbers wanted, .*; none given"),
        (lambda: ChirpError("ramp"), "at least 2 pairs .*; 'ramp' given"),
        (lambda: Converter(None, 0.0), "Converter.bits = None: a whole number from 1 to 24 wanted"),
        (lambda: Converter(float("nan"), 0.0), "Converter.bits = nan: a whole number from 1 to 24 wanted"),
        (lambda: Converter(8, "0"), "Converter.full_scale_dbm = '0': must be finite, a number"),
        (lambda: rc.Radar(WAVE, impairments=3), "Radar.impairments = 3: an Impairments is wanted"),
        (lambda: rc.Radar({"carrier": 77e9}), "Radar.waveform = {'carrier': .*}: a Waveform is wanted"),
        (lambda: rc.Radar(WAVE, antenna="patch"), "Radar.antenna = 'patch': an Antenna is wanted"),
        (lambda: rc.Radar(WAVE, power="12"), "Radar.power = '12': must be finite, a number"),
        (lambda: rc.Radar(WAVE, yaw_deg=None), "Radar.yaw_deg = None: must be finite, a number"),
        (lambda: rc.Radar(WAVE, noise="no"), "Radar.noise = 'no': must be true or false"),
        (lambda: rc.Radar(WAVE, position=None), r"Radar.position: numbers of shape \(3,\) wanted, None given"),
        (lambda: rc.Radar(WAVE, elements="a"), r"Radar.elements: numbers of shape \(n, 3\) wanted, 'a' given"),
        (lambda: replace(WAVE, carrier="77"), "Waveform.carrier = '77': must be finite, a number"),
        (lambda: replace(WAVE, carrier=None), "Waveform.carrier = None: must be finite, a number"),
        (lambda: replace(WAVE, n_chirps=True), "Waveform.n_chirps = True: must be a whole number"),
        (lambda: replace(WAVE, n_samples="64"), "Waveform.n_samples = '64': must be a whole number"),
        (lambda: replace(WAVE, complex_sampling="no"), "Waveform.complex_sampling = 'no': must be true or false"),
        (lambda: replace(WAVE, stagger=3), r"Waveform.stagger = 3: times \[s\] wanted, as"),
        (lambda: replace(WAVE, bandwidth=77e9), "bandwidth = 7.7e.10 Hz: must be below the carrier of 7.7e.10 Hz"),
        (lambda: Interferer(None), "Interferer.radar = None: a Radar is wanted"),
        (lambda: Interferer(rc.Radar(WAVE), start=None), "Interferer.start = None: must be finite, a number"),
        (lambda: Diffuse("gamma", "a"), "level_db = 'a': a number is wanted"),
        (lambda: Diffuse("gamma", -3.0, exponent="4"), "exponent = '4': a number is wanted"),
        (lambda: Diffuse("gamma", -3.0, k_shape=True), "k_shape = True: a number is wanted"),
        (lambda: Diffuse("gamma", -3.0, texture_m=None), "texture_m = None: a number is wanted"),
    ],
)
def test_a_wrong_type_or_an_empty_table_is_told_with_what_is_wanted(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_scenes_tell_of_interferers_and_materials_of_the_wrong_type():
    with pytest.raises(SceneError, match="interferers: None is not possible; allowed: an Interferer or its table"):
        rc.Scene(radar=rc.Radar(WAVE), interferers=[None])
    with pytest.raises(SceneError, match="diffuse: 3 is not possible; allowed: a Diffuse, or None"):
        rc.Material(diffuse=3)
    empty = "[radar.waveform]\nbandwidth_mhz = 500.0\nchirp_us = 20.0\n[radar.impairments]\nphase_noise_hz_dbc = []\n"
    with pytest.raises(SceneError, match=r"phase_noise_hz_dbc: \[\] is not possible; allowed: a list of at least 1"):
        rc.Scene.from_text(empty)
