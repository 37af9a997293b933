"""Wrong types and empty tables of receivers, interferers and rough surfaces are told in a sentence."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import raychan as rc
from raychan.em.diffuse import Diffuse
from raychan.radar.impairments import ChirpError, Converter
from raychan.radar.interferer import Interferer
from raychan.world.errors import SceneError

WAVE = rc.Waveform(77e9, 500e6, 20e-6)

NAN = float("nan")
WORDS = np.array(["V", "ca"])


def measured(**change):
    given = {"azimuth": [-1.0, 0.0, 1.0], "elevation": [-1.0, 1.0], "gain_db": np.zeros((3, 2))}
    return rc.MeasuredAntenna(**({**given, "phase": np.zeros((3, 2))} | change))


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
        (lambda: rc.Radar(WAVE, position=("1", "2", "3")), r"Radar.position: numbers of shape \(3,\) wanted, \('1'"),
        (lambda: rc.Radar(WAVE, position=(True, 0, 0)), r"Radar.position: numbers of shape \(3,\) wanted, \(True"),
        (lambda: replace(WAVE, stagger=(True, 5e-5)), r"Waveform.stagger = \(True, 5e-05\): times \[s\] wanted"),
        (lambda: replace(WAVE, stagger=[[3e-5], [5e-5]]), r"Waveform.stagger = .*: times \[s\] wanted"),
        (lambda: Interferer(rc.Radar(WAVE), name=[1]), r"Interferer.name = \[1\]: must be a text"),
        (lambda: Interferer(rc.Radar(WAVE), name=NAN), "Interferer.name = nan: must be a text"),
        *(
            (lambda name=name, x=x: rc.Processing(**{name: x}), f"Processing.{name} = .*: must be two whole numbers of")
            for name in ("pad", "guard", "train")
            for x in (3, "ab", (NAN, 1), (1,), ("1", "2"), (True, 2), [2.5, 1])
        ),
        (lambda: rc.Processing(pad=None), "Processing.pad = None: must be two whole numbers of at least 1"),
        (lambda: rc.Processing(pfa="3"), "Processing.pfa = '3': must be finite, a number"),
        (lambda: rc.Processing(min_snr_db=None), "Processing.min_snr_db = None: must be finite, a number"),
        *(
            (lambda name=name, x=x: rc.Processing(**{name: x}), f"Processing.{name} = {x!r}: must be one of rect, hann")
            for name in ("range_window", "rate_window", "beam_window")
            for x in (None, 3, "foo")
        ),
        (lambda: rc.IsotropicAntenna(loss_db=None), "loss_db = None: must be finite, a number"),
        (lambda: rc.IsotropicAntenna(front="no"), "front = 'no': must be true or false"),
        (lambda: rc.CosineAntenna("3", 20.0), "hpbw_h_deg = '3': must be finite, a number"),
        (lambda: rc.CosineAntenna(0.0, 20.0), "hpbw_h_deg = 0.0: must be positive"),
        (lambda: rc.ArrayAntenna("3", 2, 0.5, 0.5), "ny = '3': must be finite, a number"),
        (lambda: rc.ArrayAntenna(4, 2.5, 0.5, 0.5), "ArrayAntenna.nz = 2.5: must be a whole number"),
        (lambda: rc.ArrayAntenna(True, 2, 0.5, 0.5), "ny = True: must be finite, a number"),
        (lambda: rc.ArrayAntenna(10**12, 2, 0.5, 0.5), "ny, nz = 1000000000000, 2: at most 1000 elements a row"),
        (lambda: rc.Radar(WAVE, power=10**400), "Radar.power = 1000.*: must be finite, a number"),
        (lambda: rc.ArrayAntenna(4, 2, "3", 0.5), "spacing_y = '3': must be finite, a number"),
        (lambda: rc.ArrayAntenna(4, 2, 0.5, 0.5, taper_y=3), "taper_y = 3: must be one of rect, hann"),
        (lambda: rc.ArrayAntenna(4, 2, 0.5, 0.5, element="patch"), "element = 'patch': an Antenna is wanted"),
        (lambda: rc.ArrayAntenna(4, 2, 0.5, 0.5, element=3), "element = 3: an Antenna is wanted"),
        (lambda: measured(azimuth=None), "MeasuredAntenna.azimuth = None: numbers are wanted"),
        (lambda: measured(elevation=["0", "1"]), "MeasuredAntenna.elevation = .*: numbers are wanted"),
        (lambda: measured(azimuth=[0.0]), "MeasuredAntenna.azimuth: 2 or more angles .* increasing"),
        (lambda: measured(azimuth=[1.0, 0.0, 2.0]), "MeasuredAntenna.azimuth: 2 or more angles .* increasing"),
        (lambda: measured(gain_db=np.full((3, 2), NAN)), "MeasuredAntenna.gain_db: finite numbers are wanted"),
        (lambda: measured(gain_db=np.zeros((2, 3))), r"gain_db of shape \(2, 3\): \(3, 2\) is wanted"),
        (lambda: Diffuse("gamma", -3.0, cross_db=NAN), "cross_db = nan: must lie between 0 and 100 dB"),
        (lambda: Diffuse("gamma", "a"), "level_db = 'a': a number is wanted"),
        (lambda: Diffuse("gamma", -3.0, exponent="4"), "exponent = '4': a number is wanted"),
        (lambda: Diffuse("gamma", -3.0, k_shape=True), "k_shape = True: a number is wanted"),
        (lambda: Diffuse("gamma", -3.0, texture_m=None), "texture_m = None: a number is wanted"),
        (lambda: Diffuse(WORDS, -3.0), "law = array.*: must be one of constant, gamma"),
        (lambda: Diffuse("gamma", 10**400), "level_db = 1000.*: a number is wanted"),
        (lambda: rc.IsotropicAntenna(WORDS), "polarization = array.*: must be V or H"),
        (lambda: rc.Radar(WAVE, multiplexing=WORDS), "Radar.multiplexing = array.*: must be one of none, tdm, ddm"),
        (lambda: rc.Radar(WAVE, rx_polarization=WORDS), "Radar.rx_polarization = array.*: must be V, H or both"),
        *(
            (lambda name=name: rc.Processing(**{name: WORDS}), f"Processing.{name} = array.*: must be ")
            for name in ("range_window", "rate_window", "beam_window", "cfar", "beams", "doa")
        ),
        *(
            (lambda name=name: rc.Processing(**{name: np.array(1)}), rf"{name} = array\(1\): must be two whole numbers")
            for name in ("pad", "guard", "train")
        ),
        (lambda: rc.PhaseNoise([[10**400, -80.0]]), "PhaseNoise.mask: at least 1 pair of finite numbers wanted"),
        (lambda: ChirpError([[0, 10**400], [1, 1]]), "ChirpError.table: at least 2 pairs of finite numbers wanted"),
        (lambda: Converter(10**400, 0.0), "Converter.bits = 1000.*: a whole number from 1 to 24 wanted"),
        (lambda: replace(WAVE, n_chirps=10**5000), "n_chirps = a number of thousands of digits: must be a whole"),
        (lambda: rc.CosineAntenna(1e300, 20.0), r"must be below 180 deg: hpbw_h_deg = 1e\+300 deg"),
        (lambda: replace(WAVE, repetition=1e-5), "repetition = 1e-05 s: shorter than chirp_duration = 2e-05 s"),
        (lambda: rc.mimo_array(0, 8, 2e-3), "n_tx = 0: must lie between 1 and 4096"),
        (lambda: rc.mimo_array(3, 0, 2e-3), "n_rx = 0: must lie between 1 and 4096"),
        (lambda: rc.uniform_array(4, 2e-3, axis=WORDS), "axis = array.*: must be y or z"),
    ],
)
def test_a_wrong_type_or_an_empty_table_is_told_with_what_is_wanted(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_lists_scalars_of_numpy_and_whole_numbers_stay_allowed():
    assert measured().field(np.eye(3)).shape == (3, 2)
    assert rc.Processing(pad=[2, np.int64(4)], guard=np.array([1, 1]), min_snr_db=12).pad[1] == 4
    assert rc.ArrayAntenna(np.int32(4), 2, 1, np.float32(0.5)).field(np.eye(3)).shape == (3, 2)
    assert rc.Radar(WAVE, position=[np.float32(1.0), 2, np.int8(3)], power=1).position.tolist() == [1.0, 2.0, 3.0]
    assert replace(WAVE, repetition=None, stagger=np.array([25e-6, 31e-6])).stagger == (25e-6, 31e-6)


def test_fractions_and_decimals_become_floats():
    wave = rc.Waveform(Fraction(77 * 10**9), Decimal(10**8), Fraction(1, 50000))
    assert wave == rc.Waveform(77e9, 1e8, 2e-5) and type(wave.bandwidth) is float
    assert Diffuse("gamma", Fraction(-7, 2)) == Diffuse("gamma", -3.5)
    assert rc.uniform_array(np.array(4), Fraction(1, 500)).tolist() == rc.uniform_array(4, 2e-3).tolist()


def test_an_element_far_off_is_told_without_a_warning_of_overflow(recwarn):
    with pytest.raises(ValueError, match=r"Radar.elements: an element is 1e\+300 m off the phase centre"):
        rc.Radar(WAVE, elements=[[0.0, 1e300, 0.0], [0.0, 0.0, 0.0]])
    assert not recwarn.list


def test_scenes_tell_of_interferers_and_materials_of_the_wrong_type():
    with pytest.raises(SceneError, match="interferers: None is not possible; allowed: an Interferer or its table"):
        rc.Scene(radar=rc.Radar(WAVE), interferers=[None])
    with pytest.raises(SceneError, match="diffuse: 3 is not possible; allowed: a Diffuse, or None"):
        rc.Material(diffuse=3)
    empty = "[radar.waveform]\nbandwidth_mhz = 500.0\nchirp_us = 20.0\n[radar.impairments]\nphase_noise_hz_dbc = []\n"
    with pytest.raises(
        SceneError, match=r"phase_noise_hz_dbc: \[\] is not possible; allowed: 1 or more pairs \[offset"
    ):
        rc.Scene.from_text(empty)
