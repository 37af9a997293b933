"""The map: true ranges and rates, received powers, resolutions and ambiguities of the study."""

import numpy as np
import pytest
from support.echoes import SMALL, WIDE, echoes, make_radar
from support.study_tables import figures

from raychan.processing.detection import detect
from raychan.processing.range_doppler import range_doppler
from raychan.radar.waveform import Waveform
from raychan.radar.windows import NAMES
from raychan.signal.baseband import synthesize
from raychan.units import db


def rdmap(paths, wave, window="rect", pad=(2, 2), **changes):
    rng = np.random.default_rng(0)
    return range_doppler(synthesize(paths, make_radar(wave, **changes), rng), wave, window, window, pad)


def peak(m):
    v, r = np.unravel_index(np.argmax(m.power), m.power.shape)
    return m.rate[v], m.range[r], m.power[v, r]


@pytest.mark.parametrize("name", NAMES)
def test_a_lone_path_reads_its_received_power_in_every_window(name):
    wave, cell = SMALL, SMALL.range_resolution
    power = peak(rdmap(echoes([20 * cell], amplitudes=3e-4), wave, name, power=0.5))[2]
    assert abs(db(power / (0.5 * 9e-8))) < 0.01


@pytest.mark.parametrize("v", [-20.0, -3.3, 0.0, 7.77, 20.0])
@pytest.mark.parametrize("bandwidth", [0.57e9, 4e9])
def test_ranges_and_rates_are_those_at_mid_frame_whatever_the_speed(v, bandwidth):
    wave = Waveform(77e9, bandwidth, 25.6e-6, 40e-6, 128, 1024)
    found = detect(rdmap(echoes([20.0], v), wave, "hann"), waveform=wave)
    assert len(found.range) == 1
    assert abs(found.range[0] - (20.0 + v * wave.centre)) < 0.05 * wave.range_resolution
    assert abs(found.rate[0] - v) < 0.05 * wave.rate_resolution


def test_a_target_at_30_mps_and_4_ghz_reads_right_where_30_mps_is_unambiguous():
    wave = Waveform(77e9, 4e9, 25.6e-6, 26e-6, 128, 1024)
    found = detect(rdmap(echoes([20.0], -30.0), wave, "hann"), waveform=wave)
    assert len(found.range) == 1
    assert abs(found.range[0] - (20.0 - 30.0 * wave.centre)) < 0.1 * wave.range_resolution
    assert abs(found.rate[0] + 30.0) < 0.1 * wave.rate_resolution


def gap_in_cells(window: str, along: int) -> float:
    """Least distance [cells], in range (1) or rate (0), at which two equal points both read their power to 0.5 dB.

    Whatever their relative phase: the response of one at the place of the other is at most 10^(0.5/20) - 1.
    """
    wave = WIDE if along else SMALL
    m = rdmap(echoes([30 * wave.range_resolution]), wave, window, (16, 1) if along else (1, 16))
    top = np.unravel_index(np.argmax(m.power), m.power.shape)
    cut = np.abs(m.spectrum[0, top[0]] if along else m.spectrum[0, :, top[1]])
    return float(np.argmax(cut[top[along] :] < 10 ** (0.5 / 20) - 1) / 16)


def test_c001_rectangular_range_resolution_at_4_ghz_is_0_0375_m():
    assert gap_in_cells("rect", 1) * WIDE.range_resolution == pytest.approx(0.0375, rel=0.2)


def test_c002_hann_doubles_it():
    assert 0.8 * 0.075 < gap_in_cells("hann", 1) * WIDE.range_resolution < 1.1 * 0.075


def test_c003_range_resolution_of_the_urban_waveform():
    printed = figures(2)
    urban = Waveform(76.5e9, printed["bandwidth"] * 1e6, 50e-6, 60e-6, 256, 256)
    assert urban.range_resolution == pytest.approx(printed["range resolution"], abs=1e-3)


