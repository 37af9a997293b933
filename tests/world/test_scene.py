"""Scenes: from files and from Python, changed by key, and clear errors for bad input."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.places import SCENES
from support.scene_texts import BALL, BARE_RADAR
from support.study_tables import table

import raychan as rc
from raychan.records import BLOCKER, LAYER, MIRROR, PEC, SCATTERER
from raychan.world.checks import folded_range, nearest_point
from raychan.world.scene import Body, Scene

URBAN = SCENES / "urban.toml"
PATCH = URBAN.parent / "antennas" / "patch.toml"


def test_python_scene_as_in_the_design():
    wall = rc.Body(
        name="wall",
        mesh=trimesh.creation.box(),
        material=rc.Material(eps_r=5.24, sigma=1.38, thickness=None),
        position=(3.0, 0.0, 0.0),
        yaw_deg=90.0,
        velocity=(0.0, 1.0, 0.0),
    )
    scene = rc.Scene(bodies=[wall, rc.Body(name="sheet", shape="plate", material=rc.PEC)], frequency=77e9)
    f = scene.facets()
    assert f.body_names == ("wall", "sheet") and len(f.vertices) == 14
    assert f.materials.kind[f.material[-1]] == PEC
    np.testing.assert_allclose(f.origin[0], [3.0, 0.0, 0.0])
    np.testing.assert_allclose(f.vertices[:12].reshape(-1, 3).mean(axis=0), [3.0, 0.0, 0.0], atol=1e-12)
    assert len(scene.points().position) == 0


def test_facets_move_and_turn_with_time():
    body = Body(name="b", shape="box", position=(1, 2, 0), velocity=(10, 0, 0), turn_rate_dps=90.0)
    f = Scene([body]).facets(0.5)
    turned = Scene([Body(name="b", shape="box", position=(6, 2, 0), yaw_deg=45.0)]).facets(0.0)
    np.testing.assert_allclose(f.vertices, turned.vertices, atol=1e-12)
    np.testing.assert_allclose(f.normals, turned.normals, atol=1e-12)
    np.testing.assert_allclose(f.spin[0], [0, 0, np.pi / 2])


def test_empty_scene_is_valid():
    scene = Scene.from_text(BARE_RADAR)
    f, p = scene.facets(), scene.points()
    assert f.vertices.shape == (0, 3, 3) and f.role.shape == (0,) and p.sigma.shape[0] == 0
    assert [w.split(":")[0] for w in scene.warnings] == ["no body is in view"]


def test_roles():
    bodies = [
        Body(name="road", shape="ground"),
        Body(name="man", shape="pedestrian", rcs_dbsm=0.85),
        Body(name="car", shape="car"),
        Body(name="mirror", shape="plate", role="mirror"),
    ]
    assert Scene(bodies).facets().role.tolist() == [MIRROR, BLOCKER, SCATTERER, MIRROR]


def test_target_of_given_rcs():
    man = Body(
        name="man", shape="pedestrian", rcs_dbsm=[(0.0, 0.0), (90.0, 10.0), (-90.0, 10.0), (180.0, 20.0)],
        rcs_point=(0, 0, 1.0), position=(5.0, 1.0, 0.0), yaw_deg=90.0, velocity=(0.0, 2.0, 0.0),
    )  # fmt: skip
    p = Scene([man, Body(name="dot", shape="sphere", rcs_dbsm=3.0)]).points(1.0)
    np.testing.assert_allclose(p.position[0], [5.0, 3.0, 1.0])
    np.testing.assert_allclose(p.heading, [np.pi / 2, 0.0])
    at = [np.interp(np.radians(a), p.azimuth, p.sigma[0]) for a in (-180, -90, 0, 45, 90, 180)]
    np.testing.assert_allclose(at, [100.0, 10.0, 1.0, 10**0.5, 10.0, 100.0], rtol=1e-9)
    np.testing.assert_allclose(p.sigma[1], 10**0.3)
    assert p.body.tolist() == [0, 1] and (p.azimuth[0], p.azimuth[-1]) == (-np.pi, np.pi)


def test_materials_by_part_pattern_body_and_default():
    text = """
