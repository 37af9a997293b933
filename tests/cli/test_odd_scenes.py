"""What `run` and `info` tell of odd meshes and scenes, in one line each with the key that mends it."""

from __future__ import annotations

import math

import pytest
import trimesh
from support.places import SCENES
from support.scene_texts import PLATE

import raychan as rc
from raychan.cli import invoke

BODY = '\n[[bodies]]\nname = "it"\nmesh = "it{end}"\nposition = [{x}, {x}, 0.0]\n{more}\n'


def block(*size, low=True):
    """Return a closed box that stands on z = 0, or is centred."""
    made = trimesh.creation.box(size)
    if low:
        made.apply_translation((0.0, 0.0, 0.5 * size[2]))
    return made


def told(tmp_path, mesh, end=".ply", more='material = "pec"', x=6.0):
    """Return the lines of a scene with a mesh in it that name the mesh's body."""
    mesh.export(tmp_path / f"it{end}")
    file = tmp_path / "scene.toml"
    file.write_text(PLATE.replace("9.0, 0.0, 1.0", "90.0, 9.0, 1.0") + BODY.format(end=end, more=more, x=x))
    return [w for w in rc.Scene.load(file).warnings if "'it'" in w and "ambig" not in w]


def solid(name, x, size=1.0, **more):
    return rc.Body(
        name=name, shape="box", params={"length": size, "width": size, "height": size}, position=(x, 0, 0), **more
    )


@pytest.mark.parametrize("name", ["urban", "living_street", "occluded_pedestrian"])
def test_nothing_is_told_of_the_shipped_scenes(name):
    assert rc.Scene.load(SCENES / f"{name}.toml").warnings == []


@pytest.mark.parametrize(
    ("metres", "unit"), [(1e3, "mm"), (1e2, "cm"), (1.0 / 0.0254, "inch")], ids=["mm", "cm", "inch"]
)
def test_a_car_in_another_unit_names_that_unit(tmp_path, metres, unit):
    car = block(4.5 * metres, 1.8 * metres, 1.4 * metres)
    (line,) = told(tmp_path, car, x=4000.0)
    assert "check unit" in line and f'bodies.it.unit = "{unit}" makes it 4.5 m' in line
    assert told(tmp_path, car, more=f'material = "pec"\nunit = "{unit}"') == []
    with pytest.raises(rc.SceneError, match=f"radar is inside 'it'.*bodies.it.unit = \"{unit}\""):
        told(tmp_path, car, x=0.0)


def test_a_glb_read_with_y_up_is_told_with_its_size_and_where_it_stands(tmp_path):
    (line,) = told(tmp_path, block(4.5, 1.8, 1.4), ".glb")
    assert "y was taken as up, but it stands on z = 0" in line and 'bodies.it.up = "z" turns it' in line
    (line,) = told(tmp_path, block(4.5, 1.8, 1.4, low=False), ".glb")
    assert "y was taken as up" in line and "1.4 x 4.5 x 1.8 m" in line and "bodies.it.up" in line
    assert told(tmp_path, block(4.5, 1.8, 1.4), ".glb", 'material = "pec"\nup = "z"') == []


def test_a_mesh_that_stands_on_another_axis_than_z_is_told(tmp_path):
    standing = block(4.5, 1.8, 1.4)
    assert told(tmp_path, standing) == []
    standing.apply_transform(trimesh.transformations.rotation_matrix(-1.5707963267948966, (1, 0, 0)))
    (line,) = told(tmp_path, standing)
    assert "z was taken as up, but it stands on y = 0" in line and 'bodies.it.up = "y"' in line


def test_open_meshes_and_meshes_without_a_material_are_told(tmp_path):
    sheet = block(1.0, 1.0, 1.0)
    sheet.update_faces(range(10))
    lines = told(tmp_path, sheet, more="")
    assert any("not watertight" in x for x in lines)
    assert any("perfect conductor (bodies.it.material)" in x for x in lines)
    said = told(tmp_path, block(1.0, 1.0, 1.0), more='materials = { "*" = "glass" }')
    assert not [x for x in said if "material" in x or "watertight" in x]


def test_bodies_that_reach_into_each_other_are_told_and_those_that_touch_are_not():
    one = solid("one", 0.0)
    (line,) = rc.Scene([one, solid("two", 0.9)]).warnings
    assert "'one' and 'two' overlap: about" in line or "'two' and 'one' overlap: about" in line
    assert "position" in line
    for x in (1.0, 1.0005, 1.2):
        assert rc.Scene([one, solid("two", x)]).warnings == []
    road = rc.Body(name="road", shape="ground", position=(0, 0, 0.2))
    assert rc.Scene([one, road]).warnings == []


@pytest.mark.parametrize("turn", [0.0, 31.0])
def test_bars_that_cross_overlap_though_no_corner_of_one_is_in_the_other(turn):
    size = {"length": 2.0, "width": 0.2, "height": 0.2}
    bars = [rc.Body(name=f"bar{i}", shape="box", params=size, yaw_deg=turn + 90.0 * i) for i in (0, 1)]
    (line,) = rc.Scene(bars).warnings
    assert "overlap: about" in line


def test_a_body_inside_glass_is_meant_so_and_one_inside_metal_is_told():
    inner = solid("inner", 0.0, 0.2)
    pane = rc.Material(eps_r=6.0, thickness=4e-3)
    assert rc.Scene([solid("case", 0.0, material=pane), inner]).warnings == []
    (line,) = rc.Scene([solid("case", 0.0, material="pec"), inner]).warnings
    assert "'inner' is wholly inside 'case'" in line and "bodies.inner.position" in line


