"""Antennas: closed forms, power balance, the study's tables, and patterns from files."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.places import SCENES

from raychan.poses import direction, theta_phi
from raychan.radar.antenna import Antenna, ArrayAntenna, CosineAntenna, IsotropicAntenna
from raychan.radar.pattern import MeasuredAntenna, PatternError, characteristics, gain_dbi
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.radar.windows import window
from raychan.world.scene_files.antenna import AntennaTable
from raychan.world.scene_files.radar_mount import antenna_of

WAVE = Waveform(77e9, 1e9, 20e-6, 40e-6, 64, 128)
AHEAD = np.array([[1.0, 0.0, 0.0]])
EVERY = {
    "isotropic": IsotropicAntenna(),
    "front": IsotropicAntenna("H", front=True),
    "patch": CosineAntenna(86.0, 60.0),
    "array": ArrayAntenna(4, 3, 0.6, 0.5, "hann", "rect", CosineAntenna(100.0, 90.0)),
    "backed": ArrayAntenna(2, 2, 1.047, 0.544, element=IsotropicAntenna()),
}


def test_a_sensor_turns_theta_and_phi_parts_into_world_axes():
    looks = np.concatenate([fibonacci_sphere(200), np.eye(3), -np.eye(3)])
    for antenna in (*EVERY.values(), CosineAntenna(86.0, 60.0, "H")):
        radar = Radar(WAVE, antenna=antenna, yaw_deg=40.0, pitch_deg=-17.0, roll_deg=63.0)
        local = looks @ radar.axes
        theta, phi = theta_phi(local)
        parts = antenna.field(local)
        wanted = (parts[:, :1] * theta + parts[:, 1:] * phi) @ radar.axes.T
        np.testing.assert_allclose(radar.tx_field(looks), wanted, atol=1e-12)


def gain(antenna, directions):
    return (np.abs(antenna.field(directions)) ** 2).sum(axis=1)


def fibonacci_sphere(n):
    """Nearly even directions, none of them shared with a Gauss rule."""
    k = np.arange(n) + 0.5
    return direction(np.pi * (1.0 + math.sqrt(5.0)) * k, np.arcsin(1.0 - 2.0 * k / n))


@pytest.mark.parametrize("name", EVERY)
def test_gain_averages_to_one_over_all_directions(name):
    antenna = EVERY[name]
    assert isinstance(antenna, Antenna)
    assert gain(antenna, fibonacci_sphere(200_000)).mean() == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("width", [60.0, 90.0, 120.0])
def test_round_cosine_has_the_directivity_of_its_exponent(width):
    exponent = math.log(0.5) / math.log(math.cos(math.radians(width / 2)))
    patch = CosineAntenna(width, width)
    assert gain(patch, AHEAD)[0] == pytest.approx(2.0 * (exponent + 1.0), rel=1e-6)
    assert not gain(patch, direction(np.radians([91.0, 135.0, 180.0]))).any()


@given(st.floats(0.1, 2.0))
def test_two_isotropic_elements_have_their_closed_form_directivity(spacing):
    pair = ArrayAntenna(2, 1, spacing, 0.5, element=IsotropicAntenna())
    assert gain(pair, AHEAD)[0] == pytest.approx(2.0 / (1.0 + np.sinc(2.0 * spacing)), rel=1e-6)


def test_array_is_the_sum_over_its_elements():
    antenna = ArrayAntenna(5, 4, 0.7, 0.45, "taylor(30)", "hamming", CosineAntenna(80.0, 90.0, "H"))
    d = fibonacci_sphere(500)
    y, z = 0.7 * (np.arange(5) - 2.0), 0.45 * (np.arange(4) - 1.5)
    slow = np.zeros(len(d), complex)
    for place_y, weight_y in zip(y, window("taylor(30)", 5), strict=True):
        for place_z, weight_z in zip(z, window("hamming", 4), strict=True):
            slow += weight_y * weight_z * np.exp(2j * np.pi * (place_y * d[:, 1] + place_z * d[:, 2]))
    slow *= antenna.element.field(d)[:, 1]
    field, top = antenna.field(d), antenna.field(AHEAD)[0, 1]
    sums = window("taylor(30)", 5).sum() * window("hamming", 4).sum() * antenna.element.field(AHEAD)[0, 1]
    np.testing.assert_allclose(field[:, 1] / top, slow / sums, atol=1e-12)
    assert not field[:, 0].any()


def test_chebyshev_taper_has_equal_side_lobes_at_its_level():
    found = characteristics(ArrayAntenna(16, 8, 0.5, 0.5, "chebyshev(40)", "chebyshev(25)"))
    assert found.sll_h_db == pytest.approx(-40.0, abs=0.05)
    assert found.sll_v_db == pytest.approx(-25.0, abs=0.05)


def test_figures_of_merit_turn_with_the_pattern_and_know_what_is_not_there():
    found = characteristics(CosineAntenna(86.0, 60.0, loss_db=2.0))
    assert (found.hpbw_h_deg, found.hpbw_v_deg) == pytest.approx((86.0, 60.0), abs=1e-3)
    assert math.isnan(found.sll_h_db)
    everywhere = characteristics(IsotropicAntenna(loss_db=3.0))
    assert everywhere.gain_dbi == pytest.approx(-3.0)
    assert everywhere.hpbw_h_deg == 360.0
    ahead = characteristics(IsotropicAntenna(front=True))
    assert ahead.hpbw_h_deg == pytest.approx(180.0, abs=0.02)
    assert gain_dbi(IsotropicAntenna(front=True), np.pi) == -math.inf


def mounted(name, polarization="V"):
    return antenna_of(f"antennas/{name}.toml", polarization, SCENES, "antenna")


def published(name):
    return tomllib.loads((SCENES / "antennas" / f"{name}.toml").read_text())["published"]


@pytest.mark.parametrize(("name", "within"), [("patch", 1e-3), ("array_2x2", 0.5), ("array_16x16", 0.1)])
def test_c047_c048_c049_beam_widths_of_the_study(name, within):
    found, printed = characteristics(mounted(name)), published(name)
    assert found.hpbw_h_deg == pytest.approx(printed["hpbw_h_deg"], abs=within)
    assert found.hpbw_v_deg == pytest.approx(printed["hpbw_v_deg"], abs=within)


def test_c047_side_lobe_of_16_elements_in_phase():
    assert characteristics(mounted("array_16x16")).sll_v_db == pytest.approx(
        published("array_16x16")["sll_v_db"], abs=0.3
    )


@pytest.mark.parametrize("polarization", ["V", "H"])
@pytest.mark.parametrize("name", ["patch", "array_2x2", "array_16x16"])
def test_an_antenna_file_has_the_gain_it_asks_for_and_the_polarisation(name, polarization):
    field = mounted(name, polarization).field(AHEAD)[0]
    wanted = published(name)["gain_dbi"]
    assert 20.0 * math.log10(abs(field["VH".index(polarization)])) == pytest.approx(wanted, abs=1e-9)
    assert field["HV".index(polarization)] == 0.0


@pytest.mark.parametrize(
    "given",
    [
        {"kind": "isotropic", "front": True},
        {"kind": "cosine", "hpbw_h_deg": 80.0, "hpbw_v_deg": 60.0},
        {"kind": "array", "ny": 3, "nz": 2},
        {"kind": "measured", "file": "pattern.csv"},
    ],
)
def test_gain_dbi_scales_any_antenna_and_keeps_its_shape(given, tmp_path):
    written(tmp_path, "plane,angle_deg,gain_dbi\naz,-90,-3\naz,0,0\naz,90,-5\nel,-90,-2\nel,0,0\nel,90,-2\n")
    plain, scaled = (
        antenna_of(AntennaTable(**given, **more), "V", tmp_path, "antenna") for more in ({}, {"gain_dbi": 7.25})
    )
    d = fibonacci_sphere(300)
    assert gain_dbi(scaled) == pytest.approx(7.25, abs=1e-9)
    np.testing.assert_allclose(gain(scaled, d), gain(plain, d) * 10.0 ** (0.1 * (7.25 - gain_dbi(plain))), rtol=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: IsotropicAntenna("X"),
        lambda: IsotropicAntenna(loss_db=math.nan),
        lambda: CosineAntenna(0.0, 60.0),
        lambda: CosineAntenna(180.0, 60.0),
        lambda: ArrayAntenna(0, 2, 0.5, 0.5),
        lambda: ArrayAntenna(2, 2, -0.5, 0.5),
        lambda: ArrayAntenna(2, 2, 0.5, 0.5, taper_z="kaiser"),
    ],
)
def test_impossible_antennas_are_refused(make):
    with pytest.raises(ValueError):
        make()


def written(tmp_path, text):
    path = tmp_path / "pattern.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_two_cuts_are_met_in_their_planes_and_add_in_db_between(tmp_path):
    rows = ["plane,angle_deg,gain_dbi"]
    rows += [f"az,{a},{10.0 - 0.01 * a * a}" for a in range(-90, 91, 5)]
    rows += [f"el,{a},{10.0 - 0.02 * a * a}" for a in range(-60, 61, 5)]
    antenna = MeasuredAntenna.load(written(tmp_path, "\n".join(rows)))
    assert gain_dbi(antenna, math.radians(30.0)) == pytest.approx(1.0)
    assert gain_dbi(antenna, 0.0, math.radians(-15.0)) == pytest.approx(5.5)
    assert gain_dbi(antenna, math.radians(30.0), math.radians(-15.0)) == pytest.approx(-3.5)
    assert gain_dbi(antenna, math.radians(2.5)) == pytest.approx(10.0 - 0.5 * 0.25), "linear in dB between knots"
    assert gain_dbi(antenna, math.radians(170.0)) == pytest.approx(gain_dbi(antenna, math.radians(90.0)))


def test_a_sampled_pattern_becomes_itself_again(tmp_path):
    original = CosineAntenna(80.0, 60.0, "H")
    azimuth, elevation = np.arange(-60, 61, 2), np.arange(-40, 41, 2)
    rows = ["azimuth_deg,elevation_deg,gain_dbi,phase_deg"]
    for a in azimuth:
        for e in elevation:
            rows.append(f"{a},{e},{gain_dbi(original, math.radians(a), math.radians(e))!r},{7.0 * a + e}")
    antenna = MeasuredAntenna.load(written(tmp_path, "\n".join(rows)), "H")
    rng = np.random.default_rng(1)
    a, e = rng.uniform(-60, 60, 200), rng.uniform(-40, 40, 200)
    d = direction(np.radians(a), np.radians(e))
    turn = np.exp(1j * np.radians(7.0 * a + e))
    np.testing.assert_allclose(antenna.field(d)[:, 1], original.field(d)[:, 1] * turn, rtol=0.01)
    assert not antenna.field(d)[:, 0].any()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("plane,angle_deg,gain_dbi\naz,0,ten\n", r"pattern\.csv, row 2, column gain_dbi: 'ten'"),
        ("plane,angle_deg,gain_dbi\naz,0,1\nuz,0,1\n", r"pattern\.csv, row 3, column plane: 'uz'"),
        ("plane,angle_deg,gain_dbi\naz,0,1\naz,190,1\n", r"pattern\.csv, row 3, column angle_deg: 190"),
        ("plane,angle_deg,gain_dbi\naz,0,1\naz,0,2\n", r"pattern\.csv, row 3, column angle_deg: 0 deg was given"),
        ("plane,angle_deg,gain_dbi\naz,0,1\naz,1,2\n", r"pattern\.csv, column plane: the cut el"),
        ("azimuth_deg,elevation_deg,gain_dbi\n0,0,nan\n", r"pattern\.csv, row 2, column gain_dbi: nan"),
        ("azimuth_deg,elevation_deg,gain_dbi\n0,0,1\n1,0,1\n0,1,1\n", r"pattern\.csv: 3 rows do not fill"),
        ("azimuth_deg,elevation_deg,gain_dbi\n0,0\n", r"pattern\.csv, row 2, column gain_dbi"),
        ("angle,gain\n0,0\n", r"pattern\.csv, row 1: the columns must be"),
        ("", r"pattern\.csv: no rows"),
    ],
)
def test_a_bad_pattern_file_is_named_with_row_and_column(tmp_path, text, says):
    with pytest.raises(PatternError, match=says):
        MeasuredAntenna.load(written(tmp_path, text))
    with pytest.raises(PatternError, match=r"none\.csv: cannot be read"):
        MeasuredAntenna.load(tmp_path / "none.csv")
