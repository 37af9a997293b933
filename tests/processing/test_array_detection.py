"""Detection by an array: coherent gain, false alarms of the strongest beam, several echoes in one cell."""

import numpy as np
import pytest
from scipy.special import diric
from support.arrays import line, plane
from support.echoes import SMALL, echoes, make_radar

from raychan.processing.beams import BeamBank
from raychan.processing.cfar import Grid, factor, training
from raychan.processing.detection import Array, detect
from raychan.processing.detector_map import StrongestBeam
from raychan.processing.range_azimuth import range_azimuth
from raychan.processing.range_doppler import range_doppler
from raychan.radar.aperture import Aperture
from raychan.radar.waveform import Waveform
from raychan.records import Cube
from raychan.signal.baseband import synthesize
from raychan.units import C0, db

LAMBDA = C0 / SMALL.middle


SHORT = Waveform(77e9, 1e9, 20e-6, 40e-6, 16, 32)


def seen(elements, ranges, azimuth_deg, amplitudes, seed=0, noisy=True, wave=SMALL, **settings):
    """Return the map of echoes over elements in wavelengths, and what is detected in it."""
    at = np.asarray(elements) * LAMBDA
    paths = echoes(ranges, 2.0, amplitudes, np.radians(azimuth_deg))
    cube = synthesize(paths, make_radar(wave, elements=at, noise=noisy), np.random.default_rng(seed))
    m = range_doppler(cube, wave)
    return m, detect(m, waveform=wave, elements=at, **settings)


@pytest.mark.parametrize("doa", ["bartlett", "capon", "music", "esprit"])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5])
def test_two_equal_echoes_20_deg_to_both_sides_in_one_cell_are_two_detections_within_1_deg(doa, phase):
    both = np.array([1e-4, 1e-4 * np.exp(1j * phase)])
    _, found = seen(line(8), [6.0, 6.0], [-20.0, 20.0], both, array=Array(doa=doa))
    assert np.degrees(np.sort(found.azimuth)) == pytest.approx([-20.0, 20.0], abs=1.0)
    assert db(found.power) == pytest.approx([-80.0, -80.0], abs=0.3)
    assert (found.cell[0] == found.cell[1]).all()


@pytest.mark.parametrize("apart", [0.1, 0.3, 0.5, 0.8, 1.2, 2.0])
def test_two_echoes_of_other_directions_keep_their_ranges_however_near(apart):
    ranges = np.array([6.0, 6.0 + apart * SMALL.range_resolution])
    _, found = seen(line(8), ranges, [-20.0, 20.0], 1e-4)
    order = np.argsort(found.azimuth)
    assert np.degrees(found.azimuth[order]) == pytest.approx([-20.0, 20.0], abs=1.0)
    there = ranges + 2.0 * SMALL.centre
    assert found.range[order] == pytest.approx(there, abs=0.1 * SMALL.range_resolution)


@pytest.mark.parametrize(("below_db", "count"), [(10.0, 2), (30.0, 2), (50.0, 1)])
def test_a_weaker_echo_in_the_same_cell_is_found_down_to_40_db_below(below_db, count):
    _, found = seen(line(8), [6.0, 6.0], [-20.0, 20.0], [1e-3, 1e-3 * 10 ** (-below_db / 20)])
    assert len(found.range) == count


@pytest.mark.parametrize("elements", [line(8), line(64), plane(8, 4), line(8, 1.0)])
@pytest.mark.parametrize("azimuth", [0.0, 13.0, -28.0])
def test_one_echo_is_one_detection_of_its_power_whatever_the_array(elements, azimuth):
    _, found = seen(elements, [6.0], azimuth, 1e-2)
    assert len(found.range) == 1
    assert db(found.power[0]) == pytest.approx(-40.0, abs=0.1)
    assert np.degrees(found.azimuth[0]) == pytest.approx(azimuth, abs=0.05)


