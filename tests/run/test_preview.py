"""A preview: the direct echoes of a fine run, within a cell and 3 dB, at a small part of its cost; and it says so."""

from __future__ import annotations

import numpy as np
import pytest
from support.boxes_and_balls import WAVEFORM, scene_of
from support.places import SCENES
from support.previews import beside
from support.results import assert_same

import raychan as rc
from raychan import parallel
from raychan.cli import invoke
from raychan.records import NONE, REFLECT
from raychan.run.sequence import frames
from raychan.run.storage import load_result
from raychan.units import undb

ABOVE_DB = 23.0  # SNR: what is weaker by up to 3 dB is still detected


@pytest.fixture(scope="module")
def urban():
    return rc.Scene.load(SCENES / "urban.toml").override(["model.mode=preview"])


def check(fine: rc.Result, coarse: rc.Result, apart: int = 0) -> None:
    """Assert that direct echoes are within a cell and 3 dB of where the fine run has them, all but `apart`, and all
    within what both state."""
    found = beside(fine, coarse)
    sure = (found.snr >= ABOVE_DB) & (found.error <= 3.0)  # the fine run itself knows the echo
    assert sure.any()
    off = np.abs(found.level[sure])
    assert np.count_nonzero((off > 3.0) | (found.cells[sure] > 1.0)) <= apart, found
    assert (off <= found.stated[sure] + found.error[sure]).all(), found


# Two balls of scene 8 share a cell: ways between bodies tell which of them the fine run's peak is nearer to.
@pytest.mark.parametrize(("seed", "apart"), [(1, 0), (3, 0), (8, 1)])
def test_direct_echoes_of_random_scenes_are_within_a_cell_and_3_db_of_a_fine_run(seed, apart):
    check(rc.simulate(scene_of(seed, tolerance_db=1.0)), rc.simulate(scene_of(seed, mode="preview")), apart)


# Beside converged runs the tail of the living street's third car is 4 dB off: echoes over other cars add to it. A hoop
# of the bike rack is as high over two resolution cells, and its highest point 1.01 of them from the fine run's.
@pytest.mark.parametrize(("name", "apart"), [("urban", 0), ("living_street", 2)])
def test_direct_echoes_of_streets_are_within_a_cell_and_3_db_of_a_fine_run(name, apart):
    scene = rc.Scene.load(SCENES / f"{name}.toml")
    fine = rc.simulate(scene, tolerance_db=3.0)
    check(fine, rc.simulate(scene.override(["model.mode=preview"])), apart)


@pytest.mark.parametrize("off", [-0.1, 0.0, 0.12])
def test_a_stronger_echo_of_another_rate_hides_none_in_its_range_cell(off):
    """A ball beside a plate as far away, some 20 dB stronger and as fast the other way."""
    plate = rc.Body(
        "plate", shape="plate", params={"width": 0.5, "height": 0.5},
        position=(12.0, 3.0, 0.6), yaw_deg=180.0 + np.degrees(np.arctan2(3.0, 12.0)), velocity=(6.0, 0.0, 0.0),
    )  # fmt: skip
    place = (float(np.hypot(12.0, 3.0)) + 0.4 + off, -1.0, 0.6)
    ball = rc.Body("ball", shape="sphere", params={"radius": 0.4}, position=place, velocity=(-4.0, 0.0, 0.0))
    radar = {"waveform": WAVEFORM, "position": (0, 0, 0.6), "power_dbm": 20.0}
    scenes = (rc.Scene(bodies=[plate, ball], radar=radar, model={"mode": m}) for m in ("physical", "preview"))
    check(*map(rc.simulate, scenes))


def scene_with(body: rc.Body, **model: object) -> rc.Scene:
    radar = {"waveform": WAVEFORM, "position": (0, 0, 1.0), "power_dbm": 20.0, "noise": False}
    return rc.Scene(bodies=[body], radar=radar, model={"mode": "preview", **model})


def test_a_sphere_returns_by_the_radar_equation():
    """Sigma = pi a^2 (d / (d + a))^2 from a distance d to its surface: the wave is spherical."""
    a, d = 0.4, 8.0
    ball = rc.Body("ball", shape="sphere", params={"radius": a}, position=(d + a, 0.0, 1.0))
    scene = scene_with(ball)
    result = rc.simulate(scene)
    wave, gain = scene.radar.waveform, np.linalg.norm(scene.radar.tx_field(np.array([[1.0, 0.0, 0.0]]))) ** 2
    sigma = np.pi * a**2 * (d / (d + a)) ** 2
    power = undb(20.0) * 1e-3 * gain**2 * wave.wavelength**2 * sigma / ((4.0 * np.pi) ** 3 * d**4)
    assert 10.0 * np.log10(result.detections.power[0] / power) == pytest.approx(0.0, abs=0.5)
    assert result.detections.range[0] == pytest.approx(d, abs=0.1)


