"""Air, waveforms, radars and antennas made in Python have the limits of scene files, at once and with the reason."""

from dataclasses import replace

import numpy as np
import pytest

import raychan as rc
from raychan.radar.radar import Radar

WAVE = rc.Waveform(77e9, 500e6, 20e-6)
NAN = float("nan")
ANTENNAS = (
    rc.IsotropicAntenna(),
    rc.CosineAntenna(80.0, 60.0),
    rc.ArrayAntenna(4, 2, 0.5, 0.5),
    rc.MeasuredAntenna([-1.0, 1.0], [-1.0, 1.0], np.zeros((2, 2)), np.zeros((2, 2))),
)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        *(
            (lambda name=name, x=x: rc.Atmosphere(**{name: x}), f"Atmosphere.{name} = {x!r}: (must lie|a number is)")
            for name, bad in (
                ("temperature_c", -300.0), ("pressure_hpa", -1), ("vapour_gm3", -1.0), ("rain_mmh", -10),
                ("fog_gm3", 6.0),
            )
            for x in (bad, NAN, "3", True)
        ),
        (lambda: rc.Atmosphere().specific(77e9, "v"), "polarization = 'v': must be V or H"),
        (lambda: rc.Radar(WAVE, antenna=rc.CosineAntenna), r"antenna = CosineAntenna: an Antenna is wanted, an obj"),
        (lambda: rc.Radar(rc.Waveform), "Radar.waveform = Waveform: a Waveform is wanted, an object of the class"),
        (lambda: rc.Radar(WAVE, noise_figure_db=-3), "Radar.noise_figure_db = -3: must lie between 0 and 60 dB"),
        (lambda: rc.Radar(WAVE, noise_figure_db=300), "Radar.noise_figure_db = 300: must lie between 0 and 60 dB"),
        (lambda: rc.Radar(WAVE, noise_temperature_k=-1), "noise_temperature_k = -1: must lie between 0 and 1"),
        (lambda: rc.Waveform(77e9, 1e9, 25), "Waveform.chirp_duration = 25.0: must lie between 1e-09 and 1 s"),
        (lambda: replace(WAVE, repetition=100), "Waveform.repetition = 100.0: must lie between 1e-09 and 64 s"),
        (lambda: replace(WAVE, repetition=None, stagger=[3, 4]), r"stagger\[0\] = 3.0: must lie between 1e-09 and 1"),
        (lambda: replace(WAVE, carrier=77), "Waveform.carrier = 77.0: must lie between 1e.08 and 1e.12 Hz"),
        (lambda: replace(WAVE, n_chirps=0), "Waveform.n_chirps = 0: must be 1 or more"),
        (lambda: rc.MeasuredAntenna([-90, 90], [-1, 1], *np.zeros((2, 2, 2))), "azimuth: holds 90; radians within"),
        (lambda: rc.MeasuredAntenna([-1, 1], [-3, 3], *np.zeros((2, 2, 2))), "elevation: holds 3; radians within"),
        (lambda: rc.IsotropicAntenna(loss_db=-80), "loss_db = -80.0: must lie between -60 and 100 dB"),
    ],
)  # fmt: skip
def test_what_is_beyond_limits_is_refused_when_it_is_made(make, said):
    with pytest.raises(ValueError, match=said):
        make()


@pytest.mark.parametrize("antenna", ANTENNAS, ids=lambda x: type(x).__name__)
def test_antennas_take_lists_and_refuse_directions_not_of_length_one(antenna):
    assert antenna.field([1, 0, 0]).tolist() == antenna.field(np.array([[1.0, 0.0, 0.0]])).tolist()
    assert antenna.field([[1, 0, 0], [0, 1, 0], [0, 0, 0]]).shape == (3, 2)
    with pytest.raises(ValueError, match=r"direction\[1\] = \[2.0, 0.0, 0.0\]: of length 1 is wanted, not 2"):
        antenna.field([[1, 0, 0], [2, 0, 0]])
    with pytest.raises(ValueError, match=r"direction of shape \(1, 2\): unit vectors of shape"):
        antenna.field([1, 0])


def test_the_units_of_a_measured_antenna_stand_in_its_help():
    assert all(unit in rc.MeasuredAntenna.__doc__ for unit in ("[rad]", "[dBi]"))


def test_a_channel_of_the_slowest_ramps_and_a_full_turn_are_possible():
    slow = rc.Waveform(77e9, 1e6, 1.0, n_chirps=64)
    assert Radar(slow, multiplexing="ddm", ddm_slots=64).channel_waveform.repetition == 64.0
    turn = np.linspace(-np.pi, np.pi, 5)
    assert len(rc.MeasuredAntenna(turn, turn / 2, *np.zeros((2, 5, 5))).azimuth) == 5