def test_elevation_is_reported_by_an_array_that_measures_it():
    at = plane(6, 4) * LAMBDA
    _, found = seen(plane(6, 4), [6.0], 25.0, 1e-3)
    assert np.degrees(found.elevation) == pytest.approx([0.0], abs=0.05)
    _, found = seen(line(6), [6.0], 25.0, 1e-3)
    assert np.isnan(found.elevation).all()
    assert Aperture(at, LAMBDA).scans == (True, True)


def test_snr_of_64_elements_is_9_db_above_that_of_8():
    snr = {n: np.mean([seen(line(n), [6.0], 10.0, 3e-6, seed)[1].snr[0] for seed in range(8)]) for n in (8, 64)}
    assert snr[64] - snr[8] == pytest.approx(db(8.0), abs=0.5)


def test_64_elements_detect_an_echo_9_db_weaker_than_8_do():
    """The level that half of the draws detect, by the least SNR of 20 dB, as delivered."""
    one = seen(line(1), [6.0], 10.0, 1e-3, wave=SHORT)[1].snr[0]

    def threshold(count):
        # From here on, in dB, an echo has an SNR of 20 dB in the sum of all receivers.
        start = 20.0 - (one + 60.0) - db(count)
        steps = np.linspace(-1.5, 1.5, 5)
        hits = [
            np.mean(
                [
                    len(seen(line(count), [6.0], 10.0, 10 ** ((start + x) / 20), k, wave=SHORT)[1].range)
                    for k in range(16)
                ]
            )
            for x in steps
        ]
        return start + np.interp(0.5, np.maximum.accumulate(hits), steps)

    assert threshold(8) - threshold(64) == pytest.approx(db(8.0), abs=0.5)


@pytest.mark.parametrize(
    ("method", "elements", "pfa"),
    [
        ("ca", line(8), 1e-2),
        ("os", line(8), 1e-3),
        ("ca", plane(4, 4), 1e-3),
        ("os", plane(4, 4), 1e-3),
        ("os", line(5, 0.8), 1e-3),
    ],
)
def test_the_strongest_beam_of_noise_keeps_the_false_alarm_rate_of_a_cell(method, elements, pfa):
    wave = Waveform(77e9, 1e9, 20e-6, 40e-6, 128, 128)
    rng, bank = np.random.default_rng(5), BeamBank(Aperture(elements, 1.0))
    alarms = cells = 0
    while cells * pfa < 400:
        m = range_doppler(Cube(rng.standard_normal((len(elements), 128, 128, 2)).view(complex)[..., 0], 2.0), wave)
        ring = training(Grid.of(m), (2, 2), (3, 3))
        beams = StrongestBeam(m, bank)
        # Of cells below twice the noise none exceeds a threshold of 6 and more.
        high = np.argwhere(beams.power > 2.0 * beams.noise)
        over = beams.power[tuple(high.T)] > factor(bank.single(pfa), ring.worth, method) * beams.level(
            high, ring, method
        )
        alarms, cells = alarms + int(over.sum()), cells + m.power.size
    assert 1.0 / 1.25 < alarms / (pfa * cells) < 1.25


def test_noise_alone_gives_no_detections_and_the_mean_power_sees_all_receivers_alike():
    for mode in ("coherent", "mean"):
        assert len(seen(line(8), [], [], [], array=Array(beams=mode))[1].range) == 0
    _, coherent = seen(line(8), [6.0], 10.0, 1e-4)
    _, mean = seen(line(8), [6.0], 10.0, 1e-4, array=Array(beams="mean"))
    assert coherent.snr[0] - mean.snr[0] == pytest.approx(db(8.0), abs=0.01)
    assert coherent.power[0] == pytest.approx(mean.power[0])


def test_of_one_receiver_all_settings_are_alike():
    m, found = seen(np.zeros((1, 3)), [5.0, 6.0], 0.0, [1e-4, 3e-5])
    bare = detect(m, waveform=SMALL)
    assert len(bare.range) == 2
    for array in (Array(), Array(beams="mean", doa="music")):
        same = detect(m, waveform=SMALL, elements=np.zeros((1, 3)), array=array)
        assert same.power.tobytes() == bare.power.tobytes() == found.power.tobytes()
        assert same.snr.tobytes() == bare.snr.tobytes()


