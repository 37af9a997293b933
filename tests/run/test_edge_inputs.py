"""Edges of the receiver's inputs: silence, vacuum, NaN, both polarisations saved, slow folds before fast ones."""

import numpy as np
import pytest

import raychan as rc
from raychan.em.atmosphere import gas
from raychan.processing.staggered import least_snr
from raychan.run.storage import save_result

LINE = rc.uniform_array(8, 2e-3)


@pytest.mark.parametrize("method", ["bartlett", "capon", "music", "esprit", "monopulse"])
def test_silence_has_no_direction(method):
    assert len(rc.doa(np.zeros(8), LINE, 4e-3, method=method, sources=1).azimuth) == 0


def test_directions_do_not_depend_on_the_level():
    wave = np.exp(1j * np.pi * np.arange(8) * np.sin(0.3))
    found = [rc.doa(size * wave, LINE, 4e-3, method="music", sources=1) for size in (1.0, 1e150)]
    assert found[0].azimuth == pytest.approx(found[1].azimuth, abs=1e-9)


def test_vacuum_attenuates_nothing():
    assert gas(77.0, 288.0, 0.0, 0.0) == 0.0


@pytest.mark.parametrize("detector", [rc.Detector(), rc.Detector(looks=8), rc.Detector(cfar="os", cells=16)])
def test_a_very_strong_target_is_detected(detector):
    assert rc.detection_probability([160.0, 200.0, np.inf], detector) == pytest.approx(1.0, abs=1e-9)


def test_what_is_no_number_and_no_cfar_is_refused():
    with pytest.raises(ValueError, match="NaN"):
        rc.detection_probability(np.nan)
    with pytest.raises(ValueError, match="cfar"):
        rc.Detector(cfar="foo", cells=16)


def test_a_wrong_parameter_of_a_walker_names_the_body():
    with pytest.raises(rc.SceneError, match=r"bodies\.anna\.params\.speed"):
        rc.Scene(bodies=[rc.Body(name="anna", shape="walker", params={"speed": 100})])


def target(**radar):
    wave = radar.pop("waveform", rc.Waveform(77e9, 5e8, 2e-5, n_chirps=48, n_samples=64))
    body = rc.Body(name="t", shape="box", rcs_dbsm=10.0, position=(12.0, 0.0, 0.0), velocity=(12.0, 0.0, 0.0))
    return rc.Scene(bodies=[body], radar=rc.Radar(wave, **radar))


def test_a_run_of_both_polarisations_is_saved_and_read(tmp_path):
    result = rc.simulate(target(rx_polarization="both"))
    save_result(result, tmp_path)
    read = rc.load_result(tmp_path / "result.nc")
    np.testing.assert_array_equal(read.paths.cross, result.paths.cross)


def test_staggered_ramps_that_cannot_tell_folds_prefer_slow_rates_and_say_so():
    wave = rc.Waveform(77e9, 5e8, 2e-5, n_chirps=48, n_samples=64, stagger=(25e-6, 31e-6))
    scene = target(waveform=wave)
    assert least_snr(scene.radar) > 10.0**3
    for seed in range(6):
        result = rc.simulate(scene, seed=seed)
        assert any("staggered ramps tell folded rates apart" in w for w in result.warnings)
        assert np.abs(result.detections.rate[:1] - 12.0).max(initial=0.0) < 0.5


@pytest.mark.parametrize("given", ["urban", None])
@pytest.mark.parametrize(
    "run",
    [
        rc.simulate,
        lambda scene: rc.frames(scene, 2),
        lambda scene: rc.spectrogram(scene, 0.1),
        lambda scene: rc.specular_paths(scene, (0, 0, 1), (2, 0, 1)),
    ],
)
def test_the_name_of_a_scene_is_no_scene(run, given):
    said = r"scene: .* is not possible; allowed: a Scene, as Scene.load\(" + ("'urban'" if given else "")
    with pytest.raises(rc.SceneError, match=said):
        run(given)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"tx": "a"}, r"tx: numbers of shape \(3,\) wanted, 'a' given"),
        ({"rx_velocity": (1, 2)}, r"rx_velocity: numbers of shape \(3,\) wanted"),
        ({"rx": ("1", "2", "3")}, r"rx: numbers of shape \(3,\) wanted"),
        ({"rx": (1e30, 0, 0)}, r"rx = 1e\+30: must lie between -1e\+06 and 1e\+06 m"),
        ({"rx_velocity": (1e30, 0, 0)}, r"rx_velocity = 1e\+30: must lie between -100000 and 100000 m/s"),
        ({"max_bounces": "a"}, "max_bounces = 'a': a whole number is wanted"),
        ({"max_bounces": -1}, "max_bounces = -1: must lie between 0 and 12"),
    ],
)
def test_specular_paths_name_the_argument_that_cannot_be(given, said):
    with pytest.raises(ValueError, match=said):
        rc.specular_paths(target(), **({"tx": (0, 0, 1), "rx": (2, 0, 1)} | given))


def test_no_specular_path_leads_below_the_ground():
    scene = rc.Scene(bodies=[rc.Body("road", shape="ground"), rc.Body("ball", shape="sphere", position=(5, 0, 1))])
    assert len(rc.specular_paths(scene, (0, 0, 0.5), (10, 0, -1), max_bounces=2).length) == 0


def test_specular_paths_of_one_point_are_those_that_return_to_it():
    box = rc.Body("b", shape="box", position=(10.0, 0.0, 0.0), params={"length": 1.0, "width": 4.0, "height": 4.0})
    scene = rc.Scene(bodies=[box, rc.Body("road", shape="ground")])
    found = rc.specular_paths(scene, (0, 0, 1), (0, 0, 1), max_bounces=1, tx_velocity=(1, 0, 0), rx_velocity=(1, 0, 0))
    assert found.length == pytest.approx([2.0, 19.0]) and found.length_rate == pytest.approx([0.0, -2.0])
    assert len(rc.specular_paths(scene, (0, 0, 1), (0, 0, 1), max_bounces=0).length) == 0