def test_c004_c005_rate_resolutions():
    assert WIDE.rate_resolution == pytest.approx(0.380, rel=0.02)
    printed = figures(2)
    urban = Waveform(77e9, 0.5e9, 50e-6, printed["chirp"] * 1e-6, 128, 256)
    assert urban.rate_resolution == pytest.approx(printed["speed resolution"], rel=0.01)
    assert gap_in_cells("rect", 0) == pytest.approx(1.0, rel=0.2)


def test_c006_samples_per_chirp():
    assert WIDE.sample_rate * WIDE.chirp_duration == 1024


def test_c007_4_ghz_needs_iq_sampling():
    real = Waveform(77e9, 4e9, 25.6e-6, 40e-6, 128, 1024, complex_sampling=False)
    paths, cell = echoes([23.0]), WIDE.range_resolution
    iq, i = rdmap(paths, WIDE, "hann"), rdmap(paths, real, "hann")
    assert abs(peak(iq)[1] - 23.0) < cell and iq.unambiguous_range == pytest.approx(38.37, abs=cell)
    assert abs(peak(i)[1] - (38.37 - 23.0)) < cell and i.unambiguous_range == pytest.approx(19.19, abs=cell)
    assert i.range[-1] < i.unambiguous_range


def test_c008_rates_fold_beyond_24_33_mps():
    narrow = Waveform(77e9, 100e6, 25.6e-6, 40e-6, 128, 256)
    slow, fast = (peak(rdmap(echoes([50.0], v), narrow, "hann"))[0] for v in (20.0, 26.0))
    assert narrow.unambiguous_rate == pytest.approx(24.33, abs=0.01)
    assert abs(slow - 20.0) < narrow.rate_resolution
    assert abs(fast - (26.0 - 2 * 24.33)) < narrow.rate_resolution


@pytest.mark.parametrize("complex_sampling", [True, False])
@pytest.mark.parametrize("name", ["rect", "hann"])
def test_noise_per_cell_is_what_the_map_says(complex_sampling, name):
    wave = Waveform(77e9, 1e9, 20e-6, 40e-6, 128, 512, complex_sampling)
    m = rdmap(echoes([]), wave, name, noise=True)
    assert abs(db(m.power.mean() / m.noise)) < 0.1


def test_real_sampling_reads_the_same_power_as_iq():
    real = Waveform(77e9, 1e9, 20e-6, 40e-6, 64, 128, complex_sampling=False)
    at = 20 * SMALL.range_resolution
    assert abs(db(peak(rdmap(echoes([at]), real, "hann"))[2])) < 0.01


def test_rate_axis_increases_and_holds_zero():
    m = rdmap(echoes([]), SMALL)
    assert (np.diff(m.rate) > 0).all() and 0.0 in m.rate


@pytest.mark.parametrize("bad", [{"pad": (0, 1)}, {"window": "square"}])
def test_bad_settings_are_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        rdmap(echoes([]), SMALL, **bad)


def test_a_cube_of_another_waveform_is_refused():
    with pytest.raises(ValueError, match="128 by 1024"):
        range_doppler(synthesize(echoes([]), make_radar(SMALL)), WIDE)


@pytest.mark.parametrize("pad", [(1, 1), (2, 2), (4, 4)])
def test_a_frame_of_one_chirp_has_one_rate_and_reads_range_and_power(pad):
    """A target at rest reads as in a frame of many; no padding makes rates of one chirp."""
    wave = Waveform(77e9, 1e9, 20e-6, 40e-6, 1, 256)
    m = rdmap(echoes([9.0], 0.0, 3e-4), wave, "hann", (pad[0], pad[1]), power=0.5)
    assert m.power.shape == (1, 256 * pad[0]) and m.rate.tolist() == [0.0]
    _, far, power = peak(m)
    assert far == pytest.approx(9.0, abs=0.5 * wave.range_resolution / pad[0] + 1e-9)
    found = detect(m, waveform=wave)
    assert found.rate.tolist() == [0.0] and found.range[0] == pytest.approx(9.0, abs=0.1 * wave.range_resolution)
    if pad[0] == 4:
        assert db(power / (0.5 * 9e-8)) == pytest.approx(0.0, abs=0.15)
