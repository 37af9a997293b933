"""Directions of arrival: the Cramer-Rao bound, coherent echoes, grating lobes, and arrays of any form."""

import numpy as np
import pytest
from support.arrays import line, noise, plane, waves

from raychan.processing.covariance import covariance
from raychan.processing.cramer_rao import cramer_rao
from raychan.processing.doa import doa, estimate
from raychan.processing.monopulse import monopulse
from raychan.processing.source_number import source_number
from raychan.radar.aperture import Aperture, cosines
from raychan.study.close_pair import pair_sweep
from raychan.units import db

SPARSE = np.array(
    [[0, 0, 0], [0, 0.5, 0], [0, 1.7, 0.1], [0.1, 3.1, -0.8], [0, 0.2, 1.1], [0, 1.4, 1.9], [0, 2.6, 2.2]]
)


def test_bound_of_one_echo_is_the_closed_form_and_of_two_far_apart_that_of_each():
    aperture = Aperture(line(8), 1.0)
    alone = np.sqrt(6.0 / (100.0 * 8 * 63)) / np.pi
    assert cramer_rao(aperture, cosines(0.4), np.array([[10.0]]), 1.0) == pytest.approx(alone, rel=1e-6)
    # Orthogonal waves bound each other a little, by the overlap of their derivatives; 32 elements less than 8.
    far = cramer_rao(Aperture(line(32), 1.0), np.array([[0.0, 0.0], [0.5, 0.0]]), np.array([[10.0, 10.0]]), 1.0)
    assert far == pytest.approx(np.sqrt(6.0 / (100.0 * 32 * 1023)) / np.pi, rel=0.02)


def rms_over_bound(method, elements, azimuth_deg, snapshots, trials=200, seed=1):
    """Return the rms error of each sine over the bound [dB] at 20 dB SNR, phases at random."""
    rng = np.random.default_rng(seed)
    aperture, look = Aperture(elements, 1.0), cosines(np.radians(azimuth_deg))
    errors, bounds = [], []
    for _ in range(trials):
        amplitude = 10.0 * np.exp(2j * np.pi * rng.random((snapshots, len(look))))
        data = amplitude @ aperture.steering(look) + noise(rng, snapshots, len(elements))
        found = estimate(data, aperture, method, len(look))
        errors.append(np.sort(found[:, 0]) - look[:, 0])
        bounds.append(cramer_rao(aperture, look, amplitude, 1.0)[:, 0])
    return db(np.mean(np.square(errors), axis=0) / np.mean(np.square(bounds), axis=0))


@pytest.mark.parametrize(("method", "snapshots"), [("bartlett", 16), ("music", 16), ("capon", 100)])
def test_rms_error_of_one_echo_is_within_1_db_of_the_bound(method, snapshots):
    assert np.abs(rms_over_bound(method, line(8), [20.0], snapshots)).max() < 1.0


def test_rms_error_of_one_echo_in_one_snapshot_is_within_1_db_of_the_bound():
    assert np.abs(rms_over_bound("bartlett", line(8), [20.0], 1)).max() < 1.0


@pytest.mark.parametrize("method", ["bartlett", "music"])
def test_rms_error_of_two_echoes_is_within_1_db_of_the_bound(method):
    assert np.abs(rms_over_bound(method, line(8), [-20.0, 20.0], 20)).max() < 1.0


def test_rms_error_of_two_coherent_echoes_in_one_snapshot_is_within_1_db_of_the_bound():
    assert np.abs(rms_over_bound("bartlett", line(8), [-20.0, 20.0], 1)).max() < 1.0


def test_esprit_of_two_echoes_stays_above_the_bound_and_within_4_db_of_it():
    over = rms_over_bound("esprit", line(8), [-20.0, 20.0], 20)
    assert (over > 0.0).all() and (over < 4.0).all()


@pytest.mark.parametrize("count", [8, 16])
def test_variance_of_esprit_over_the_bound_grows_with_the_elements_but_not_of_averaged_sub_arrays(count):
    """Rao and Hari 1989: M (M + 1) / (6 (M - 1)); 1000 trials tell it to 0.2 dB."""
    over = rms_over_bound("esprit", line(count), [10.0], 20, 1000)
    assert over == pytest.approx([db(count * (count + 1) / (6.0 * (count - 1)))], abs=0.5)
    assert 0.0 < rms_over_bound("esprit", line(count), [10.0], 1, 1000)[0] < 1.2


