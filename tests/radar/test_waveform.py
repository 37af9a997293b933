"""Waveform and sensor: the formulas of the study's tables, mounts, fields and noise."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from support.places import SCENES
from support.study_tables import figures

from raychan.poses import rotation
from raychan.radar.antenna import ArrayAntenna, CosineAntenna, IsotropicAntenna
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.units import watt
from raychan.world.scene_files.radar_mount import antenna_of

_TABLE_2 = figures(2)
_RAMP = _TABLE_2["chirp"] * 1e-6
URBAN = Waveform(77e9, _TABLE_2["bandwidth"] * 1e6, _RAMP, _RAMP, 128, 512)
NARROW = Waveform(77e9, 1e9, 40e-6, 40e-6, 128, 1024)
WIDE = Waveform(77e9, 4e9, 40e-6, 40e-6, 128, 1024)


def make_radar(**changes):
    given = dict(
        position=(1.0, 2.0, 0.5),
        antenna=IsotropicAntenna(),
        rx_antenna=IsotropicAntenna("H"),
        waveform=NARROW,
        power=0.01,
        noise_figure_db=12.0,
    )
    return Radar(**(given | changes))


def directions(n, seed=0):
    d = np.random.default_rng(seed).normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1)[:, None]


def test_c001_c003_range_resolution_of_the_three_bandwidths():
    assert WIDE.range_resolution == pytest.approx(0.0375, abs=5e-5)
    assert NARROW.range_resolution == pytest.approx(0.150, abs=2e-4)
    assert URBAN.range_resolution == pytest.approx(0.2636, abs=0.001)


def test_c004_c005_rate_resolution():
    assert NARROW.rate_resolution == pytest.approx(0.380, rel=0.02)
    assert URBAN.rate_resolution == pytest.approx(0.249, rel=0.01)


def test_c006_samples_are_rate_times_duration():
    assert NARROW.sample_rate * NARROW.chirp_duration == pytest.approx(1024)
    assert WIDE.slope == pytest.approx(100e12)


def test_c007_iq_doubles_the_unambiguous_range():
    assert WIDE.unambiguous_range == pytest.approx(38.37, abs=0.01)
    assert dataclasses.replace(WIDE, complex_sampling=False).unambiguous_range == pytest.approx(19.19, abs=0.01)


def test_c008_unambiguous_rate():
    assert NARROW.unambiguous_rate == pytest.approx(24.33, abs=0.01)
    assert NARROW.unambiguous_rate == pytest.approx(0.5 * NARROW.n_chirps * NARROW.rate_resolution)


@pytest.mark.parametrize(
    ("name", "dbm", "printed", "of"),
    [("array_2x2", 12.0, 2, ""), ("patch", 10.0, 8, "patch: "), ("array_16x16", 10.0, 8, "array: ")],
)
def test_c009_eirp_and_greatest_path_loss(name, dbm, printed, of):
    tx = antenna_of(f"antennas/{name}.toml", "V", SCENES, "antenna")
    budget = make_radar(tx_antenna=tx, power=float(watt(dbm))).link_budget(sensitivity_dbm=-120.0)
    theirs = figures(printed)
    assert budget["eirp_dbm"] == pytest.approx(theirs[f"{of}EIRP"], abs=0.01)
    assert budget["max_path_loss_db"] == pytest.approx(theirs[f"{of}greatest path loss at -120 dBm"], abs=0.01)


def test_centre_is_the_mean_of_all_sample_instants():
    w = Waveform(77e9, 1e9, 30e-6, 40e-6, 7, 16)
    t = np.arange(7)[:, None] * w.repetition + np.arange(16) / w.sample_rate
    assert w.centre == pytest.approx(t.mean(), rel=1e-12)


@pytest.mark.parametrize(
    "change",
    [
        {"carrier": 0.0},
        {"bandwidth": -1e9},
        {"chirp_duration": math.nan},
        {"repetition": 20e-6},
        {"n_chirps": 0},
        {"n_samples": 10.5},
    ],
)
def test_impossible_waveforms_name_the_field(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        dataclasses.replace(NARROW, **change)


def test_noise_is_ktbf_of_the_sample_rate():
    s = make_radar(noise_figure_db=0.0, waveform=dataclasses.replace(NARROW, n_samples=40))  # 1 MS/s
    assert 10.0 * math.log10(s.noise_power) + 30.0 == pytest.approx(-113.975, abs=0.001)
    assert make_radar(noise_figure_db=12.0).noise_power / make_radar(noise_figure_db=2.0).noise_power == pytest.approx(
        10.0
    )
    assert make_radar(noise=False).noise_power == make_radar().noise_power


def test_fields_are_transverse_and_carry_the_gain():
    array = ArrayAntenna(4, 2, 0.6, 0.5)
    s = make_radar(tx_antenna=array, yaw_deg=40.0, pitch_deg=-11.0, roll_deg=23.0)
    d = directions(500)
    field = s.tx_field(d)
    np.testing.assert_allclose((field * d).sum(axis=1), 0.0, atol=1e-12)
    local = d @ rotation(*np.radians([40.0, -11.0, 23.0]))
    np.testing.assert_allclose(np.linalg.norm(field, axis=1), np.abs(array.field(local)[:, 0]), atol=1e-12)


def test_level_radar_sends_vertical_and_gathers_horizontal_ahead():
    s = make_radar(yaw_deg=30.0)
    np.testing.assert_allclose(s.tx_field(s.boresight[None])[0], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(s.rx_field(s.boresight[None])[0], [-0.5, math.sqrt(0.75), 0.0], atol=1e-12)


def test_a_quarter_roll_turns_vertical_into_horizontal():
    rolled, level = make_radar(roll_deg=90.0), make_radar()
    ahead = level.boresight[None]
    crossed = abs(np.vdot(rolled.tx_field(ahead)[0], level.tx_field(ahead)[0]))
    aligned = abs(np.vdot(rolled.tx_field(ahead)[0], level.rx_field(ahead)[0]))
    assert crossed == pytest.approx(0.0, abs=1e-12)
    assert aligned == pytest.approx(1.0)


def test_turning_radar_and_world_together_changes_nothing():
    turn = rotation(math.radians(63.0))
    d = directions(100, seed=3)
    patch = CosineAntenna(86.0, 60.0)
    still = make_radar(
        tx_antenna=patch, yaw_deg=17.0, pitch_deg=6.0, elements=[[0.0, 0.002, 0.0], [0.0, -0.002, 0.001]]
    )
    moved = dataclasses.replace(still, yaw_deg=17.0 + 63.0)
    np.testing.assert_allclose(moved.tx_field(d @ turn.T), still.tx_field(d) @ turn.T, atol=1e-12)
    np.testing.assert_allclose(moved.elements_world, still.elements_world @ turn.T, atol=1e-15)


@pytest.mark.parametrize(
    ("velocity", "yaw_deg", "speed"),
    [
        ((7.0, 0.0, 0.0), 0.0, 7.0),
        ((7.0, 0.0, 0.0), 180.0, -7.0),
        ((3.0, 4.0, 0.0), 11.0, 5.0),
        ((0.0, 0.0, 0.0), 0.0, 0.0),
    ],
)
def test_ego_speed_is_signed_along_the_boresight(velocity, yaw_deg, speed):
    assert make_radar(velocity=velocity, yaw_deg=yaw_deg).ego_speed == pytest.approx(speed)


def test_sensors_are_frozen_and_default_to_one_receiver_at_rest():
    s = make_radar()
    assert s.elements.shape == (1, 3) and not s.elements.any() and not s.velocity.any()
    with pytest.raises(ValueError, match="read-only"):
        s.position[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        s.power = 1.0


@pytest.mark.parametrize(
    "change",
    [
        {"position": (0.0, 0.0)},
        {"velocity": (0.0, math.inf, 0.0)},
        {"elements": np.zeros((0, 3))},
        {"elements": (0.0, 0.0, 0.0)},
        {"power": 0.0},
        {"yaw_deg": math.nan},
        {"noise_figure_db": math.inf},
    ],
)
def test_impossible_sensors_name_the_field(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        make_radar(**change)
