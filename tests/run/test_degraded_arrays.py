"""Impairments, interferers and clutter at the receivers of arrays: each has its own element phase and noise, one
oscillator, one sky; and all of it in one run."""

import dataclasses

import numpy as np
import pytest
from support.degraded_scenes import EVERYTHING

import raychan as rc
from raychan.em.diffuse import Diffuse
from raychan.processing.detection_theory import detection_probability
from raychan.radar.interferer import Interferer
from raychan.records import Cube
from raychan.run.clutter import clutter_of
from raychan.run.interferers import interference, interferer_paths
from raychan.run.target_links import detector_of, target_links
from raychan.signal.fronts import fronts_of
from raychan.signal.phase_error import faulty
from raychan.units import C0, db
from raychan.world.errors import SceneError
from raychan.world.geometry import geometry_of

WAVE = rc.Waveform(77e9, 500e6, 20e-6, 25e-6, n_chirps=32, n_samples=128)
MASK = rc.Impairments(phase_noise=rc.PhaseNoise([[1e4, -70.0], [1e6, -95.0]]))
HALF = 0.5 * WAVE.wavelength


def sign(**given):
    return rc.Body(
        name="sign", shape="sphere", params={"radius": 0.3}, rcs_dbsm=20.0, **{"position": [20, 4, 0.5]} | given
    )


def road(law=None):
    material = rc.Material(eps_r=5.0, sigma=0.5, diffuse=law)
    return rc.Body(name="road", shape="ground", material=material)


def other(place, wave=WAVE, locked=True, **given):
    return Interferer(rc.Radar(wave, place, yaw_deg=180.0, **given), 4e-8, locked, "other")


def test_phase_noise_converter_rain_interferer_clutter_and_a_fluctuating_target_in_one_run_of_a_2_x_8_array():
    scene = rc.Scene.from_text(EVERYTHING)
    # Of clutter little is above that, and seeking its directions takes most of the time.
    one = rc.simulate(scene.override(["processing.min_snr_db=40"]), seed=3)
    assert one.cube.samples.shape == (8, 64, 128) and one.rdmap.spectrum.shape[0] == 16
    assert np.isfinite(one.cube.samples).all() and np.isfinite(one.rdmap.power).all()
    # Of another run the samples are looked at only.
    again = rc.simulate(scene.override(["processing.min_snr_db=100"]), seed=3)
    assert one.cube.samples.tobytes() == again.cube.samples.tobytes()
    found, asked = one.detections, np.hypot(18.0, 6.0)
    post = int(np.argmax(np.where(np.abs(found.range - asked) < 0.5, found.power, 0.0)))
    assert found.range[post] == pytest.approx(asked, abs=0.15)
    assert np.degrees(found.azimuth[post]) == pytest.approx(np.degrees(np.arctan2(6.0, 18.0)), abs=0.5)
    assert one.provenance[post].bodies == "post"
    assert rc.Scene.from_text(scene.to_toml()).to_toml() == scene.to_toml()


def test_one_oscillator_turns_all_receivers_alike_and_each_has_its_own_noise():
    pair = {"elements": [[0, 0, 0], [0, 0, 0]], "impairments": MASK, "noise": False}
    scene = rc.Scene([sign()], radar=rc.Radar(WAVE, (0, 0, 0.5), **pair))
    paths = rc.transfer(rc.trace(scene), scene.radar)
    one, two = rc.synthesize(paths, scene.radar, seed=1).samples
    ideal = rc.synthesize(paths, dataclasses.replace(scene.radar, impairments=rc.Impairments()), seed=1).samples
    assert one.tobytes() == two.tobytes() and not np.allclose(one, ideal[0], rtol=1e-4)
    loud = dataclasses.replace(scene.radar, noise=True)
    one, two = rc.synthesize(paths, loud, seed=1).samples
    assert np.mean(np.abs(one - two) ** 2) / loud.noise_power == pytest.approx(2.0, rel=0.06)


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_phase_noise_of_a_path_between_each_pair_of_elements_is_that_of_one_receiver(multiplexing):
    wave = dataclasses.replace(WAVE, n_chirps=36)
    array = rc.mimo_array(2, 4, HALF) | {"multiplexing": multiplexing}
    many = rc.Radar(wave, (0, 0, 0.5), noise=False, impairments=MASK, **array)
    paths = rc.transfer(rc.trace(rc.Scene([sign()], radar=many)), many)
    plain = rc.Radar(wave, (0, 0, 0.5), noise=False, impairments=MASK)
    turned, lone = (faulty(paths, x, np.random.default_rng(2)).samples for x in (many, plain))
    clean, alone = (
        rc.synthesize(paths, dataclasses.replace(x, impairments=rc.Impairments())).samples for x in (many, plain)
    )
    loud = np.abs(clean) > 0.1 * np.abs(clean).max()
    ratio = np.broadcast_to(lone / alone, clean.shape)
    np.testing.assert_allclose((turned / clean)[loud], ratio[loud], rtol=2e-4)