def test_monopulse_of_one_echo_has_four_thirds_of_the_bounds_variance_and_of_two_is_neither():
    aperture, rng = Aperture(line(32), 1.0), np.random.default_rng(2)
    steer = np.full(20_000, np.sin(np.radians(-15.0)) + 0.05 * aperture.beamwidth[0])
    data = waves(line(32), -15.0) * 10.0 + noise(rng, len(steer), 32)
    off = monopulse(data, aperture, steer) - np.sin(np.radians(-15.0))
    bound = cramer_rao(aperture, cosines(np.radians(-15.0)), np.array([[10.0]]), 1.0)[0, 0]
    assert db(np.mean(off**2) / bound**2) == pytest.approx(db(4.0 / 3.0), abs=0.1)
    quiet = doa(waves(line(32), -15.0), line(32), 1.0, "monopulse", sources=1)
    assert np.degrees(quiet.azimuth) == pytest.approx(-15.0, abs=1e-6)
    both = doa(waves(line(32), [-2.0, 2.0]), line(32), 1.0, "monopulse", sources=1)
    assert np.degrees(both.azimuth) == pytest.approx(0.0, abs=1e-3)


def test_the_papers_pair_is_resolved_by_beams_over_54_percent_of_phases_and_by_music_over_all():
    sweep = pair_sweep(72)
    assert sweep.resolved_by_beams == pytest.approx(0.54, abs=0.01)
    assert sweep.resolved_by_music >= 0.95


@pytest.mark.parametrize("elements", [SPARSE, plane(4, 4), np.concatenate([plane(4, 3), SPARSE + np.array([0, 5, 0])])])
@pytest.mark.parametrize("method", ["bartlett", "capon", "music"])
def test_azimuth_and_elevation_of_two_waves_at_arrays_of_any_form(method, elements):
    rng = np.random.default_rng(3)
    azimuth, elevation = np.array([-25.0, 14.0]), np.array([-8.0, 20.0])
    amplitude = np.exp(2j * np.pi * rng.random((200, 2))) * [1.0, 0.7]
    data = waves(elements, azimuth, elevation, amplitude) + 0.01 * noise(rng, 200, len(elements))
    found = doa(data, elements, 1.0, method)
    assert len(found.azimuth) == 2
    assert np.degrees(found.azimuth) == pytest.approx(azimuth, abs=0.1)
    assert np.degrees(found.elevation) == pytest.approx(elevation, abs=0.1)
    assert db(found.power) == pytest.approx(db([1.0, 0.49]), abs=0.05)


@pytest.mark.parametrize("method", ["capon", "music", "esprit"])
@pytest.mark.parametrize("kind", [np.complex128, np.complex64, np.int64])
def test_a_direction_of_no_power_is_none(method, kind):
    found = doa(np.ones(4, kind), line(4), 1.0, method, sources=3)
    assert found.azimuth == pytest.approx([0.0], abs=1e-6) and found.power == pytest.approx([1.0])


def test_a_wave_that_is_weak_but_above_rounding_is_told():
    for level in (1e-2, 1e-5):
        data = waves(line(8), 0.0) + level * waves(line(8), 30.0)
        found = doa(data, line(8), 1.0, "esprit", sources=2)
        assert np.degrees(found.azimuth) == pytest.approx([0.0, 30.0], abs=0.1)
        assert found.power == pytest.approx([1.0, level**2], rel=0.05)


def test_values_whose_power_no_float_holds_are_told():
    for value in (1e200, -1e308 - 1e308j):
        with pytest.raises(ValueError, match=r"snapshots: a value of 1e.[23]0[08] sqrt\(W\); at most 1e.150"):
            doa(np.full(4, value), line(4), 1.0)
    assert doa(np.ones((4, 6), complex).T, line(4), 1.0, sources=1).azimuth == pytest.approx([0.0], abs=1e-9)
    assert doa(np.full(4, 1e-200), line(4), 1.0, sources=1).azimuth == pytest.approx([0.0], abs=1e-9)


