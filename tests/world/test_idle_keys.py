"""Keys without effect are told, and only those that are set to another value than their default."""

import pytest
import trimesh
from support.scene_texts import PLATE

import raychan as rc


def idle(scene):
    made = rc.Scene.from_text(scene) if isinstance(scene, str) else scene
    return [line for line in made.warnings if "no effect" in line]


def test_a_scene_of_keys_that_count_is_silent():
    assert idle(PLATE) == []
    assert idle(PLATE.replace("[radar]", "[radar]\nnoise_figure_db = 9.0")) == []
    assert idle(PLATE.replace("[radar]", "[radar]\nnoise = false\nnoise_figure_db = 15.0")) == []


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (
            "[radar]\nnoise = false\nnoise_figure_db = 9.0\nnoise_temperature_k = 40.0",
            "radar: noise_figure_db and noise_temperature_k have no effect with noise = false",
        ),
        ("[radar]\nnoise = false\nnoise_figure_db = 9.0", "radar: noise_figure_db has no effect with noise = false"),
        (
            "[materials.steel]\npec = true\nsigma = 1e6\n[radar]",
            "materials.steel: sigma has no effect with pec = true",
        ),
        (
            '[materials.tar]\ndiffuse = { law = "gamma", level_db = -9.0, exponent = 8, texture_m = 2.0 }\n[radar]',
            "materials.tar.diffuse: exponent has no effect with law = 'gamma'",
        ),
        (
            '[materials.tar]\ndiffuse = { law = "lobe", level_db = -9.0, exponent = 8, texture_m = 2.0 }\n[radar]',
            "materials.tar.diffuse: texture_m has no effect without k_shape",
        ),
    ],
)
def test_keys_of_radar_and_materials_without_effect_are_told(keys, said):
    assert said in idle(PLATE.replace("[radar]", keys))


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("rcs_point = [0.0, 0.0, 0.0]", "bodies.sign: rcs_point has no effect without rcs_dbsm"),
        ('unit = "mm"\nscale = 2.0', "bodies.sign: unit and scale have no effect with shape = 'plate'"),
    ],
)
def test_keys_of_bodies_without_effect_are_told(key, said):
    assert idle(PLATE + key) == [said]
    assert idle(PLATE) == []


@pytest.mark.parametrize(("key", "value"), [("unit", "x"), ("up", "w"), ("forward", 3), ("scale", -1.0)])
@pytest.mark.parametrize("given", [{"shape": "plate"}, {"mesh": rc.Body(name="a", shape="plate").geometry}])
def test_a_value_is_refused_where_it_has_no_effect_as_where_it_has_one(key, value, given):
    with pytest.raises(rc.SceneError) as idle_one:
        rc.Scene(bodies=[rc.Body(name="b", **given, **{key: value})])
    with pytest.raises(rc.SceneError) as read:
        rc.Scene(bodies=[rc.Body(name="b", mesh=trimesh.creation.box(), **{key: value})])
    assert str(idle_one.value) == str(read.value) and idle_one.value.key == f"bodies.b.{key}"


def test_objects_from_python_are_told_alike():
    wave = rc.Waveform(77e9, 500e6, 20e-6)
    quiet = rc.Scene(radar=rc.Radar(wave, noise=False, noise_figure_db=9.0))
    assert idle(quiet) == ["radar: noise_figure_db has no effect with noise = false"]
    assert idle(rc.Scene(radar=rc.Radar(wave, noise=False))) == []


def test_settings_of_files_beside_a_mesh_in_metres_are_told():
    mesh = rc.Body(name="a", shape="box").geometry
    told = idle(rc.Scene(bodies=[rc.Body(name="b", mesh=mesh, unit="mm", up="y", material="pec")]))
    assert told == ["bodies.b: unit and up have no effect with a Mesh, which is in metres"]
    assert idle(rc.Scene(bodies=[rc.Body(name="b", mesh=mesh, material="pec")])) == []


@pytest.mark.parametrize("name", ["pec", "concrete", "asphalt", "car_glass"])
def test_a_material_that_redefines_a_built_in_one_is_told(name):
    said = f"materials.{name}: redefines the built-in material of that name, of which nothing is kept"
    assert said in rc.Scene.from_text(PLATE.replace("[radar]", f"[materials.{name}]\neps_r = 3\n[radar]")).warnings
    own = rc.Scene.from_text(PLATE.replace("[radar]", "[materials.my_pec]\neps_r = 3\n[radar]"))
    assert not any("redefines" in line for line in own.warnings)


@pytest.mark.parametrize("keys", ["thickness_mm = 4.0", "roughness_mm = 1.0", "eps_r = 1.0"])
def test_a_material_of_air_is_told(keys):
    told = rc.Scene.from_text(PLATE.replace("[radar]", f"[materials.glass]\n{keys}\n[radar]")).warnings
    assert "materials.glass: eps_r = 1 and sigma = 0 are those of air, which reflects nothing" in told


@pytest.mark.parametrize("keys", ["pec = true", "sigma = 1.0", "diffuse = { law = 'gamma', level_db = -20.0 }"])
def test_a_material_that_returns_waves_is_not_told_as_air(keys):
    told = rc.Scene.from_text(PLATE.replace("[radar]", f"[materials.own]\n{keys}\n[radar]")).warnings
    assert not any("air" in line for line in told)


def panes(material, shape="plate", **keys):
    body = rc.Body(name="g", shape=shape, position=(5.0, 0.0, 0.5), material=material, **keys)
    return [line for line in rc.Scene(bodies=[body]).warnings if "half space" in line]


def test_a_plate_of_a_dielectric_without_thickness_is_told():
    assert panes("glass") == [
        "bodies.g: of glass, which has no thickness: a half space, through which nothing passes (a pane is of "
        "car_glass or windscreen, or of a material with thickness_mm)"
    ]
    assert len(panes(rc.Material(eps_r=4.0))) == 1


@pytest.mark.parametrize(
    "material", [None, "pec", "metal", "car_glass", "windscreen", rc.Material(2.3, thickness=2e-3)]
)
def test_plates_of_metal_and_panes_are_silent(material):
    assert panes(material) == []
    assert panes("glass", "box") == panes("glass", rcs_dbsm=10.0) == []