@pytest.mark.parametrize("material", ["pec", rc.Material(eps_r=6.0, thickness=4e-3)], ids=["metal", "glass"])
@pytest.mark.parametrize(("x", "size"), [(5.0, 1.0), (5.0 + 1e-5, 1.0), (5.002, 1.0), (5.0, 1.0005), (5.05, 1.0)])
def test_bodies_that_overlap_nearly_wholly_are_told_whatever_they_are_made_of(x, size, material):
    (line,) = rc.Scene([solid("one", 5.0, material=material), solid("two", x, size, material=material)]).warnings
    assert "'one'" in line and "'two'" in line and "fill nearly the same space: is one a copy?" in line


def test_info_lists_each_of_several_bodies_with_its_own_place_and_nearest_corner(tmp_path, capsys, monkeypatch):
    """Distances are from the radar, at (0, 0, 1), whatever body comes before."""
    monkeypatch.setenv("COLUMNS", "200")
    box = '[[bodies]]\nname = "{}"\nshape = "box"\nmaterial = "pec"\nparams = {{length = 2, width = 2, height = 1}}\n'
    places = (("a", 9.0, 0.0), ("b", 20.0, 5.0), ("c", 9.0, -6.0))
    texts = [f"{box.format(name)}position = [{x}, {y}, 0]\n" for name, x, y in places]
    (tmp_path / "s.toml").write_text(PLATE + "".join(texts))
    assert invoke(["info", str(tmp_path / "s.toml")]) == 0
    told = {row[0]: row for line in capsys.readouterr().out.splitlines() if len(row := line.split()) > 10}
    for name, x, y in places:
        corner = min(math.hypot(x + i, y + k) for i in (-1, 1) for k in (-1, 1))
        assert told[name][3:8] == ["2.00", "x", "2.00", "x", "1.00"]
        assert told[name][8:10] == [f"{x:.2f},", f"{y:.2f},"] and told[name][-1] == f"{corner:.2f}"


def test_where_few_chirps_leave_too_few_training_cells_for_the_least_snr_the_run_says_so():
    """An echo of 23 dB SNR is missed by one chirp's detector, whose 6 training cells ask for 29 dB."""
    scene = rc.Scene.from_text(PLATE).override(["radar.power_dbm=0", "radar.waveform.chirps=1"])
    missed = rc.simulate(scene)
    assert len(missed.detections.range) == 0
    assert 20.0 < 10.0 * math.log10(missed.rdmap.power.max() / missed.rdmap.noise) < 29.0
    (line,) = [w for w in missed.warnings if "training cells" in w]
    assert "6 of the detector's 72" in line and "29 dB above the noise" in line and "radar.waveform.chirps" in line
    for change in ("processing.cfar='ca'", "processing.min_snr_db=30", "radar.noise=false", "radar.waveform.chirps=32"):
        assert not [w for w in rc.simulate(scene.override([change])).warnings if "training cells" in w], change


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("bodies=[]", "the scene has none"),
        ("bodies.sign.position=[-9,0,1]", "behind the antenna"),
        ("bodies.sign.position=[5000,0,1]", "no body is within the unambiguous range"),
        ("radar.yaw_deg=180", "behind the antenna"),
        ("radar={position=[0,0,1], yaw_deg=80, antenna={kind='cosine', hpbw_h_deg=5, hpbw_v_deg=5}, "
         "waveform={bandwidth_mhz=500, chirp_us=30}}", "no body is in the beam"),
    ],
)  # fmt: skip
def test_where_no_body_is_in_view_the_run_and_info_say_so(tmp_path, capsys, change, says):
    file = tmp_path / "scene.toml"
    scene = rc.Scene.from_text(PLATE)
    assert not [w for w in scene.warnings if "no body" in w]
    (line,) = [w for w in scene.override([change]).warnings if "no body" in w]
    assert says in line
    file.write_text(PLATE)
    assert invoke(["run", str(file), "--out", str(tmp_path / "out"), "--no-pictures", "--set", change]) == 0
    assert line in capsys.readouterr().err
    assert says in (tmp_path / "out" / "summary.json").read_text()


def test_info_takes_unit_and_up_of_meshes_and_of_nothing_else(tmp_path, capsys):
    file = tmp_path / "car.glb"
    block(4500.0, 1800.0, 1400.0).export(file)
    assert invoke(["info", str(file)]) == 0
    said = capsys.readouterr()
    assert "check unit" in said.err and "stands on z = 0" in said.err
    assert invoke(["info", str(file), "--unit", "mm", "--up", "z"]) == 0
    said = capsys.readouterr()
    assert "4.500 x 1.800 x 1.400 m" in said.out and said.err == ""
    assert invoke(["info", str(SCENES / "urban.toml"), "--up", "z"]) == 2
    assert "is not a mesh file" in capsys.readouterr().err
    assert invoke(["info", str(file), "--unit", "parsec"]) == 2
    assert "parsec" in capsys.readouterr().err


def test_of_many_overlapping_bodies_ten_are_named_and_the_others_counted():
    """Eight boxes about one place overlap in 28 pairs."""
    told = rc.Scene([solid(f"box{i}", 5.0 + 0.1 * i) for i in range(8)]).warnings
    named = [w for w in told if "overlap" in w or "fill nearly" in w]
    assert len(named) == 11 and named[-1].startswith("18 more pairs of bodies overlap")