def test_a_plate_larger_than_tubes_returns_as_in_a_fine_run():
    plate = rc.Body("plate", shape="plate", params={"width": 2.0, "height": 2.0}, position=(9, 0, 1), yaw_deg=180.0)
    fine = rc.simulate(scene_with(plate, mode="physical", max_bounces=1, tolerance_db=0.5))
    coarse = rc.simulate(scene_with(plate))
    assert 10.0 * np.log10(coarse.detections.power[0] / fine.detections.power[0]) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(("size", "yaw"), [(40.0, 180.0), (400.0, 168.0)])
def test_a_plane_face_of_any_size_mirrors_the_radar_from_its_foot_point(size, yaw):
    """A face many Fresnel zones wide returns as the image of the radar behind it: sigma = pi d^2."""
    plate = rc.Body("plate", shape="plate", params={"width": size, "height": size}, position=(9, 0, 1), yaw_deg=yaw)
    scene = scene_with(plate)
    found, turn = rc.simulate(scene).detections, np.deg2rad(180.0 - yaw)
    d, look = 9.0 * np.cos(turn), np.array([[np.cos(turn), -np.sin(turn), 0.0]])
    gain = np.linalg.norm(scene.radar.tx_field(look)) ** 2
    power = undb(20.0) * 1e-3 * gain**2 * (scene.radar.waveform.wavelength / (8.0 * np.pi * d)) ** 2
    assert found.range[0] == pytest.approx(d, abs=0.1)
    assert 10.0 * np.log10(found.power[0] / power) == pytest.approx(0.0, abs=1.0)


def test_a_target_given_by_its_rcs_returns_over_the_ground_as_in_a_fine_run():
    """Its routes are exact in both, all four: straight or over the ground, out and back."""
    bodies = [
        rc.Body("ground", shape="ground", material="asphalt"),
        rc.Body(
            "point",
            shape="box",
            params={"length": 0.2, "width": 0.2, "height": 0.2},
            position=(9, 0, 0.5),
            rcs_dbsm=5.0,
        ),
    ]
    radar = {"waveform": WAVEFORM, "position": (0, 0, 1.0), "power_dbm": 20.0}
    fine, coarse = (
        rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"mode": m})) for m in ("physical", "preview")
    )
    at = [p.trajectories.kind[p.trajectory].astype(bool).sum(axis=1) for p in (fine.paths, coarse.paths)]
    assert sorted(at[1])[-4:] == [1, 2, 2, 3]
    assert coarse.detections.power[0] == pytest.approx(fine.detections.power[0], rel=1e-3)


def test_fewer_bounces_than_the_ground_needs_leave_it_out(urban):
    """Echoes of bodies over it; right below the radar it returns by one."""
    kinds = [rc.simulate(urban, max_bounces=n).paths.trajectories.kind for n in (1, 2, 3)]
    kinds = [(k[~np.isin(k, (NONE, REFLECT)).all(axis=1)] == REFLECT).sum(axis=1) for k in kinds]
    assert [int(k.max()) for k in kinds] == [0, 1, 2]


def test_a_frame_of_a_sequence_is_the_single_run_of_its_time_to_the_last_bit(urban):
    made = list(frames(urban, 3, 0.05, seed=7))
    assert_same(
        made[0].result, rc.simulate(rc.Scene.load(SCENES / "urban.toml").override(["model.mode=preview"]), seed=7)
    )
    assert_same(made[2].result, rc.simulate(urban.without_caches().at(0.1), seed=9))
    assert made[2].result.warnings == rc.simulate(urban.at(0.1), seed=9).warnings


def test_threads_do_not_change_a_preview():
    made = []
    try:
        for threads in (1, 3):
            parallel.set_threads(threads)
            made.append(rc.simulate(scene_of(2, mode="preview"), seed=4))
    finally:
        parallel.set_threads(None)
    assert_same(*made)
    assert made[0].stats["rays"] == made[1].stats["rays"]


def test_a_fine_run_does_not_depend_on_a_preview_of_the_same_bodies():
    """Both share meshes, and what is derived from bodies; a preview groups the facets of bodies that move otherwise."""
    car = {"name": "car", "shape": "car", "position": [9.0, 1.0, 0.0], "velocity_mps": [3.0, 0.0, 0.0]}
    tables = {
        "radar": {"waveform": WAVEFORM, "position": [0.0, 0.0, 0.5]},
        "model": {"max_bounces": 1, "tolerance_db": 3.0},
        "bodies": [{"name": "ground", "shape": "ground"}, car],
    }
    scene = rc.Scene.from_dict(tables)
    coarse = scene.override(["model.mode=preview"])
    rc.simulate(coarse)
    again = rc.simulate(coarse.override(["model.mode=physical"]))
    assert_same(again, rc.simulate(rc.Scene.from_dict(tables)))


def test_a_preview_says_that_it_is_one_and_states_an_error_for_each_detection(tmp_path, urban, capsys):
    result = rc.simulate(urban)
    assert np.isfinite(result.detections.error_db).all() and (result.detections.error_db >= 2.9).all()
    assert result.detections.converged.all()
    assert sum(w.startswith("preview: levels may be off") for w in result.warnings) == 1
    assert result.ledger["preview"].level_db == "unknown"
    assert result.stats["reached_db"] >= 2.9 and "over_tolerance" not in result.stats
    assert invoke(["run", "urban", "--preview", "--no-pictures", "--out", str(tmp_path / "out")]) == 0
    assert "preview: levels may be off" in "".join(capsys.readouterr())
    again = load_result(tmp_path / "out")
    assert again.require_scene().model.mode == "preview"
    np.testing.assert_array_equal(again.detections.power, result.detections.power)


