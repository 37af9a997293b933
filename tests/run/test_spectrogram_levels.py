"""Spectrograms read received power, have what the receiver does to its samples, and say what they are without."""

import numpy as np
import pytest

import raychan as rc
from raychan.cli import invoke
from raychan.units import C0, db, undb

WAVE = dict(carrier=77e9, bandwidth=300e6, chirp_duration=60e-6, n_chirps=64)
RCS = 10.0


def scene(rate=0.0, complex_sampling=True, interferers=(), **radar) -> rc.Scene:
    """Return a lone point target at 10 m before a radar without noise."""
    wave = rc.Waveform(**WAVE, n_samples=64 if complex_sampling else 128, complex_sampling=complex_sampling)
    ball = rc.Body(
        "ball", shape="sphere", params={"radius": 0.05}, position=(10.0, 0.0, 0.5), velocity=(rate, 0.0, 0.0),
        rcs_dbsm=RCS,
    )  # fmt: skip
    return rc.Scene([ball], radar=rc.Radar(wave, **{"noise": False, **radar}), interferers=interferers)


@pytest.mark.parametrize(
    ("window", "complex_sampling"),
    [
        *((window, True) for window in ("rect", "hamming", "taylor(35)")),
        *((window, False) for window in ("rect", "hann", "blackman", "chebyshev(80)")),
    ],
)
def test_the_peak_reads_the_received_power_with_every_window(window, complex_sampling):
    one = scene(0.0, complex_sampling, processing=rc.Processing(range_window=window, rate_window=window))
    radar = one.radar
    power = radar.power * (C0 / radar.waveform.middle) ** 2 * undb(RCS) / ((4.0 * np.pi) ** 3 * 10.0**4)
    power *= 4.0  # the gain of both isotropic antennas with a front, 3 dB each
    for pad in ((1, 1), (2, 4)):
        padded = rc.Processing(range_window=window, rate_window=window, pad=pad)
        found = rc.spectrogram(scene(0.0, complex_sampling, processing=padded), 0.1)
        assert db(found.power.max(axis=1) / power) == pytest.approx(np.zeros(len(found.time)), abs=0.05)


def test_a_mover_between_two_rates_reads_less_by_what_is_told():
    rates = np.linspace(1.0, 1.05, 3)
    still = rc.spectrogram(scene(), 0.1).power.max()
    lost = [db(rc.spectrogram(scene(v), 0.1).power[0].max() / still) for v in rates]
    # They come from 10.0 m and go up to 0.02 m farther.
    assert min(lost) > -0.45 and max(lost) < 0.05


def test_a_mover_under_real_sampling_without_noise_reads_what_it_does_with_iq_sampling():
    """Carried on from tracing to tracing, samples are complex: the receiver and its converter see real parts."""
    for impairments in (rc.Impairments(), rc.Impairments(converter=rc.Converter(12, -40.0))):
        iq, real = (
            rc.spectrogram(scene(2.0, sampling, impairments=impairments), 0.1, ranges=(8.0, 12.0)).power.max(axis=1)
            for sampling in (True, False)
        )
        assert db(real / iq) == pytest.approx(np.zeros(len(iq)), abs=0.1)


def test_the_receiver_imbalance_offset_and_converter_are_in_the_spectrogram():
    plain = rc.spectrogram(scene(), 0.1)
    unequal = rc.spectrogram(scene(impairments=rc.Impairments(iq_gain_db=3.0)), 0.1)
    # K1 = (1 + g) / 2 for the echo, K2 = (1 - g) / 2 for its image in a far range cell.
    g = np.sqrt(undb(3.0))
    ours = ((1.0 + g) / 2.0) ** 2 + ((1.0 - g) / 2.0) ** 2
    assert db(unequal.power.max() / plain.power.max()) == pytest.approx(db(ours), abs=0.02)
    offset = rc.spectrogram(scene(impairments=rc.Impairments(dc_offset_dbm=-40.0)), 0.1, ranges=(0.0, 2.0))
    # Of the three cells of a Hann window's main lobe, which hold 1/4, 1 and 1/4, the first lies below range 0.
    assert db(offset.power.max()) == pytest.approx(-70.0 + db(1.25 / 1.5), abs=0.05)
    coarse = rc.spectrogram(scene(impairments=rc.Impairments(converter=rc.Converter(3, -100.0))), 0.1)
    assert coarse.power.max() < 0.5 * plain.power.max()
    assert coarse.warnings[0].startswith("the converter clips") and not plain.warnings


def test_what_a_spectrogram_is_without_is_said(tmp_path, capsys):
    other = rc.Interferer(rc.Radar(rc.Waveform(**WAVE, n_samples=64), position=(30, 0, 0.5), yaw_deg=180), name="i")
    noise = rc.Impairments(phase_noise=rc.PhaseNoise([(1e4, -60.0)]))
    given = scene(impairments=noise, interferers=[other])
    said = "the spectrogram is without interferer 'i', phase noise: only `raychan run` has that"
    assert rc.spectrogram(given, 0.1).warnings == (said,)
    (tmp_path / "s.toml").write_text(given.to_toml())
    assert invoke(["spectrogram", str(tmp_path / "s.toml"), "--seconds", "0.1", "--out", str(tmp_path / "o")]) == 0
    assert said in " ".join(capsys.readouterr().err.split())