def test_a_line_along_z_measures_elevation_only():
    found = doa(waves(line(8, axis=2), 0.0, 17.0), line(8, axis=2), 1.0, "esprit", sources=1)
    assert np.isnan(found.azimuth).all() and np.degrees(found.elevation) == pytest.approx(17.0)


def test_a_turned_and_moved_array_sees_the_same_wave_turned_and_the_same():
    data = waves(SPARSE, 22.0, 9.0)
    mirror = SPARSE * [1, -1, 1] + np.array([4.0, -7.0, 3.0])
    here = doa(data, SPARSE, 1.0, "bartlett", sources=1)
    there = doa(waves(mirror, -22.0, 9.0), mirror, 1.0, "bartlett", sources=1)
    assert here.azimuth == pytest.approx(-there.azimuth, abs=1e-6)
    assert here.elevation == pytest.approx(there.elevation, abs=1e-6)


@pytest.mark.parametrize(
    ("spacing", "azimuth", "ambiguous"), [(0.5, 60.0, False), (1.0, 20.0, True), (0.7, 5.0, False)]
)
def test_grating_lobes_say_ambiguous_and_the_direction_nearest_boresight_is_given(spacing, azimuth, ambiguous):
    elements = line(8, spacing)
    true = np.sin(np.radians(azimuth))
    for sine in (true, true - 1.0 / spacing):
        if abs(sine) <= 1.0:
            found = doa(waves(elements, np.degrees(np.arcsin(sine))), elements, 1.0, "bartlett", sources=1)
            assert np.degrees(found.azimuth) == pytest.approx(azimuth, abs=1e-3)
            assert found.ambiguous.tolist() == [ambiguous]


@pytest.mark.parametrize("criterion", ["mdl", "aic"])
def test_the_number_of_sources_of_many_snapshots_is_found(criterion):
    rng, aperture = np.random.default_rng(4), Aperture(line(10), 1.0)
    for count in range(4):
        right = 0
        for _ in range(50):
            amplitude = noise(rng, 200, count) * 3.0
            data = amplitude @ aperture.steering(cosines(np.radians([-40.0, 0.0, 25.0][:count])))
            right += source_number(covariance(data + noise(rng, 200, 10), aperture), criterion) == count
        assert right >= (48 if criterion == "mdl" else 40)


def test_smoothing_restores_the_rank_that_coherent_echoes_lack():
    data = waves(line(8), [-20.0, 20.0])
    aperture = Aperture(SPARSE, 1.0)
    assert np.linalg.matrix_rank(covariance(waves(SPARSE, [-20.0, 20.0]), aperture).matrix, tol=1e-9) == 1
    assert np.linalg.matrix_rank(covariance(data, Aperture(line(8), 1.0)).matrix, tol=1e-9) == 2


@pytest.mark.parametrize("method", ["capon", "music", "esprit"])
@pytest.mark.parametrize("sources", [3, None])
def test_three_coherent_echoes_in_many_snapshots_are_found_as_in_few(method, sources):
    towards = np.array([-35.0, 0.0, 25.0])
    for seed in range(20):
        rng = np.random.default_rng(seed)
        phase = np.exp(2j * np.pi * (rng.random(3) + rng.random((200, 1))))
        data = 20.0 * phase @ Aperture(line(10), 1.0).steering(cosines(np.radians(towards))) + noise(rng, 200, 10)
        found = doa(data, line(10), 1.0, method, sources)
        assert np.degrees(np.sort(found.azimuth)) == pytest.approx(towards, abs=0.2), seed


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"method": "magic"}, "method 'magic'"),
        ({"sources": 8}, "sources = 8"),
        ({"criterion": "bic"}, "criterion 'bic'"),
        ({"elements": np.zeros((8, 3))}, "measures no angle"),
        ({"elements": line(7)}, "snapshots"),
        ({"smoothing": 0.0}, "smoothing"),
        ({"elements": np.concatenate([line(7), [[0, 9.1, 0]]]), "method": "esprit", "sources": 1}, "uniform line"),
        ({"wavelength": 0.0}, "wavelength"),
    ],
)
def test_bad_arguments_are_refused(change, match):
    given = {"snapshots": np.ones((1, 8), complex), "elements": line(8), "wavelength": 1.0} | change
    with pytest.raises(ValueError, match=match):
        doa(**given)
