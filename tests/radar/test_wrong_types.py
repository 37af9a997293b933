"""Wrong types and empty tables of receivers, interferers and rough surfaces are told in a sentence."""

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