def test_staggered_ramps_meet_the_phase_noise_of_their_own_instants():
    wave = rc.Waveform(77e9, 500e6, 20e-6, stagger=(25e-6, 31e-6), n_chirps=16, n_samples=128)
    radar = rc.Radar(wave, (0, 0, 0.5), noise=False, impairments=MASK)
    paths = rc.transfer(rc.trace(rc.Scene([sign(), road()], radar=radar)), radar)
    by_group, by_path = (
        faulty(paths, radar, np.random.default_rng(4), method).samples for method in ("groups", "direct")
    )
    assert db(np.mean(np.abs(by_group - by_path) ** 2) / np.mean(np.abs(by_path) ** 2)) < -50.0


def test_an_interferer_near_an_array_arrives_as_a_spherical_wave():
    elements = np.array([[0, -0.15, 0], [0, 0, 0], [0, 0.15, 0.05]])
    place = np.array([1.5, 0.8, 0.5])
    victim = rc.Radar(WAVE, (0, 0, 0.5), elements=elements, noise=False)
    scene = rc.Scene([], radar=victim, interferers=[other(place)])
    (heard,) = interference(scene, geometry_of(scene), 0).values()
    away = np.linalg.norm(place - (victim.position + elements), axis=1)
    # Ramps as the victim's own: the beat of a delay, at the middle of the ramp.
    t = np.arange(128) * WAVE.chirp_duration / 128
    later = (away - away[1]) / C0
    phase = np.exp(-2j * np.pi * (WAVE.carrier * later[:, None] + WAVE.slope * t * later[:, None]))
    inside = np.abs(heard[1, 0]) > 0.0
    assert inside.sum() > 100
    ratio = heard[:, 0] / np.where(inside, heard[1, 0], 1.0)
    spread = (away[1] / away)[:, None]
    np.testing.assert_allclose(ratio[:, inside], (spread * phase)[:, inside], atol=3e-3)


def test_interference_and_clutter_reach_cross_polarised_receivers_as_receivers_of_that_polarisation_alone():
    law = Diffuse("gamma", -10.0, cross_db=10.0)
    made = {}
    for name in ("both", "V", "H"):
        radar = rc.Radar(WAVE, (0, 0, 1.0), rx_polarization=name, noise=False, impairments=MASK, elements=[[0, 0, 0]])
        slanted = other((30, 2, 0.6), roll_deg=30.0)
        made[name] = rc.simulate(rc.Scene([road(law), sign()], radar=radar, interferers=[slanted]), 2, 3.0, 1)
    both, co, crossed = (made[name].cube.samples for name in ("both", "V", "H"))
    assert both.shape[0] == 2
    for row, alone in ((0, co), (1, crossed)):
        power = np.mean(np.abs(alone) ** 2)
        assert power > 0.0
        assert np.mean(np.abs(both[row] - alone[0]) ** 2) < 1e-6 * power


def test_clutter_ends_at_each_element_by_the_length_of_its_own_way():
    elements = np.array([[0, -0.1, 0], [0, 0.02, 0.05]])
    radar = rc.Radar(WAVE, (0, 0, 1.0), elements=elements, noise=False)
    scene = rc.Scene([road(Diffuse("gamma", -10.0))], radar=radar)
    clutter, _ = clutter_of(geometry_of(scene), radar, scene.model, np.random.default_rng(1))
    fronts, spots = fronts_of(clutter), clutter.trajectories.vertices[:, 0].astype(float)
    for element in elements:
        there = np.linalg.norm(spots - radar.position - element, axis=1)
        exact = there - np.linalg.norm(spots - radar.position, axis=1)
        np.testing.assert_allclose(fronts.between(np.zeros(3), element)[0], exact, atol=1e-5)


