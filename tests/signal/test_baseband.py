"""The cube: the fast sum against the direct one, and both against the phase formula in plain numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.echoes import SMALL, WIDE, echoes, make_radar

from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.signal.baseband import synthesize
from raychan.signal.keystone import CHUNK, ROOM, Echoes, keystones
from raychan.signal.keystone import middle as centre
from raychan.units import C0, db


def formula(paths, wave: Waveform) -> np.ndarray:
    """Return samples straight from the convention of radar.waveform."""
    m, s = np.arange(wave.n_chirps)[:, None], np.arange(wave.n_samples)
    t = s * wave.chirp_duration / wave.n_samples
    total = np.zeros((wave.n_chirps, wave.n_samples), complex)
    for a, tau0, v in zip(paths.amplitude, paths.delay, paths.range_rate, strict=True):
        grown = 2.0 * v * (m * wave.repetition + t) / C0
        tau = tau0 + grown
        total += a * np.exp(-2j * np.pi * (wave.carrier * grown + wave.slope * t * tau - 0.5 * wave.slope * tau**2))
    return total


def worst_db(cube, truth) -> float:
    return float(db((np.abs(cube.samples[0] - truth) ** 2).max() / (np.abs(truth) ** 2).max()))


def grids(paths, wave: Waveform, room: int = ROOM):
    delay_rate = paths.length_rate / C0
    middle = paths.delay + delay_rate * centre(wave)[0]
    return keystones(Echoes(middle, delay_rate, paths.amplitude), wave, 1e-6, 0.0, room)


def random_paths(seed: int, n: int, wave: Waveform, fastest: float = 30.0):
    rng = np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(-3, 0, n) * np.exp(2j * np.pi * rng.random(n))
    return echoes(rng.uniform(0.01, 1.0, n) * wave.unambiguous_range, rng.uniform(-fastest, fastest, n), sizes)


@pytest.mark.parametrize("method", ["direct", "nufft"])
def test_samples_are_those_of_the_phase_formula(method):
    paths = random_paths(1, 12, WIDE)
    assert worst_db(synthesize(paths, make_radar(WIDE), method=method), formula(paths, WIDE)) < -100.0


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 60),
    carrier=st.floats(10e9, 140e9),
    bandwidth=st.floats(50e6, 4e9),
    duration=st.floats(5e-6, 60e-6),
    idle=st.floats(0.0, 40e-6),
    chirps=st.integers(1, 33),
    samples=st.integers(1, 130),
)
def test_fast_sum_equals_direct_sum_over_random_paths_and_waveforms(
    seed, n, carrier, bandwidth, duration, idle, chirps, samples
):
    wave = Waveform(carrier, bandwidth, duration, duration + idle, chirps, samples)
    paths = random_paths(seed, n, wave)
    direct = synthesize(paths, make_radar(wave), method="direct")
    fast = synthesize(paths, make_radar(wave), method="nufft", tolerance=1e-7)
    # Peak of the sum, not of one path: paths that cancel must not be an excuse, nor a reason to fail.
    peak = max(np.abs(direct.samples).max(), np.abs(paths.amplitude).max())
    assert db((np.abs(fast.samples - direct.samples).max() / peak) ** 2) < -100.0


def test_movers_at_4_ghz_migrate_over_several_cells_and_stay_exact():
    paths = random_paths(2, 40, WIDE)
    assert 30.0 * WIDE.frame_duration > 4.0 * WIDE.range_resolution
    direct = synthesize(paths, make_radar(WIDE), method="direct")
    assert worst_db(synthesize(paths, make_radar(WIDE), method="nufft"), direct.samples[0]) < -100.0


def test_migration_left_out_would_be_wrong():
    paths = echoes([20.0], 30.0)
    still = formula(paths, WIDE) * 0
    m, t = np.arange(128)[:, None] * WIDE.repetition, np.arange(1024) * WIDE.chirp_duration / 1024
    tau = paths.delay[0]
    turn = WIDE.carrier * 60.0 * (m + t) / C0 + WIDE.slope * t * tau - 0.5 * WIDE.slope * tau**2
    still += np.exp(-2j * np.pi * turn)
    assert worst_db(synthesize(paths, make_radar(WIDE)), still) > -25.0


def summed(parts, wave: Waveform, chunk: int = CHUNK) -> Cube:
    """Return the samples of grids with their echoes, added up."""
    total = np.zeros((wave.n_chirps, wave.n_samples), complex)
    for grid, echoes_ in parts:
        ready = grid.prepared(echoes_, np.empty(grid.factors, complex))
        grid.add(total, ready, (np.zeros(3), np.zeros(3)), chunk)
    return Cube(samples=total[None].astype(np.complex64), noise_power=0.0)


def test_more_paths_than_one_chunk_add_up():
    paths = random_paths(3, 40, SMALL)
    for chunk in (7, 40):
        assert worst_db(summed(grids(paths, SMALL), SMALL, chunk), formula(paths, SMALL)) < -100.0


def test_grids_too_large_for_their_room_are_split_and_add_up():
    paths = random_paths(9, 60, WIDE)
    assert len(grids(paths, WIDE)) == 1
    parts = grids(paths, WIDE, room=1 << 23)
    assert len(parts) > 2
    assert worst_db(summed(parts, WIDE), formula(paths, WIDE)) < -100.0


def test_movers_so_fast_that_the_small_terms_turn_by_more_than_a_radian_stay_exact():
    # 1,500 m/s at 10 GHz and 4 GHz: at last the small terms need several grids, each with terms of high order.
    wave = Waveform(10e9, 4e9, 60e-6, 60e-6, 128, 256)
    paths = random_paths(10, 30, wave, fastest=1500.0)
    parts = grids(paths, wave)
    assert len(parts) > 1 and max(max(grid.orders) for grid, _ in parts) > 3
    assert worst_db(synthesize(paths, make_radar(wave), method="nufft"), formula(paths, wave)) < -100.0


def test_a_frame_of_seconds_needs_few_grids_of_few_terms_and_stays_exact():
    # 20,000 chirps of 40 us, targets of up to 43 m/s: the ramps bend the echoes apart by several radians.
    wave = Waveform(77e9, 3e9, 40e-6, 40e-6, 20_000, 16)
    paths = random_paths(13, 20, wave, fastest=80.0)
    parts = grids(paths, wave)
    assert max(sum(grid.rest_turn) for grid, _ in parts) > 0.3
    assert all(grid.planes < (grid.orders[0] + 1) * (grid.orders[1] + 1) for grid, _ in parts if min(grid.orders) > 1)
    assert worst_db(synthesize(paths, make_radar(wave), method="nufft"), formula(paths, wave)) < -100.0


def test_crowds_of_echoes_in_one_cell_do_not_lose_digits():
    rng = np.random.default_rng(11)
    n = 20_000
    paths = echoes(9.0 + 0.01 * rng.random(n), 0.01 * rng.random(n), rng.normal(size=n) + 1j * rng.normal(size=n))
    direct = synthesize(paths, make_radar(SMALL), method="direct")
    assert worst_db(synthesize(paths, make_radar(SMALL), method="nufft"), direct.samples[0]) < -115.0


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-7])
def test_a_lone_echo_is_within_the_tolerance(tolerance):
    rng = np.random.default_rng(12)
    for r, v in zip(rng.uniform(0.1, 38.0, 20), rng.uniform(-30.0, 30.0, 20), strict=True):
        paths = echoes([r, 20.0], [v, -v], [1.0, 1e-6])
        off = synthesize(paths, make_radar(WIDE), method="nufft", tolerance=tolerance).samples[0] - formula(paths, WIDE)
        assert np.abs(off).max() < tolerance + 2e-7  # samples have single precision


def test_equal_inputs_give_equal_bytes_and_noise_follows_the_seed():
    radar, paths = make_radar(SMALL, noise=True), random_paths(4, 100, SMALL)
    a, b, c = (synthesize(paths, radar, np.random.default_rng(s), method="nufft").samples for s in (5, 5, 6))
    assert a.tobytes() == b.tobytes() != c.tobytes()


def test_no_paths_give_silence():
    cube = synthesize(echoes([]), make_radar(SMALL))
    assert cube.samples.shape == (1, 64, 128) and not cube.samples.any() and cube.noise_power == 0.0


@pytest.mark.parametrize("complex_sampling", [True, False])
def test_noise_alone_has_power_k_t_b_f(complex_sampling):
    wave = Waveform(77e9, 1e9, 20e-6, 40e-6, 128, 1024, complex_sampling)
    cube = synthesize(echoes([]), make_radar(wave, noise=True), np.random.default_rng(7))
    expected = 1.380649e-23 * 290.0 * (1024 / 20e-6) * 10**1.5 * (1.0 if complex_sampling else 0.5)
    assert abs(db((np.abs(cube.samples) ** 2).mean() / expected)) < 0.1


def test_real_samples_are_the_real_part():
    real = Waveform(77e9, 1e9, 20e-6, 40e-6, 64, 128, complex_sampling=False)
    paths = random_paths(8, 5, SMALL)
    i, iq = synthesize(paths, make_radar(real)).samples, synthesize(paths, make_radar(SMALL)).samples
    assert np.array_equal(i.real, iq.real) and not i.imag.any()


def test_power_is_amplitude_squared_times_transmitted_power():
    cube = synthesize(echoes([10.0], amplitudes=1e-5j), make_radar(SMALL, power=0.02))
    assert np.allclose(np.abs(cube.samples) ** 2, 0.02e-10, rtol=1e-5)


def test_a_receiver_set_aside_sees_the_paths_of_a_shifted_receiver():
    azimuth, aside = 0.4, 0.05
    radar = make_radar(SMALL, elements=np.array([[0, 0, 0], [0, aside, 0]]), yaw_deg=np.degrees(0.3))
    # In the antenna's frame the wave comes from azimuth 0.4, from a source a whole length of 20 m away.
    paths = echoes([10.0], 3.0, 1.0, azimuth + 0.3)
    source = 20.0 * np.array([np.cos(azimuth), np.sin(azimuth)])
    shorter = 20.0 - np.linalg.norm(source - [0.0, aside])
    turn = 20.0 / (20.0 - shorter) * np.exp(2j * np.pi * SMALL.carrier * shorter / C0)
    moved = echoes([10.0 - 0.5 * shorter], 3.0, turn, azimuth + 0.3)
    both = synthesize(paths, radar).samples
    assert np.allclose(both[1], synthesize(moved, make_radar(SMALL)).samples[0], atol=1e-4)
    assert np.allclose(both[0], synthesize(paths, make_radar(SMALL)).samples[0], atol=1e-6)


@pytest.mark.parametrize("bad", [{"method": "magic"}, {"tolerance": 0.0}])
def test_bad_arguments_are_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        synthesize(echoes([1.0]), make_radar(SMALL), **bad)
