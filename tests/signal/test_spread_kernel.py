"""What phase noise and quantisation do to a map: theory, the physical model, and the shortcut by one kernel."""

import numpy as np
import pytest
from support.echoes import echoes, make_radar

from raychan.processing.range_doppler import range_doppler
from raychan.radar.impairments import Converter, Impairments, PhaseNoise
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.signal.baseband import synthesize
from raychan.signal.converter import quantized
from raychan.signal.phase_error import faulty
from raychan.signal.spread_kernel import Processor, pedestal, spread, spread_kernel
from raychan.units import C0, db, dbm

WAVE = Waveform(77e9, 1e9, 25.6e-6, 30e-6, 32, 256)
MASK = PhaseNoise([[1e4, -75.0], [1e5, -85.0], [1e6, -90.0], [1e7, -105.0]])
MADE = Processor(WAVE, "hann", "hann", (1, 1))


def noise_map(distance: float, draws: int) -> np.ndarray:
    """Return the mean map of what phase noise adds to one path of power 1, its peak brought to [0, 0]."""
    paths = echoes([distance])
    radar = make_radar(WAVE, impairments=Impairments(phase_noise=MASK))
    clean = synthesize(paths, radar).samples
    total = 0.0
    for seed in range(draws):
        # The noise on a carrier without beat: the ratio to the clean samples.
        noise = faulty(paths, radar, np.random.default_rng(seed)).samples / clean - 1.0
        cube = Cube(samples=noise.astype(np.complex64), noise_power=0.0)
        total = total + range_doppler(cube, WAVE, "hann", "hann", (1, 1)).power / draws
    return np.fft.ifftshift(total, axes=0)


@pytest.mark.parametrize("distance", [4.0, 30.0])
def test_pedestal_of_a_path_is_as_theory_says_within_half_a_db(distance):
    found, wanted = noise_map(distance, 60), pedestal(MADE, MASK, 2.0 * distance / C0)
    # Bands of range cells off the peak; the cell's own neighbours, where the mask is steep within a cell, apart.
    for low, high in ((2, 6), (6, 20), (20, 60), (60, 128)):
        for rates in (slice(0, 1), slice(1, 16), slice(16, 32)):
            assert db(found[rates, low:high].sum() / wanted[rates, low:high].sum()) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(("near", "far"), [(5.0, 12.0), (15.0, 30.0)])
def test_a_strong_near_target_masks_a_weak_far_one_as_theory_says_to_1_db(near, far):
    off = round((far - near) / WAVE.range_resolution)
    floor = pedestal(MADE, MASK, 2.0 * near / C0)[0, off]
    radar = make_radar(WAVE, impairments=Impairments(phase_noise=MASK))
    cell = round(far / WAVE.range_resolution)
    for level_db in (-6.0, 6.0):
        # A target at the cell's middle, level_db over the floor of the strong one's phase noise.
        weak = np.sqrt(floor * 10.0 ** (level_db / 10.0))
        paths = echoes([(cell - off) * WAVE.range_resolution, cell * WAVE.range_resolution], 0.0, [1.0, weak])
        power = 0.0
        for seed in range(120):
            cube = faulty(paths, radar, np.random.default_rng(seed))
            power += range_doppler(cube, WAVE, "hann", "hann", (1, 1)).power[WAVE.n_chirps // 2, cell] / 120.0
        wanted = floor * (1.0 + 10.0 ** (level_db / 10.0))
        assert db(power / wanted) == pytest.approx(0.0, abs=1.0)


def test_shortcut_agrees_at_the_delay_of_its_kernel_and_errs_by_range_correlation_elsewhere():
    kernel = spread_kernel(MADE, MASK, None, 2.0 * 30.0 / C0)
    clean = range_doppler(synthesize(echoes([15.0]), make_radar(WAVE)), WAVE, "hann", "hann", (1, 1)).power
    added = np.fft.fftshift(spread(np.fft.ifftshift(clean, axes=0), kernel), axes=0) - clean
    peak = np.unravel_index(np.argmax(clean), clean.shape)
    floors = {r: np.roll(pedestal(MADE, MASK, 2.0 * r / C0), peak[1], axis=1) for r in (3.0, 30.0)}
    cells = slice(peak[1] + 10, peak[1] + 14)
    shortcut = added[WAVE.n_chirps // 2, cells].mean()
    assert db(shortcut / floors[30.0][0, cells].mean()) == pytest.approx(0.0, abs=0.5)
    # Chirps fold offsets onto a cell, so that the law 4 sin^2(pi f tau) is that of their sum.
    assert db(shortcut / floors[3.0][0, cells].mean()) > 6.0


@pytest.mark.parametrize(("distance", "off_db"), [(1.0, 33.4), (3.0, 23.9), (10.0, 13.5), (30.0, 4.1), (100.0, -4.4)])
def test_kernel_made_for_50_m_is_off_at_other_ranges_by_what_the_theory_page_says(distance, off_db):
    made = Processor(Waveform(77e9, 1e9, 25.6e-6, 30e-6, 128, 512), "hann", "hann", (1, 1))
    true, shortcut = (pedestal(made, MASK, 2.0 * r / C0)[0, 13:17].mean() for r in (distance, 50.0))
    assert db(shortcut / true) == pytest.approx(off_db, abs=0.1)


def test_quantisation_of_the_shortcut_is_that_of_a_full_scale_sine_and_too_low_for_a_weaker_one():
    adc = Converter(10, 0.0)
    kernel = spread_kernel(MADE, None, adc, 0.0)
    for level_db, off_db in ((-0.1, 0.0), (-30.0, -30.0)):
        size = 10.0 ** (level_db / 20.0) * np.sqrt(1e-3)
        clean = synthesize(echoes([15.0321], 3.1234, size), make_radar(WAVE))
        noise = quantized(clean.samples, adc)[0] - clean.samples
        floor = np.mean(np.abs(noise) ** 2)
        assert dbm(floor) == pytest.approx(dbm(adc.noise_power()), abs=0.5)
        map_ = range_doppler(clean, WAVE, "hann", "hann", (1, 1)).power
        added = np.median(spread(map_, kernel) - map_)
        assert db(added / (floor * MADE.noise_share)) == pytest.approx(off_db, abs=1.0)


def test_a_kernel_of_nothing_leaves_the_map():
    rng = np.random.default_rng(0)
    power = rng.random((32, 256))
    assert spread(power, spread_kernel(MADE, None, None, 0.0)) == pytest.approx(power)
