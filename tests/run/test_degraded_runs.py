"""Air, interferers and receiver impairments in whole runs, and their tables both ways."""

import numpy as np
import pytest
from support.degraded_scenes import AIR, BAD, OTHER, SCENE

import raychan as rc
from raychan.cli.info_impairments import impairment_rows
from raychan.em.atmosphere import Atmosphere
from raychan.radar.impairments import ChirpError, Converter, Impairments, PhaseNoise
from raychan.radar.interferer import Interferer
from raychan.radar.radar import Radar
from raychan.radar.waveform import Waveform
from raychan.run.interferers import interference, interferer_paths
from raychan.run.streams import Stage, stream
from raychan.units import db
from raychan.world.errors import SceneError
from raychan.world.geometry import Geometry, geometry_of

REAL = SCENE.replace("samples = 256", "samples = 256\niq = false")
HIGH = SCENE.replace("[radar.waveform]", "[radar.waveform]\ncarrier_ghz = 300.0")


def test_streams_of_stages_are_those_that_a_seed_spawns():
    for stage, child in zip(Stage, np.random.SeedSequence(7).spawn(len(Stage)), strict=True):
        assert stream(7, stage).random() == np.random.default_rng(child).random()


def test_streams_of_names_are_their_own_and_an_interferer_more_leaves_the_others_as_they_are():
    draws = [stream(7, Stage.INTERFERENCE, name).random() for name in (None, "a", "b", "ab", "ba", "ä")]
    assert len(set(draws)) == len(draws)
    more = OTHER.replace("truck", "van").replace("40.0, -2.0", "35.0, 3.0")
    van, truck, both = (
        interference(scene, geometry_of(scene), 3)
        for scene in (rc.Scene.from_text(SCENE + text) for text in (more, OTHER, more + OTHER))
    )
    assert set(both) == {"van", "truck"}
    for alone in (van, truck):
        ((name, samples),) = alone.items()
        np.testing.assert_array_equal(both[name], samples)


def test_a_rainy_scene_returns_less_by_the_rain_over_both_ways():
    dry, wet = rc.Scene.from_text(SCENE), rc.Scene.from_text(SCENE + AIR)
    clear, rainy = (rc.transfer(rc.trace(x), x.radar) for x in (dry, wet))
    loss = sum(Atmosphere(rain_mmh=50.0).specific(wet.radar.waveform.middle).values())
    assert len(clear.length) == len(rainy.length) > 1
    fall = db(np.abs(rainy.amplitude) ** 2 / np.abs(clear.amplitude) ** 2)
    assert fall == pytest.approx(-loss * clear.length / 1e3, abs=1e-9)
    assert loss > 15.0
    loss = sum(Atmosphere(rain_mmh=50.0).specific(wet.frequency).values())
    one, two = (rc.specular_paths(x, (0, 0, 1), (500, 0, 1), max_bounces=1) for x in (dry, wet))
    assert np.abs(two.gain[0, 0, 0] / one.gain[0, 0, 0]) == pytest.approx(10.0 ** (-loss * one.length[0] / 2e4))


def test_rain_differs_between_scenes_that_share_their_bodies():
    wet = rc.Scene.from_text(SCENE + AIR)
    drier = wet.override(["atmosphere.rain_mmh=1.0"])
    both = [rc.transfer(rc.trace(x), x.radar) for x in (drier, wet)]
    strong, weak = (np.abs(x.amplitude[x.length > 50.0]).max() for x in both)
    assert strong > 1.05 * weak


def test_tables_of_impairments_air_and_interferers_survive_the_way_to_text_and_back():
    scene = rc.Scene.from_text(SCENE + BAD + AIR + OTHER)
    back = rc.Scene.from_text(scene.to_toml())
    assert back.radar.impairments == scene.radar.impairments
    assert back.radar.noise_temperature_k == 40.0
    assert back.atmosphere == scene.atmosphere == Atmosphere(rain_mmh=50.0)
    (one,), (two,) = scene.interferers, back.interferers
    assert (one.name, one.start, one.locked) == (two.name, two.start, two.locked) == ("truck", 1e-6 * 0.05, False)
    assert one.radar.waveform == two.radar.waveform


def test_objects_of_impairments_air_and_interferers_become_tables():
    wave = Waveform(77e9, 5e8, 20e-6, 25e-6, 32, 256)
    bad = Impairments(
        ChirpError([[0.0, 1e3], [2e-5, -3e3]]), PhaseNoise([[1e4, -80.0]]), Converter(12, -30.0), 0.1, -0.5, -80.0
    )
    scene = rc.Scene(
        radar=Radar(wave, impairments=bad, noise_temperature_k=100.0),
        atmosphere=Atmosphere(fog_gm3=0.05),
        interferers=[Interferer(Radar(wave, (20.0, 1.0, 0.5), yaw_deg=180.0), 1e-7, True, "car")],
    )
    back = rc.Scene.from_text(scene.to_toml())
    assert back.radar.impairments == bad
    assert back.radar.noise_temperature_k == 100.0
    assert back.atmosphere == Atmosphere(fog_gm3=0.05)
    assert (back.interferers[0].name, back.interferers[0].start, back.interferers[0].locked) == ("car", 1e-7, True)