@pytest.mark.parametrize(("count", "spacing"), [(8, 0.5), (16, 0.7)])
def test_a_beam_has_the_closed_form_pattern_of_a_uniform_line(count, spacing):
    aperture = Aperture(line(count, spacing), 1.0)
    look = np.stack([np.linspace(-1.0, 1.0, 301), np.zeros(301)], axis=1)
    beam = np.abs(aperture.steering(np.array([[0.2, 0.0]])).conj() @ aperture.steering(look).T)[0] / count
    assert beam == pytest.approx(np.abs(diric(2.0 * np.pi * spacing * (look[:, 0] - 0.2), count)), abs=1e-9)


def test_beams_lie_half_a_beam_width_apart_and_lose_at_most_09_db_between_them():
    bank = BeamBank(Aperture(line(16), 1.0))
    assert len(bank.directions) == 32
    look = np.stack([np.linspace(-1.0, 1.0, 2001), np.zeros(2001)], axis=1)
    best = (np.abs(bank.rows @ bank.aperture.steering(look).T) ** 2).max(axis=0)
    assert db(best.min()) == pytest.approx(db(np.sinc(0.25) ** 2), abs=0.02)


def test_a_taper_lowers_the_side_lobes_of_the_beams_and_their_gain():
    bank = BeamBank(Aperture(line(32), 1.0), "taylor(30)")
    look = np.stack([np.linspace(0.12, 1.0, 500), np.zeros(500)], axis=1)
    ahead = bank.rows[len(bank.rows) // 2]
    assert db((np.abs(bank.aperture.steering(look) @ ahead) ** 2).max()) == pytest.approx(-30.0, abs=1.5)
    assert db(1.0 / bank.noise_gain) == pytest.approx(db(32.0) - 0.7, abs=0.3)
    with pytest.raises(ValueError, match="beam_window"):
        _ = BeamBank(Aperture(np.array([[0, 0, 0], [0, 1, 0], [0, 2.2, 0]]), 1.0), "hann").weight


def test_range_azimuth_map_peaks_at_the_echoes_with_their_power():
    m, _ = seen(line(16), [4.0, 8.0], [-30.0, 12.0], [1e-3, 2e-3], noisy=False)
    angles = range_azimuth(m, line(16) * LAMBDA, LAMBDA)
    for there, azimuth, power in ((4.0, -30.0, -60.0), (8.0, 12.0, -53.98)):
        near = np.abs(angles.range - there) < 1.0
        b, r = np.unravel_index(angles.power[:, near].argmax(), (len(angles.azimuth), near.sum()))
        assert np.degrees(angles.azimuth[b]) == pytest.approx(azimuth, abs=1.0)
        assert angles.range[near][r] == pytest.approx(there, abs=SMALL.range_resolution)
        assert db(angles.power[:, near].max()) == pytest.approx(power, abs=1.5)
    with pytest.raises(ValueError, match="azimuth"):
        range_azimuth(m, line(16, axis=2) * LAMBDA, LAMBDA)


def test_bad_settings_are_refused():
    for bad in ({"beams": "loud"}, {"doa": "magic"}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            Array(**bad)
    m, _ = seen(line(4), [6.0], 0.0, 1e-4)
    with pytest.raises(ValueError, match="elements: 3 given for a map of 4 receivers"):
        detect(m, waveform=SMALL, elements=line(3))


def test_a_weak_echo_on_the_skirt_of_a_strong_one_of_another_direction_is_found():
    ranges = 6.0 + np.array([0.0, 1.9]) * SMALL.range_resolution
    _, found = seen(line(16), ranges, [22.0, -3.0], [1e-3, 1e-3 * 10 ** (-13.7 / 20)])
    assert np.degrees(found.azimuth) == pytest.approx([22.0, -3.0], abs=0.5)