def test_staggered_ramps_are_refused_in_words():
    wave = rc.Waveform(**WAVE, n_samples=64, stagger=(60e-6, 70e-6))
    with pytest.raises(ValueError, match=r"of ramps at equal distances: radar\.waveform has a stagger"):
        rc.spectrogram(rc.Scene(radar=rc.Radar(wave)), 0.3)


def test_a_converter_too_coarse_is_said_as_a_run_says_it():
    coarse = rc.Impairments(converter=rc.Converter(3, -30.0))
    for found in (rc.spectrogram(scene(impairments=coarse), 0.1), rc.simulate(scene(impairments=coarse))):
        (line,) = [w for w in found.warnings if w.startswith("the converter's step of -42.0 dBm is coarse")]
        assert "rounding takes 3 dB or more off echoes of up to " in line
    fine = rc.Impairments(converter=rc.Converter(16, -40.0))
    assert not [w for w in rc.spectrogram(scene(impairments=fine), 0.1).warnings if "step of" in w]


@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("over, step, part", [
    (20.0, 0.0, ""), (20.0, 6.0, ""), (30.0, 8.0, ""), (20.0, 12.0, "makes marks of up to "),
    (0.0, 8.0, "changes levels by up to "), (-5.0, 18.0, "takes 3 dB or more off echoes of up to "),
])  # fmt: skip
def test_a_spectrogram_tells_steps_that_make_marks_or_change_levels(over, step, part, real):
    wave = rc.Waveform(77e9, 300e6, 20e-6, 100e-6, n_chirps=64, n_samples=64, complex_sampling=not real)
    noise = db(1.380649e-23 * 290.0 * 10.0**1.5 * 64 / 20e-6) + 30.0
    level = over + noise - 30.0 - db(0.0158489 * 4.0 * (C0 / 77.15e9) ** 2 / ((4.0 * np.pi) ** 3 * 1e4))
    target = rc.Body(
        name="t", shape="sphere", params={"radius": 0.01}, position=(10.0, 0.0, 0.5), velocity=(1.0, 0.0, 0.0),
        rcs_dbsm=float(level),
    )  # fmt: skip
    converter = rc.Converter(9, float(noise + step + 20.0 * np.log10(2.0**8)))
    radar = rc.Radar(wave, power=0.0158489, impairments=rc.Impairments(converter=converter))
    said = " ".join(rc.spectrogram(rc.Scene([target], radar=radar), 0.1, ranges=(6.0, 14.0)).warnings)
    assert part in said and bool(part) == bool(said)


@pytest.mark.parametrize("more", [0, 1, 2, 5, 9, 13])
def test_a_duration_of_hardly_more_than_a_stretch_gives_a_stretch(more):
    wave = rc.Waveform(**WAVE, n_samples=64)
    length = round(0.5 * C0 / wave.middle / wave.repetition / 0.1)
    found = rc.spectrogram(scene(), (length + more) * wave.repetition, resolution=0.1)
    assert len(found.time) >= 1
    assert np.isfinite(found.power).all() and found.power.max(axis=1) == pytest.approx(
        rc.spectrogram(scene(), 0.1).power.max(), rel=0.02
    )
    assert (found.time > 0.0).all() and (found.time < (length + more) * wave.repetition).all()


def test_a_receiver_elsewhere_is_refused_for_what_it_is():
    with pytest.raises(ValueError, match=r"receivers beside the transmitter: radar\.rx_position is elsewhere"):
        rc.spectrogram(scene(rx_position=(0.0, 5.0, 0.5)), 0.1)


def test_receivers_of_both_polarisations_are_refused_for_what_they_are(tmp_path, capsys):
    given = scene(rx_polarization="both")
    with pytest.raises(ValueError, match=r'receivers of one polarisation: radar\.rx_polarization = "both" has two'):
        rc.spectrogram(given, 0.1)
    (tmp_path / "s.toml").write_text(given.to_toml(), encoding="utf-8")
    assert invoke(["spectrogram", str(tmp_path / "s.toml"), "--seconds", "0.1", "--out", str(tmp_path / "o")]) == 2
    said = capsys.readouterr().err
    assert "of receivers of one polarisation" in said and "retrace" not in said
    assert not (tmp_path / "o").exists()


def test_the_command_gives_one_stretch_and_refuses_a_receiver_elsewhere_by_its_exit_code(tmp_path, capsys):
    wave = "[radar.waveform]\nbandwidth_mhz = 300.0\nchirp_us = 60.0\nchirps = 64\nsamples = 64\n"
    ball = '[[bodies]]\nname = "ball"\nshape = "sphere"\nposition = [10.0, 0.0, 0.5]\nrcs_dbsm = 10.0\n'
    given = tmp_path / "ball.toml"
    given.write_text(wave + ball, encoding="utf-8")
    run = ["spectrogram", str(given), "--seconds", "0.02"]
    assert invoke([*run, "--out", str(tmp_path / "one")]) == 0
    assert invoke([*run, "--out", str(tmp_path / "two"), "--set", "radar.rx_position=[0.0, 5.0, 0.5]"]) == 2
    assert "receivers beside the transmitter" in capsys.readouterr().err
    assert not (tmp_path / "two").exists()
