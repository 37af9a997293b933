"""Detection: stated false alarms, every target once, no side lobe, and the angle of arrays."""

import numpy as np
import pytest
from support.echoes import SMALL, WIDE, echoes, make_radar

from raychan.processing.beams import BeamBank
from raychan.processing.cfar import GUARD, TRAIN, Grid, bias, factor, full_count, least_snr_db, level, training
from raychan.processing.detection import Array, detect, least_power
from raychan.processing.detector_map import StrongestBeam
from raychan.processing.range_doppler import range_doppler
from raychan.radar.aperture import Aperture
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.signal.baseband import synthesize
from raychan.units import C0, db


def rdmap(paths, wave=SMALL, seed=0, window="hann", pad=(2, 2), **changes):
    cube = synthesize(paths, make_radar(wave, **changes), np.random.default_rng(seed))
    return range_doppler(cube, wave, window, window, pad)


def product(pfa_factor: float, count: int, rank: int) -> float:
    return float(np.prod([(count - i) / (count - i + pfa_factor) for i in range(rank)]))


def test_c051_cell_averaging_factor_at_pfa_1e_7():
    assert db(factor(1e-7, 1e9)) == pytest.approx(12.07, abs=0.01)
    assert db(factor(1e-7, 32)) == pytest.approx(13.2, abs=0.1)
    assert factor(1e-4, 24) == pytest.approx(24 * (1e-4 ** (-1 / 24) - 1), rel=1e-9)