def test_the_stages_one_by_one_give_the_paths_of_simulate():
    scene = scene_of(5, mode="preview")
    paths = rc.transfer(rc.trace(scene), scene.radar)
    np.testing.assert_array_equal(paths.amplitude, rc.simulate(scene).paths.amplitude)


@pytest.mark.parametrize("key", [{}, {"noise": False}, {"rx_position": [0.0, 3.0, 1.0]}, {"rx_polarization": "both"}])
def test_any_radar_sees_a_car_over_the_ground_as_in_a_fine_run_or_nothing(key):
    radar = {"waveform": WAVEFORM, "position": [0.0, 0.0, 1.0], **key}
    car = rc.Body("car", shape="car", position=(9.0, 1.0, 0.0), velocity=(2.0, 0.0, 0.0))
    ground = rc.Body("ground", shape="ground")
    seen = rc.simulate(rc.Scene(bodies=[ground, car], radar=radar, model={"mode": "preview"}))
    assert len(seen.paths.length) > 500 and "car" in seen.provenance[0].bodies + seen.provenance[-1].bodies
    # At 3 dB an echo 50 dB below the strongest is taken for a direct one of a door; at 1 dB it is none.
    check(rc.simulate(rc.Scene(bodies=[ground, car], radar=radar, model={"max_bounces": 3, "tolerance_db": 1.0})), seen)
    empty = rc.simulate(rc.Scene(bodies=[], radar=radar, model={"mode": "preview"}))
    assert len(empty.paths.length) == ("rx_position" in key)


def test_posts_half_hidden_by_the_beam_before_them_return_as_in_a_fine_run():
    wave = rc.Waveform(carrier=24e9, bandwidth=200e6, chirp_duration=30e-6, n_chirps=8, n_samples=128)
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.CosineAntenna(80.0, 40.0), power=1.0)
    rail = rc.Body("rail", shape="guard_rail", position=(24.73, 5.97, 0.0), yaw_deg=192.4)
    modes = {"max_bounces": 1, "tolerance_db": 1.0}, {"mode": "preview"}
    check(*(rc.simulate(rc.Scene(bodies=[rail], radar=radar, model=model)) for model in modes), apart=1)


def test_the_ledger_of_a_preview_names_thin_layers_that_are_closed_and_clutter_from_beyond_the_unambiguous_range():
    stone = rc.Material(eps_r=4.0, diffuse=rc.Diffuse("gamma", -10.0))
    pane = rc.Body("pane", shape="plate", params={"width": 3.0}, position=(8.0, 0.0, 1.0), material="car_glass")

    def named(body, reach=1.0, **model):
        wave = rc.Waveform(77e9, 150e6, 3e-5, n_chirps=8, n_samples=int(32 * reach))
        made = rc.Scene([body], radar=rc.Radar(wave), model={"mode": "preview", **model})
        return {name: entry.how for name, entry in rc.simulate(made).ledger.items() if name != "preview"}

    def ground(**of):
        return rc.Body("ground", shape="ground", params={"size": 80.0}, **of)

    assert named(pane) == named(ground()) == named(ground(material=stone), diffuse="off") == {}
    assert named(pane, max_transmissions=0) == {
        "transmission": "model.max_transmissions is 0: what stands behind thin layers is not traced"
    }
    beyond = "returns of rough surfaces beyond the unambiguous range of 31.98 m would fold in"
    # Corners of the ground are 57 m away.
    assert named(ground(material=stone)) == {"diffuse scattering": beyond}
    assert named(ground(material=stone), reach=2.0) == {}


@pytest.mark.parametrize("power_dbm", [12.0, 20.0])
def test_a_pole_of_long_facets_keeps_its_level_at_any_power(power_dbm):
    """A lamp post at 14 m over ground, 30 and 38 dB above the noise."""
    ground = rc.Body("ground", shape="ground", material="asphalt")
    post = rc.Body("post", shape="lamp_post", position=(13.94, 0.16, 0.0))
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=64, n_samples=128)
    radar = rc.Radar(wave, (0.0, 0.0, 0.92), power=1e-3 * 10.0 ** (power_dbm / 10.0))
    models = {"max_bounces": 2}, {"mode": "preview"}
    fine, coarse = (rc.simulate(rc.Scene(bodies=[ground, post], radar=radar, model=model)) for model in models)
    i, k = (int(np.argmax(r.detections.snr * (r.detections.range > 10.0))) for r in (fine, coarse))
    assert coarse.provenance[k].bodies == fine.provenance[i].bodies
    off = abs(10.0 * np.log10(coarse.detections.power[k] / fine.detections.power[i]))
    assert off <= coarse.detections.error_db[k] + fine.detections.error_db[i]