[materials.paint]
eps_r = 3.0
thickness_mm = 2.0
[[bodies]]
name = "car"
shape = "car"
material = "concrete"
materials = { "tyre_*" = "paint", plate = "pec" }
"""
    f = Scene.from_text(text).facets()

    def of(part):
        rows = f.material[f.part == f.part_names.index(part)]
        return rows[0]

    assert f.materials.kind[of("tyre_rear_left")] == LAYER
    assert f.materials.thickness[of("tyre_front_right")] == pytest.approx(2e-3)
    assert f.materials.kind[of("plate")] == PEC
    assert f.materials.eps[of("window_rear")].real == pytest.approx(5.24)
    own = Scene([Body(name="car", shape="car")]).facets()
    assert own.materials.kind[own.material[own.part == own.part_names.index("window_rear")][0]] == LAYER


def test_urban_scene_stands_where_the_study_says():
    scene = Scene.load(URBAN)
    place_of_radar, own = scene.radar.position, np.array([7.0, 0.0, 0.0])
    printed = table(3)
    assert scene.warnings == []
    for body in scene.bodies:
        if body.name in printed:
            row = printed[body.name]
            place = nearest_point(body, place_of_radar)
            way = place - place_of_radar
            far = np.linalg.norm(way)
            assert abs(far - row["sim_range"]) < 0.264 and abs(far - row["range"]) < 0.264
            assert (body.motion.velocity_at(place) - own) @ way / far == pytest.approx(row["rate"], abs=0.12)


def test_sensor_of_a_file():
    radar = Scene.load(URBAN).radar
    w = radar.waveform
    assert (w.carrier, w.n_chirps) == (77e9, 128)
    assert w.range_resolution == pytest.approx(0.2636, abs=1e-3)
    assert w.rate_resolution == pytest.approx(0.249, abs=0.0025)
    assert radar.power == pytest.approx(10**1.2 * 1e-3)
    np.testing.assert_allclose(Scene.load(URBAN).radar_at(2.0).position, [14.0, 0.0, 0.5])


@pytest.mark.parametrize(
    "antenna",
    [
        f'"{PATCH}"',
        '{ kind = "isotropic", front = true }',
        '{ kind = "cosine", hpbw_h_deg = 80.0, hpbw_v_deg = 60.0 }',
        '{ kind = "array", ny = 4, element = { kind = "cosine", hpbw_h_deg = 90.0, hpbw_v_deg = 90.0 } }',
    ],
)
def test_antennas_of_a_file(antenna):
    radar = Scene.from_text(BARE_RADAR.replace("[radar]", f"[radar]\nantenna = {antenna}")).radar
    ahead, behind = radar.tx_field(np.array([[1.0, 0, 0], [-1.0, 0, 0]]))
    assert np.linalg.norm(ahead) >= 1.0 and np.linalg.norm(behind) < 1e-9
    assert abs(ahead[2]) == pytest.approx(np.linalg.norm(ahead))


def test_a_radar_without_an_antenna_is_isotropic_ahead():
    radar = Scene.from_text(BARE_RADAR).radar
    ahead, behind = np.linalg.norm(radar.tx_field(np.array([[1.0, 0, 0], [-1.0, 0, 0]])), axis=1)
    assert ahead**2 == pytest.approx(2.0) and behind == 0.0


def test_antenna_files_are_named_from_the_scene_file(tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "cuts.csv").write_text("plane,angle_deg,gain_dbi\naz,0,0\naz,9,-3\nel,0,0\nel,9,-3\n")
    (tmp_path / "own" / "horn.toml").write_text('kind = "measured"\nfile = "cuts.csv"\ngain_dbi = 20.0\n')
    file = tmp_path / "street.toml"
    file.write_text(BARE_RADAR.replace("[radar]", '[radar]\nantenna = "own/horn.toml"'))
    scene = Scene.load(file)
    assert np.linalg.norm(scene.radar.tx_field(np.array([[1.0, 0, 0]]))) == pytest.approx(10.0)
    assert scene.override(["radar.tx_antenna={kind='isotropic', gain_dbi=6}"]).radar.rx != scene.radar.tx


def test_meshes_are_found_beside_the_scene_and_their_health_is_told(tmp_path):
    box = trimesh.creation.box()
    faces = np.concatenate([box.faces[:-1], [[0, 0, 1]]])
    trimesh.Trimesh(box.vertices, faces, process=False).export(tmp_path / "open.ply")
    (tmp_path / "s.toml").write_text('[[bodies]]\nname = "b"\nmesh = "open.ply"\nunit = "mm"\n')
    said = " | ".join(Scene.load(tmp_path / "s.toml").warnings)
    assert "1 faces of zero area" in said and "not watertight" in said and "check unit" in said


def test_folding_targets_are_told_with_their_alias():
    text = BARE_RADAR + BALL.replace("10.0", "80.0") + "velocity_mps = [20.0, 0.0, 0.0]\n"
    said = [x for x in Scene.from_text(text).warnings if "appears" in x]
    w = Scene.from_text(text).radar.waveform
    top = 299_792_458.0 / (4.0 * w.middle * w.repetition)
    assert f"appears near {79.5 - w.unambiguous_range:.0f} m" in said[0]
    assert f"appears near {20.0 - 2.0 * top:.1f} m/s" in said[1]


def test_real_sampling_mirrors_the_range_axis():
    assert folded_range(23.0, 19.19, False) == pytest.approx(15.38)
    assert folded_range(40.0, 19.19, False) == pytest.approx(1.62)
    assert folded_range(40.0, 38.37, True) == pytest.approx(1.63)


def test_materials_outside_their_source_are_told():
    scene = Scene([Body(name="w", shape="wall", material="brick")], frequency=77e9)
    assert "extrapolated" in scene.warnings[0]


@pytest.mark.parametrize("name", ["bodies", "radar", "model", "processing", "frequency", "materials", "warnings"])
def test_a_scene_that_is_made_is_not_changed_by_an_assignment(name):
    scene = Scene.from_text(BARE_RADAR + BALL)
    for one in (scene, scene.at(0.1)):
        before = getattr(one, name)
        with pytest.raises(AttributeError, match=rf"Scene\.{name} cannot be set again: .*override"):
            setattr(one, name, None)
        assert getattr(one, name) is before


def test_an_rcs_table_has_one_value_for_each_azimuth():
    pairs = [(0.0, 0.85), (90.0, 0.35), (-90.0, 0.35), (270.0, 1.0)]
    with pytest.raises(rc.SceneError, match="two values for the azimuth -90 deg"):
        Scene([Body(name="man", shape="pedestrian", rcs_dbsm=pairs)])
    kept = np.array(pairs[:3])
    Scene([Body(name="man", shape="pedestrian", rcs_dbsm=kept)])
    assert kept.tolist() == [list(pair) for pair in pairs[:3]]