def test_info_tells_of_receiver_air_and_interferers_and_is_silent_on_an_ideal_radar():
    assert impairment_rows(rc.Scene.from_text(SCENE)) == []
    said = dict(impairment_rows(rc.Scene.from_text(SCENE + BAD + AIR + OTHER)))
    assert said["converter"] == "10 bits, full scale -50 dBm, SNR 62.0 dB"
    assert said["image rejection"] == "36.8 dB"
    assert said["air, one way"].startswith("gas 0.347, rain 18, ")
    assert said["interferer truck"] == "at 40.05 m; a crossing lasts 20 us of a ramp"


def test_a_run_with_everything_wrong_still_sees_its_target_says_what_it_clips_and_repeats():
    scene = rc.Scene.from_text(SCENE + BAD.replace("-50.0", "-70.0") + AIR + OTHER)
    one, two = (rc.simulate(scene, seed=3) for _ in range(2))
    assert one.cube.samples.tobytes() == two.cube.samples.tobytes()
    assert any("clips" in line for line in one.warnings)
    assert np.abs(one.detections.range - 30.07).min() < 0.5


def test_synthesize_gives_the_samples_of_a_run_with_impairments():
    scene = rc.Scene.from_text(SCENE + BAD)
    result = rc.simulate(scene, seed=5)
    cube = rc.synthesize(result.paths, scene.radar, seed=5)
    assert cube.samples.tobytes() == result.cube.samples.tobytes()


def test_an_interferer_is_heard_straight_and_over_the_road_by_friis():
    scene = rc.Scene.from_text(SCENE + OTHER)
    paths = interferer_paths(scene, Geometry(scene.facets()), scene.interferers[0])
    assert len(paths.length) == 2
    direct = int(np.argmin(paths.length))
    away = np.linalg.norm(scene.interferers[0].radar.position - scene.radar.position)
    assert paths.length[direct] == pytest.approx(away)
    # Both antennas radiate into half a sphere: gain 3 dBi each.
    friis = 2.0 * 299792458.0 / scene.interferers[0].radar.waveform.middle / (4.0 * np.pi * away)
    assert np.abs(paths.amplitude[direct]) == pytest.approx(friis, rel=1e-3)


def test_parallel_ramps_of_a_second_radar_stand_in_the_map_where_offset_and_delay_put_them():
    locked = rc.Scene.from_text(SCENE + OTHER.replace("start_us = 0.05", "start_us = 0.05\nlocked = true"))
    result = rc.simulate(locked, seed=1)
    ghost = 0.5 * 299792458.0 * 5e-8 + 0.5 * np.linalg.norm([40.0, -2.0, 0.1])
    assert np.abs(result.detections.range - ghost).min() < 0.15
    clean = rc.simulate(rc.Scene.from_text(SCENE), seed=1)
    assert np.abs(clean.detections.range - ghost).min() > 1.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SCENE + "[radar.impairments]\nphase_noise_hz_dbc = [[1e4, -90.0], [1e5, -80.0]]\n", "rises"),
        (SCENE + "[radar.impairments]\nadc_bits = 8\n", "together"),
        (SCENE + "[radar.impairments]\nadc_bits = 40\nadc_full_scale_dbm = 0.0\n", "between 1 and 24"),
        (REAL + "[radar.impairments]\niq_gain_db = 1.0\n", "real sampling"),
        (SCENE + "[atmosphere]\nrain_mmh = 5000.0\n", "mm/h"),
        (SCENE + "[atmosphere]\nrain = 5.0\n", "did you mean 'rain_mmh'"),
        (SCENE + OTHER.replace("[40.0, -2.0, 0.6]", "[30.0, 2.0, 0.5]"), "interferer 'truck' is inside 'target'"),
        (SCENE + OTHER.replace("[40.0, -2.0, 0.6]", "[0.0, 0.0, 0.5]"), "own place"),
        (SCENE + OTHER + OTHER, "one name"),
        (HIGH + "[atmosphere]\nfog_gm3 = 0.1\n", "200 GHz"),
    ],
)  # fmt: skip
def test_tables_that_cannot_be_are_refused_with_the_reason(text, said):
    with pytest.raises(SceneError, match=said.replace("(", r"\(")):
        rc.Scene.from_text(text)