@pytest.mark.parametrize("count", [8, 32, 72])
@pytest.mark.parametrize("pfa", [1e-2, 1e-4, 1e-7])
def test_ordered_statistic_factor_solves_rohlings_product(count, pfa):
    assert product(factor(pfa, count, "os"), count, count // 2) == pytest.approx(pfa, rel=1e-3)


@pytest.mark.parametrize("looks", [1, 4])
def test_ordered_statistic_reads_the_noise_after_its_bias(looks):
    rng = np.random.default_rng(1)
    values = rng.exponential(size=(100_000, 40, looks)).mean(axis=2)
    ordered = np.partition(values, 19, axis=1)[:, 19]
    assert ordered.mean() == pytest.approx(bias(40, "os", looks), rel=0.005)


@pytest.mark.parametrize("method", ["ca", "os"])
def test_several_looks_keep_the_stated_probability(method):
    rng = np.random.default_rng(2)
    values = rng.exponential(size=(400_000, 21, 3)).mean(axis=2)
    train = np.sort(values[:, 1:], axis=1)
    noise = train.mean(axis=1) if method == "ca" else train[:, 9]
    assert (values[:, 0] > factor(1e-3, 20, method, 3) * noise).mean() == pytest.approx(1e-3, rel=0.2)


@pytest.mark.parametrize("method", ["ca", "os"])
def test_false_alarms_on_noise_are_as_stated_over_1e7_padded_cells(method):
    wave = Waveform(77e9, 4e9, 25.6e-6, 40e-6, 128, 512)
    rng = np.random.default_rng(3)
    alarms = cells = 0
    while cells < 1e7:
        noise = rng.standard_normal((1, 128, 512, 2), np.float32).view(np.complex64)[..., 0]
        m = range_doppler(Cube(noise, 2.0), wave)
        ring = training(Grid.of(m), (2, 2), (3, 3))
        threshold = factor(1e-4, ring.worth, method)
        if method == "ca":
            # The same mean as process.cfar's, by shifting the whole map: away from the ends of the range axis.
            edge = int(np.abs(ring.offsets[:, 1]).max())
            around = sum(np.roll(m.power, tuple(-o), axis=(0, 1)) for o in ring.offsets) / len(ring.offsets)
            inner = slice(edge, m.power.shape[1] - edge)
            alarms += int((m.power > threshold * around)[:, inner].sum())
            cells += m.power[:, inner].size
        else:
            # An alarm needs half of the training cells below power / factor: only high cells come near that.
            high = np.argwhere(m.power > 0.25 * threshold * np.median(m.power))
            alarms += int((m.power[tuple(high.T)] > threshold * level(m.power, high, ring, method)).sum())
            cells += m.power.size
    assert 1.0 / 1.5 < alarms / (1e-4 * cells) < 1.5


def test_false_alarms_near_the_ends_of_the_range_axis_are_as_stated():
    wave = Waveform(77e9, 4e9, 25.6e-6, 40e-6, 256, 64)
    rng = np.random.default_rng(4)
    alarms = cells = 0
    for _ in range(20):
        m = range_doppler(Cube(rng.standard_normal((1, 256, 64, 2)).view(complex)[..., 0], 2.0), wave)
        ring = training(Grid.of(m), (2, 2), (3, 3))
        v, r = np.meshgrid(np.arange(0, 512), [0, 2, 4, 120, 124, 126], indexing="ij")
        ends = np.stack([v.ravel(), r.ravel()], axis=1)
        over = m.power[tuple(ends.T)] > factor(1e-2, ring.worth, "os") * level(m.power, ends, ring, "os")
        alarms, cells = alarms + int(over.sum()), cells + len(ends)
    assert 1.0 / 1.5 < alarms / (1e-2 * cells) < 1.5


def test_mean_and_ordered_statistic_equal_a_plain_loop_inside_the_map():
    power = np.random.default_rng(5).exponential(size=(64, 200))
    ring = training(Grid((2, 2), (32, 100)), (2, 2), (2, 2))
    cell = np.array([[1, 100]])
    values = []
    for dv in range(-6, 7, 2):
        for dr in range(-6, 7, 2):
            if abs(dv) > 2 or abs(dr) > 2:
                values.append(power[(1 + 2 * dv) % 64, 100 + 2 * dr])
    assert level(power, cell, ring, "ca")[0] == pytest.approx(np.mean(values))
    assert level(power, cell, ring, "os")[0] == np.sort(values)[len(values) // 2 - 1]


@pytest.mark.parametrize("cell", [(0, 0), (5, 3), (63, 199), (10, 195)])
def test_training_cells_are_all_different_at_every_edge(cell):
    power = np.arange(64 * 200, dtype=float).reshape(64, 200)
    ring = training(Grid((2, 2), (32, 100)), (2, 2), (3, 3))
    picked = []
    for k in range(len(ring.offsets)):
        one = type(ring)(ring.offsets[k : k + 1], ring.reach, 1.0)
        picked.append(level(power, np.array([cell]), one)[0])
    assert len(set(picked)) == len(ring.offsets)


@pytest.mark.parametrize("method", ["ca", "os"])
@pytest.mark.parametrize("noise", [True, False])
def test_each_of_three_targets_is_reported_once(method, noise):
    ranges, rates = np.array([3.01, 6.4, 12.2]), np.array([-5.0, 0.3, 11.1])
    m = rdmap(echoes(ranges, rates, 1e-4), noise=noise)
    found = detect(m, method=method, ego_speed=7.0, waveform=SMALL)
    order = np.argsort(found.range)
    assert len(order) == 3
    assert np.allclose(found.range[order], ranges + rates * SMALL.centre, atol=0.03 * SMALL.range_resolution)
    assert np.allclose(found.rate[order], rates, atol=0.03 * SMALL.rate_resolution)
    assert np.allclose(found.speed, found.rate + 7.0) and np.isnan(found.azimuth).all()
    assert np.allclose(db(found.power), -80.0, atol=0.1)
    assert (np.diff(found.power) <= 0).all()


def test_snr_is_peak_power_over_thermal_noise_per_cell():
    m = rdmap(echoes([6.0], amplitudes=1e-4), noise=True)
    found = detect(m)
    assert found.snr[0] == pytest.approx(db(found.power[0] / m.noise))


def test_without_known_noise_the_training_cells_show_it():
    m = rdmap(echoes([6.0], amplitudes=2e-6), noise=True)
    for method in ("ca", "os"):
        assert detect(m.replace(noise=0.0), method=method).snr[0] == pytest.approx(detect(m).snr[0], abs=2.0)


@pytest.mark.parametrize("window", ["rect", "hann", "hamming", "blackman", "taylor", "chebyshev"])
@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_side_lobes_of_a_strong_target_are_no_detections(window, offset):
    at = (40 + offset) * SMALL.range_resolution
    m = rdmap(echoes([at], (3 + offset) * SMALL.rate_resolution), window=window, noise=True)
    assert len(detect(m, windows=(window, window)).range) == 1


def test_two_strong_targets_make_no_third():
    m = rdmap(echoes([5.0, 5.9], [0.0, 4.0], [1.0, 0.9j]), noise=True)
    assert len(detect(m).range) == 2


@pytest.mark.parametrize(("below_db", "cells"), [(30, 5), (60, 16)])
def test_a_weak_target_20_db_clear_of_the_side_lobes_of_a_strong_one_is_found(below_db, cells):
    apart = cells * SMALL.rate_resolution
    m = rdmap(echoes([6.0, 6.0], [0.0, apart], [1e-2, 1e-2 * 10 ** (-below_db / 20)]), noise=True)
    found = detect(m)
    assert len(found.rate) == 2
    # Found in its own cell; the strong one's side lobes may push the peak about within it.
    assert np.allclose(found.rate, [0.0, apart], atol=0.5 * SMALL.rate_resolution)


def test_a_body_spread_over_twenty_range_cells_is_not_masked_by_itself():
    ranges = 15.0 + WIDE.range_resolution * np.arange(20)
    rng = np.random.default_rng(6)
    m = rdmap(echoes(ranges, 0.0, 1e-5 * np.exp(2j * np.pi * rng.random(20))), WIDE, noise=True)
    found = detect(m)
    assert 2 <= len(found.range) <= 12
    assert ((found.range > 14.9) & (found.range < 15.9)).all()


def test_a_fast_target_at_4_ghz_is_one_detection():
    wave = Waveform(77e9, 4e9, 25.6e-6, 26e-6, 128, 1024)
    found = detect(rdmap(echoes([20.0], 30.0, 1e-3), wave, noise=True), waveform=wave)
    assert len(found.range) == 1


def test_a_target_at_the_edge_of_the_map_is_found_once():
    for r, v in ((0.02, 0.0), (6.0, SMALL.unambiguous_rate * 0.97), (0.99 * SMALL.unambiguous_range, 0.0)):
        assert len(detect(rdmap(echoes([r], v, 1e-3), noise=True)).range) == 1


@pytest.mark.parametrize("away", [-0.2, -0.01, 0.0, 0.01, 0.2])
def test_a_peak_within_half_a_map_cell_of_range_0_is_there_or_just_before_the_unambiguous_range(away):
    # Two map cells a resolution cell: less than 0.25 of these belongs to the first. No echo comes from before range 0.
    size, last = SMALL.range_resolution, SMALL.n_samples
    found = detect(rdmap(echoes([last * size + away * size], amplitudes=1e-3)), waveform=SMALL)
    shown = last + away if away < -0.05 else max(away, 0.0)
    assert found.range == pytest.approx([shown * size], abs=0.01 * size)


def test_noise_alone_and_silence_give_no_detections():
    assert len(detect(rdmap(echoes([]), noise=True)).range) == 0
    assert len(detect(rdmap(echoes([]))).range) == 0


@pytest.mark.parametrize("shape", [(1, 256), (64, 1), (2, 8), (16, 16)])
def test_maps_of_any_size_are_searched_or_refused(shape):
    wave = Waveform(77e9, 1e9, 20e-6, 40e-6, *shape)
    m = rdmap(echoes([1.0], amplitudes=1e-3), wave, noise=True)
    if min(shape) == 2:
        with pytest.raises(ValueError, match="training"):
            detect(m)
    else:
        assert len(detect(m).range) >= 0


@pytest.mark.parametrize("count", [2, 4, 8])
@pytest.mark.parametrize("degrees", [-50.0, -3.0, 0.0, 20.0, 61.0])
def test_azimuth_of_a_line_of_receivers(count, degrees):
    line = np.zeros((count, 3))
    line[:, 1] = np.arange(count) * 0.5 * 0.0038
    radar = {"elements": line, "yaw_deg": np.degrees(0.2)}
    m = rdmap(echoes([6.0], 2.0, 1e-4, np.radians(degrees) + 0.2), **radar)
    found = detect(m, waveform=SMALL, elements=line)
    assert np.degrees(found.azimuth[0]) == pytest.approx(degrees, abs=0.05)


@pytest.mark.parametrize("elements", [np.zeros((2, 3)), [[0, 0, 0], [0, 2e-5, 2e-5]], [[0, 0, 0], [0.002, 0, 0]]])
def test_receivers_at_one_place_or_all_but_there_or_ahead_of_each_other_give_no_angle(elements):
    m = rdmap(echoes([6.0], 0.0, 1e-4), elements=elements)
    found = detect(m, waveform=SMALL, elements=np.array(elements, float))
    assert len(found.range) == 1 and np.isnan(found.azimuth).all() and np.isnan(found.elevation).all()


@pytest.mark.parametrize("bad", [{"pfa": 0.0}, {"method": "magic"}, {"guard": (-1, 0)}])
def test_bad_arguments_are_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        detect(rdmap(echoes([])), **bad)


@pytest.mark.parametrize("method", ["ca", "os"])
@pytest.mark.parametrize("chirps", [1, 64])
def test_the_least_snr_is_what_a_lone_echo_needs_over_the_mean_threshold_of_noise(method, chirps):
    """The mean of the threshold over 30 maps of noise alone; the training cells of one chirp are few."""
    wave = Waveform(77e9, 1e9, 20e-6, 40e-6, chirps, 1024)
    ring = training(Grid.of(rdmap(echoes([]), wave)), GUARD, TRAIN)
    thresholds = []
    for seed in range(30):
        m = range_doppler(synthesize(echoes([]), make_radar(wave, noise=True), np.random.default_rng(seed)), wave)
        cells = np.argwhere(np.ones_like(m.power, bool))[::41]
        thresholds.append(factor(1e-7, ring.worth, method) * level(m.power, cells, ring, method).mean() / m.noise)
    assert db(np.mean(thresholds)) == pytest.approx(least_snr_db(1e-7, ring.worth, method), abs=0.3)


@pytest.mark.parametrize("count", [(64, 256), (256, 64)])
@pytest.mark.parametrize(("guard", "train"), [((2, 2), (3, 3)), ((3, 5), (2, 1)), ((0, 0), (1, 4))])
def test_a_map_with_room_has_all_training_cells(count, guard, train):
    assert len(training(Grid((1, 1), count), guard, train).offsets) == full_count(guard, train)


def peak_near(m, place):
    """Return the strongest cell (1, 2) near a range [m] and a rate [m/s]."""
    near = np.array([np.abs(m.rate - place[1]).argmin(), np.abs(m.range - place[0]).argmin()]) - 2
    window = m.power[near[0] : near[0] + 5, near[1] : near[1] + 5]
    return (near + np.unravel_index(window.argmax(), window.shape))[None]


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize(
    ("method", "min_snr_db", "pad"),
    [("os", 20.0, (1, 1)), ("ca", 20.0, (2, 2)), ("os", 5.0, (2, 2)), ("ca", 5.0, (1, 1))],
)
def test_a_lone_echo_is_detected_exactly_from_the_least_power_of_its_cell_on(method, min_snr_db, pad, known):
    settings, said = {"method": method, "min_snr_db": min_snr_db, "pfa": 1e-6}, []
    for k, amplitude in enumerate(np.geomspace(3e-8, 5e-7, 60)):
        m = rdmap(echoes([6.03], 2.1, amplitude), seed=k % 3, noise=True, pad=pad)
        m = m if known else m.replace(noise=0.0)
        cell = peak_near(m, (6.03, 2.1))
        enough = m.power[tuple(cell[0])] > least_power(m, cell, **settings)[0]
        said.append((enough, (detect(m, **settings).cell == cell).all(axis=1).any()))
    assert all(a == b for a, b in said) and 10 < sum(a for a, _ in said) < 55


def test_of_arrays_no_echo_below_the_least_power_is_detected():
    at, count = np.arange(8.0)[:, None] * [0.0, 0.5 * C0 / SMALL.middle, 0.0], []
    bank = BeamBank(Aperture(at, C0 / SMALL.middle), "rect")
    for k, amplitude in enumerate(np.geomspace(2e-8, 5e-7, 20)):
        radar = make_radar(SMALL, elements=at, noise=True)
        m = range_doppler(synthesize(echoes([6.03], 2.1, amplitude), radar, np.random.default_rng(k)), SMALL)
        for array, power in ((Array("mean"), m.power), (Array(), StrongestBeam(m, bank).power)):
            settings = {"waveform": SMALL, "elements": at, "array": array}
            found = detect(m, **settings).cell
            assert (power[tuple(found.T)] > least_power(m, found, **settings)).all()
            count.append(len(found))
    assert 5 < np.count_nonzero(count) < 35