def test_an_interferer_is_heard_where_the_receivers_stand():
    radar = rc.Radar(WAVE, (0, 0, 0.5), rx_position=(0, 40, 0.5), noise=False)
    scene = rc.Scene([], radar=radar, interferers=[other((30, 20, 0.5))])
    (length,) = interferer_paths(scene, geometry_of(scene), scene.interferers[0]).length
    assert length == pytest.approx(np.hypot(30.0, 20.0))
    with pytest.raises(SceneError, match="own place"):
        rc.Scene([], radar=radar, interferers=[other((0, 40, 0.5))])
    with pytest.raises(ValueError, match="one transmitter"):
        other((30, 20, 0.5), multiplexing="tdm", **rc.mimo_array(2, 2, HALF))


def test_diffuse_returns_to_receivers_elsewhere_are_refused():
    radar = rc.Radar(WAVE, (0, 0, 0.5), rx_position=(0, 40, 0.5))
    with pytest.raises(SceneError, match=r"model\.diffuse"):
        rc.simulate(rc.Scene([road(Diffuse("gamma", -10.0))], radar=radar))


def test_the_link_budget_of_an_array_has_the_gain_of_its_beam():
    one = rc.Radar(WAVE, (0, 0, 0.5))
    many = rc.Radar(
        dataclasses.replace(WAVE, n_chirps=64), (0, 0, 0.5), multiplexing="tdm", **rc.mimo_array(2, 8, HALF)
    )
    mean = rc.Radar(WAVE, (0, 0, 0.5), elements=many.elements, processing=rc.Processing(beams="mean"))
    (alone,), (beam,), (summed,) = (target_links(rc.Scene([sign()], radar=radar)) for radar in (one, many, mean))
    assert beam.snr - alone.snr == pytest.approx(db(16.0), abs=1e-6)
    assert summed.snr == pytest.approx(alone.snr) and detector_of(mean).looks == 8
    assert detector_of(many).looks == 1 and detector_of(many).pfa < detector_of(one).pfa


def test_the_link_budget_of_a_bistatic_target_is_that_of_the_run():
    radar = rc.Radar(WAVE, (0, 0, 0.5), antenna=rc.IsotropicAntenna(), rx_position=(3, 12, 0.5))
    scene = rc.Scene([sign()], radar=radar)
    (link,) = target_links(scene)
    paths = rc.transfer(rc.trace(scene), radar)
    echo = int(np.argmax(paths.range))
    assert link.range == pytest.approx(paths.range[echo])
    away = radar.power * np.abs(paths.amplitude[echo]) ** 2
    found = rc.range_doppler(rc.synthesize(paths, radar), radar)
    assert link.snr == pytest.approx(db(away / found.noise), abs=0.01)


def test_probability_of_detection_of_an_array_is_the_share_of_frames_that_detect():
    """An echo in the middle of a beam and of a cell, 200 frames of noise; the share has a deviation of 0.035 or less.

    Cells and beams beside that of the echo give it further chances, as if it were up to 0.5 dB stronger.
    """
    settings = rc.Processing(pfa=1e-4, min_snr_db=8.0, cfar="os")
    radar = rc.Radar(
        dataclasses.replace(WAVE, n_chirps=16, n_samples=32),
        (0, 0, 0.5),
        elements=rc.uniform_array(8, HALF),
        processing=settings,
    )
    detector, rng = detector_of(radar), np.random.default_rng(6)
    wave, power = radar.waveform, radar.noise_power
    beat = np.exp(-2j * np.pi * 10.0 * np.arange(32) / 32)
    for snr in (11.0, 14.0):
        # SNR in the beam of 8 receivers, after Hann windows along both axes.
        gain = 8.0 * (32 / 1.5) * (16 / 1.5)
        echo = np.sqrt(10 ** (snr / 10) * power / gain) * beat
        hits = 0
        for _ in range(200):
            noise = rng.standard_normal((8, 16, 32, 2)).view(complex)[..., 0] * np.sqrt(0.5 * power)
            cube = Cube(samples=(noise + echo).astype(np.complex64), noise_power=power)
            found = rc.detect(rc.range_doppler(cube, radar), radar)
            near = np.abs(found.range / wave.range_resolution - 10.0) < 1.0
            hits += bool((near & (np.abs(found.rate) < wave.rate_resolution)).any())
        low, high = (float(detection_probability(x, detector)) for x in (snr, snr + 0.5))
        assert low - 0.06 < hits / 200 < high + 0.06
