"""A converter whose steps are coarse says so where it matters: spurs, wrong levels, lost echoes, and only there."""

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.signal.converter import quantized, rounding_error
from raychan.units import C0, db, undb

WAVE = {"carrier": 77e9, "bandwidth": 300e6, "chirp_duration": 20e-6, "repetition": 24e-6, "n_samples": 64}
LAMBDA = C0 / 77.15e9
NOISE = db(1.380649e-23 * 290.0 * 10.0**1.5 * 64 / 20e-6) + 30.0
LINE = "the converter's step of "


def run(echo_db, step_db, mux=None, real=False, receivers=1, noise=True, **faults):
    """Return a run of a lone target, and that of an ideal converter: its echo and the step over the noise of a sample
    [dB]; without a step the converter is ideal."""
    radar = {"noise": noise}
    if mux:
        radar |= rc.mimo_array(2, receivers, LAMBDA / 2) | {"multiplexing": mux}
    elif receivers > 1:
        radar["elements"] = rc.uniform_array(receivers, LAMBDA / 2)
    wave = rc.Waveform(**WAVE, n_chirps={None: 64, "tdm": 128, "ddm": 192}[mux], complex_sampling=not real)
    level = echo_db + NOISE - 30.0 - db(0.0158489 * 4.0 * LAMBDA**2 / ((4.0 * np.pi) ** 3 * 7.3**4))
    body = rc.Body(
        name="t", shape="sphere", params={"radius": 0.01}, position=(7.0, 2.0, 0.5), velocity=(2.7, 0.0, 0.0),
        rcs_dbsm=float(level),
    )  # fmt: skip
    given = []
    for bits in (9, None):
        converter = rc.Converter(bits, float(NOISE + step_db + 20.0 * np.log10(2**bits / 2.0))) if bits else None
        made = rc.Radar(wave, power=0.0158489, impairments=rc.Impairments(converter=converter, **faults), **radar)
        given.append(rc.simulate(rc.Scene([body], radar=made), seed=2))
    return given


def told(found):
    return [w for w in found.warnings if w.startswith(LINE)]


@pytest.mark.parametrize("spread", [0.0, 0.05, 0.25, 0.4, 0.6, 0.8])
def test_the_mean_error_of_rounding_is_that_of_many_draws(spread):
    converter, rng = rc.Converter(8, 0.0), np.random.default_rng(3)
    samples = converter.step * (rng.uniform(-9.0, 9.0, 40) + 1j * rng.uniform(-9.0, 9.0, 40))
    draws = converter.step * spread * (rng.standard_normal((20_000, 40)) + 1j * rng.standard_normal((20_000, 40)))
    seen = (quantized(samples + draws, converter)[0] - draws - samples).mean(axis=0)
    noise = 2.0 * (spread * converter.step) ** 2
    error = rounding_error(samples, rc.Impairments(converter=converter), noise)
    assert np.abs(error - seen).max() < 0.02 * converter.step
    assert not error.any() or spread < 0.7


@pytest.mark.parametrize("mux, real", [(None, False), (None, True), ("tdm", False), ("ddm", False), ("ddm", True)])
@pytest.mark.parametrize("echo_db, step_db", [(20.0, 18.0), (10.0, 14.0)])
def test_spurs_of_a_strong_echo_are_told(echo_db, step_db, mux, real):
    found, ideal = run(echo_db, step_db, mux, real, 1 if mux is None else 2)
    assert len(found.detections.range) > len(ideal.detections.range)
    (line,) = told(found)
    assert "is coarse against noise of -93.9 dBm in a sample: rounding makes " in line
    assert not told(ideal)


@pytest.mark.parametrize("receivers", [1, 8])
@pytest.mark.parametrize("echo_db, step_db", [(0.0, 3.0), (10.0, 6.0), (20.0, 6.0), (20.0, 8.0), (30.0, 8.0)])
def test_steps_that_noise_dithers_are_not_told(echo_db, step_db, receivers):
    found, ideal = run(echo_db, step_db, receivers=receivers)
    assert not told(found)
    assert len(found.detections.range) == len(ideal.detections.range)
    assert db(found.detections.power / ideal.detections.power) == pytest.approx(0.0, abs=0.12)


@pytest.mark.parametrize("step_db", [0.0, 3.0, 6.0, 8.0, 10.0, 12.0, 18.0])
@pytest.mark.parametrize("echo_db", [-5.0, 5.0, 15.0, 25.0, 35.0])
def test_a_line_stands_where_detections_or_levels_are_wrong_and_nowhere_else(echo_db, step_db):
    found, ideal = run(echo_db, step_db, receivers=4)
    powers = found.detections.power
    wrong = len(powers) != len(ideal.detections.power)
    # Noise of the level at its place changes with rounding too.
    noise = 8.7 / np.sqrt(2.0 * undb(ideal.detections.snr[0]))
    wrong = wrong or abs(db(powers[0] / ideal.detections.power[0])) > max(0.1, 1.5 * noise)
    assert bool(told(found)) == wrong


@pytest.mark.parametrize("echo_db, step_db, part", [(0.0, 8.0, "changes the levels of 1 of 1 detection (number 1) by")])
def test_a_weak_echo_that_rounding_weakens_is_told_by_how_much(echo_db, step_db, part):
    found, ideal = run(echo_db, step_db)
    (line,) = told(found)
    assert part in line
    change = db(found.detections.power[0] / ideal.detections.power[0])
    assert abs(change) == pytest.approx(float(line.split("by up to ")[1].split(" dB")[0]), abs=0.3)


@pytest.mark.parametrize("mux", [None, "tdm", "ddm"])
def test_an_echo_that_rounding_takes_away_is_told(mux):
    found, ideal = run(-5.0, 18.0, mux, receivers=2)
    assert len(ideal.detections.range) == 1 and not len(found.detections.range)
    (line,) = told(found)
    assert "takes 3 dB or more off echoes of up to" in line


def test_a_constant_that_lifts_an_echo_over_a_step_is_counted():
    quiet = run(-5.0, 18.0)[0]
    lifted = run(-5.0, 18.0, dc_offset_dbm=float(NOISE + 15.0))[0]
    assert told(quiet) and len(lifted.detections.range) > len(quiet.detections.range)


def test_without_noise_the_line_does_not_speak_of_noise():
    found, _ = run(10.0, 18.0, noise=False)
    (line,) = told(found)
    assert "dBm is coarse, without noise: rounding " in line


def test_the_command_prints_the_line_and_succeeds(tmp_path, capsys):
    found, _ = run(20.0, 18.0)
    (tmp_path / "s.toml").write_text(found.scene.to_toml(), encoding="utf-8")
    assert invoke(["run", str(tmp_path / "s.toml"), "--seed", "2", "--out", str(tmp_path / "o")]) == 0
    printed = capsys.readouterr()
    assert " ".join(told(found)[0].split()) in " ".join((printed.out + printed.err).split())
