"""A second radar in the samples: its energy, its ghost, and the echo that it would be if it were the radar itself."""

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.range_doppler import range_doppler
from raychan.radar.interferer import Interferer
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.signal.baseband import synthesize
from raychan.signal.interference import burst
from raychan.units import C0, db

OWN = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 32, 512)


def one_way(distance: float, rate: float = 0.0, amplitude: complex = 1.0):
    """One path from an interferer at a distance [m] that grows by rate [m/s]: half of both stands for an echo."""
    return echoes([0.5 * distance], 0.5 * rate, amplitude)


def test_an_interferer_of_the_same_ramps_looks_like_an_echo_of_the_same_delay():
    paths = one_way(60.0, 8.0, 0.3 + 0.4j)
    victim = make_radar(OWN)
    found = burst(victim, Interferer(make_radar(OWN), locked=True), paths, np.random.default_rng(0))
    wanted = synthesize(paths, victim, method="direct").samples
    # Its ramp begins to arrive one delay after the victim's has begun.
    heard = np.arange(OWN.n_samples) * OWN.chirp_duration / OWN.n_samples > paths.delay[0] * 1.001
    assert np.abs(found - wanted)[..., heard].max() < 1e-5
    assert not found[..., ~heard].any()


@pytest.mark.parametrize("slope", [0.3, 1.7, 3.0])
def test_energy_of_a_crossing_ramp_is_p_fs_squared_over_the_difference_of_slopes(slope):
    own = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 8, 2048)
    # The other ramp crosses in the middle: f_i + S_i T/2 = f_v + S_v T/2.
    start = own.carrier + 0.5 * (1.0 - slope) * own.bandwidth
    other = Waveform(start, slope * own.bandwidth, own.chirp_duration, own.repetition, 8)
    paths = one_way(1.0, 0.0, 0.01)
    found = burst(make_radar(own), Interferer(make_radar(other, power=2.0)), paths, np.random.default_rng(1))
    energy = (np.abs(found[0]) ** 2).sum(axis=1)
    wanted = 2.0 * 0.01**2 * own.sample_rate**2 / abs(other.slope - own.slope)
    assert db(energy / wanted) == pytest.approx(np.zeros(8), abs=0.1)


def test_with_real_sampling_samples_and_bursts_have_half_of_the_received_power():
    own = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 8, 2048, complex_sampling=False)
    echo = synthesize(echoes([10.0], 0.0, 0.5), make_radar(own)).samples
    assert db((np.abs(echo) ** 2).mean() / 0.25) == pytest.approx(db(0.5), abs=0.05)
    assert db(range_doppler(Cube(samples=echo, noise_power=0.0), own).power.max() / 0.25) == pytest.approx(0.0, abs=0.4)
    other = Waveform(own.carrier + 0.25 * own.bandwidth, 0.5 * own.bandwidth, own.chirp_duration, own.repetition, 8)
    found = burst(make_radar(own), Interferer(make_radar(other)), one_way(1.0, 0.0, 0.01), np.random.default_rng(1))
    whole = 0.01**2 * own.sample_rate**2 / abs(other.slope - own.slope)
    assert db((np.abs(found[0]) ** 2).sum(axis=1).mean() / whole) == pytest.approx(db(0.5), abs=0.2)


@pytest.mark.parametrize("late", [0.1e-6, 0.25e-6])
def test_ghost_of_parallel_ramps_stands_at_half_of_c_times_offset_and_delay(late):
    distance = 30.0
    other = Interferer(make_radar(OWN), start=late, locked=True)
    found = burst(make_radar(OWN), other, one_way(distance), np.random.default_rng(2))
    rdmap = range_doppler(Cube(samples=found.astype(np.complex64), noise_power=0.0), OWN, pad=(8, 2))
    v, r = np.unravel_index(np.argmax(rdmap.power), rdmap.power.shape)
    assert rdmap.range[r] == pytest.approx(0.5 * C0 * (late + distance / C0), abs=0.02)
    assert rdmap.rate[v] == pytest.approx(0.0, abs=OWN.rate_resolution)


def test_ramps_of_random_phase_spread_the_ghost_over_all_rates_at_its_range():
    found = burst(make_radar(OWN), Interferer(make_radar(OWN), start=0.2e-6), one_way(30.0), np.random.default_rng(3))
    rdmap = range_doppler(Cube(samples=found.astype(np.complex64), noise_power=0.0), OWN, "hann", "rect", pad=(1, 1))
    line = round((0.5 * C0 * 0.2e-6 + 15.0) / OWN.range_resolution)
    row = rdmap.power[:, line - 1 : line + 2].sum(axis=1)
    # Its power is spread over the chirps: their number times its mean over rates is the power of the ghost.
    assert row.max() < 0.5 * row.sum()
    assert row.sum() / rdmap.power.sum() > 0.95


@pytest.mark.parametrize("off", [0.01, -1.01])
def test_parallel_ramps_beyond_the_band_of_the_range_axis_are_not_heard(off):
    far = Waveform(OWN.carrier + off * OWN.sample_rate, OWN.bandwidth, OWN.chirp_duration, OWN.repetition, 32)
    assert not burst(make_radar(OWN), Interferer(make_radar(far)), one_way(1e-3), np.random.default_rng(4)).any()


def test_receivers_see_the_interferer_from_its_direction():
    elements = np.array([[0.0, 0.0, 0.0], [0.0, 0.5 * OWN.wavelength, 0.0]])
    azimuth = np.radians(20.0)
    paths = echoes([10.0], 0.0, 1.0, azimuth)
    found = burst(
        make_radar(OWN, elements=elements), Interferer(make_radar(OWN), locked=True), paths, np.random.default_rng(5)
    )
    step = np.angle((found[1] * found[0].conj()).sum())
    assert step == pytest.approx(np.pi * np.sin(azimuth) * (1.0 + 0.5 * OWN.bandwidth / OWN.carrier), abs=0.01)


def test_an_interferer_that_never_starts_is_refused():
    with pytest.raises(ValueError, match="finite"):
        Interferer(make_radar(OWN), start=np.inf)
