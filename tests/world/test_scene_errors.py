"""Scene files and overrides that are wrong: file, key, value and what is allowed."""

from __future__ import annotations

import pytest
from support.places import SCENES
from support.scene_texts import BALL, BARE_RADAR

from raychan.world.scene import Scene, SceneError


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("own/patsch.toml", "", "did you mean 'own/patch.toml'"),
        ("patch", "", "no antenna file"),
        ("own", "", "no antenna file"),
        ("", "", "radar.antenna: '' is not possible; allowed: the name of a file or a table"),
        ("/no/such/place/horn.toml", "", "no antenna file /no/such/place/horn.toml"),
        ("own/patch.toml", "kind = ", "patch.toml:1: not valid TOML"),
        ("own/patch.toml", 'kind = "cosine"\nhpbw_h = 3.0', "patch.toml: hpbw_h: unknown key 'hpbw_h'"),
        ("own/patch.toml", 'kind = "cosine"\nhpbw_h_deg = 80.0', "patch.toml: keys do not fit"),
        ("own/patch.toml", 'kind = "cosine"\nhpbw_h_deg = 80.0\nhpbw_v_deg = 180.0', "patch.toml: a half-power"),
        ("own/patch.toml", 'kind = "measured"\nfile = "none.csv"', "none.csv"),
        ("own/patch.toml", 'kind = "array"\nny = 2\ntaper_y = "hamm"', "patch.toml"),
        ("own/patch.toml", "ny = 2", "patch.toml: kind: key is missing"),
        (
            "own/patch.toml",
            'kind = "array"\nny = 2\nspacing_y = 0.5\ngain_dbi = 5.0\n[element]\nkind = "measured"\nfile = "no.csv"',
            "patch.toml: element",
        ),
    ],
)
def test_a_bad_antenna_file_is_named_with_its_key(tmp_path, name, content, says):
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "patch.toml").write_text(content)
    with pytest.raises(SceneError) as caught:
        Scene.from_text(BARE_RADAR.replace("[radar]", f'[radar]\nantenna = "{name}"'), tmp_path / "street.toml")
    assert says in str(caught.value)


def test_override_changes_keys_and_keeps_the_file():
    scene = Scene.load(SCENES / "urban.toml")
    new = scene.override(
        ["radar.power_dbm=10", "bodies.suv.position=[20, 0, 0]", "radar.antenna=antennas/patch.toml", "scene.title=x"]
    )
    assert new.radar.power == pytest.approx(0.01) and new.title == "x"
    suv = next(b for b in new.bodies if b.name == "suv")
    assert list(suv.position) == [20, 0, 0]
    assert "# changed: radar.power_dbm=10" in new.text
    assert Scene.load(SCENES / "urban.toml").text == scene.text


@pytest.mark.parametrize(
    ("change", "key", "says"),
    [
        ("radar.powr_dbm=1", "radar.powr_dbm", "power_dbm"),
        ("bodies.suw.yaw_deg=1", "bodies.suw", "suv"),
        ("radar.power_dbm", "radar.power_dbm", "key=value"),
        ("radar.power_dbm=loud", "radar.power_dbm", "number"),
        *(
            (f"model.speckle={x}", "model.speckle", "allowed: true or false")
            for x in ("yes", "1", "on", "True", '"true"')
        ),
        ("model.tolerance_db=true", "model.tolerance_db", ": true is not possible"),
        ("bodies.suv.rcs_dbsm=[[false, 1]]", "bodies.suv.rcs_dbsm.0.0", ": false is not possible"),
        ("radar=[true, {noise=true}]", "radar", ": [true, {'noise': true}] is not possible"),
        ("radar.noise=off", "radar.noise", "allowed: true or false"),
        ("radar.waveform.iq=0", "radar.waveform.iq", "allowed: true or false"),
        ("scene.title.x=1", "scene.title", "table"),
        ("bodies=3", "bodies", "list"),
        ("bodies.suv=1", "bodies.suv", "allowed: one of its keys, as bodies.suv.position=[0, 0, 0.5]"),
        ("bodies.suw=1", "bodies.suw", "did you mean 'suv'?"),
        ("scene.title=caf\udce9", "", r"'scene.title=caf\udce9' is not possible; allowed: a text in UTF-8"),
    ],
)
def test_bad_overrides_are_named(change, key, says):
    with pytest.raises(SceneError) as caught:
        Scene.load(SCENES / "urban.toml").override([change])
    assert caught.value.key == key and says in str(caught.value)


@pytest.mark.parametrize(
    ("text", "key", "says"),
    [
        ("[radar\n", "", "TOML"),
        ("a = 1\na = 2\n", "", "TOML"),
        ("[sceen]\n", "sceen", "did you mean 'scene'"),
        (BARE_RADAR + "chirp = 3\n", "radar.waveform.chirp", "chirps"),
        (
            BARE_RADAR.replace("[radar]", "[radar]\nvelocity_kmh = [7.0, 0.0, 0.0]"),
            "radar.velocity_kmh",
            "velocity_mps",
        ),
        (BARE_RADAR.replace("[radar]", "[radar]\npositon = [0, 0, 1]"), "radar.positon", "position"),
        (BARE_RADAR.replace("[radar]", "[radar]\nposition = [0.0, 1.0]"), "radar.position", "3"),
        (BARE_RADAR.replace("[radar]", '[radar]\nantenna = "patch.tml"'), "radar.antenna", "no antenna file"),
        (BARE_RADAR.replace("[radar]", '[radar]\nrx_antenna = "patch.tml"'), "radar.rx_antenna", "no antenna file"),
        (BARE_RADAR.replace("[radar]", '[radar]\nantenna = { kind = "cosin" }'), "radar.antenna.kind", "'cosine'"),
        (BARE_RADAR.replace("[radar]", '[radar]\nantenna = { kind = "isotropic", ny = 2 }'), "radar.antenna", "front"),
        (
            BARE_RADAR.replace("[radar]", '[radar]\nantenna = { kind = "isotropic", gain_dbi = 3.0, loss_db = 1.0 }'),
            "radar.antenna",
            "either gain_dbi or loss_db",
        ),
        (BARE_RADAR.replace("[radar]", '[radar]\nantenna = { kind = "cosine" }'), "radar.antenna", "hpbw"),
        (BARE_RADAR.replace("[radar]", '[radar]\nantenna = { kind = "array", nx = 2 }'), "radar.antenna.nx", "ny"),
        (
            BARE_RADAR.replace("[radar]", "[radar]\nnoise_figure_db = inf"),
            "radar.noise_figure_db",
            "number between 0 and",
        ),
        (BARE_RADAR.replace("60.5", "-60.5"), "radar.waveform.chirp_us", "between 0.001"),
        (BARE_RADAR.replace("60.5", '"60.5 us"'), "radar.waveform.chirp_us", "number"),
        (BARE_RADAR + "samples = 0\n", "radar.waveform.samples", "between 1 and"),
        (
            BARE_RADAR + "\n[radar.impairments]\nchirp_error_us_khz = [[0, 0], [10, -1e8]]\n",
            "radar.impairments.chirp_error_us_khz",
            "above 0 GHz",
        ),
        (BARE_RADAR + "repetition_us = 30.0\n", "radar.waveform", "repetition_us"),
        ("[radar]\npower_dbm = 3.0\n", "radar.waveform", "missing"),
        ("[model]\nmax_bounces = 0\n", "model.max_bounces", "1"),
        ("[processing]\npfa = 2.0\n", "processing.pfa", "and 0.5"),
        ("[materials.tin]\neps = 3.0\n", "materials.tin.eps", "eps_r"),
        ("[materials.tin]\neps_r = 0.2\n", "materials.tin.eps_r", "1"),
        (BALL + 'material = "concret"\n', "bodies.ball.material", "concrete"),
        (BALL + 'materials = { boddy = "pec" }\n', "bodies.ball.materials.boddy", "body"),
        (BALL + "params = { radius = -1.0 }\n", "bodies.ball.params.radius", "positive"),
        (BALL + "params = { radious = 1.0 }\n", "bodies.ball.params.radious", "radius"),
        (BALL + "velocity = [1, 0, 0]\n", "bodies.ball.velocity", "velocity_mps"),
        (BALL + "position = 3\n", "", "TOML"),
        (BALL + 'mesh = "a.ply"\n', "bodies.ball", "either"),
        (BALL + BALL, "bodies.ball", "two bodies"),
        (BALL.replace("sphere", ""), "bodies.ball.shape", "unknown shape ''; allowed: one of bench"),
        (BALL.replace("sphere", "walker") + "params = { speed = -1.0 }\n", "bodies.ball.params.speed", "at most 30"),
        (BALL + "materiasl = { body = 'pec' }\n", "bodies.ball.materiasl", "did you mean 'materials'?"),
        (BALL + "materail = 'pec'\n", "bodies.ball.materail", "did you mean 'material'?"),
        (BALL + "materials = { body = '' }\n", "bodies.ball.materials.body", "unknown material ''; allowed: one of"),
        ("[atmosphere]\ntemperature_c = 300\n", "atmosphere.temperature_c", "300 is not possible; allowed: a number"),
        ("[atmosphere]\npressure_hpa = 1e5\n", "atmosphere.pressure_hpa", "is not possible; allowed: a number between"),
        (BALL.replace("sphere", "spere"), "bodies.ball.shape", "sphere"),
        (BALL + "role = 'wall'\n", "bodies.ball.role", "mirror"),
        ('[[bodies]]\nname = "m"\nmesh = "none.ply"\n', "bodies.m.mesh", "none.ply: mesh file not found; allowed"),
        ("[[bodies]]\nshape = 'car'\n", "bodies.0.name", "missing"),
        (BARE_RADAR + BALL.replace("10.0, 0.0, 0.5", "0.1, 0.0, 0.5"), "radar.position", "inside 'ball'"),
        (
            BARE_RADAR + '[[bodies]]\nname = "road"\nshape = "ground"\nposition = [0.0, 0.0, 1.0]\n',
            "radar.position",
            "behind 'road'",
        ),
    ],
)
def test_bad_scene_files_say_what_where_and_what_is_allowed(tmp_path, text, key, says):
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(SceneError) as caught:
        Scene.load(file)
    assert caught.value.key == key
    assert says in str(caught.value)
    assert str(caught.value).startswith(str(file))


def test_broken_toml_names_its_line(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text("[scene]\ntitle = 'x'\nthis is no toml\n")
    with pytest.raises(SceneError) as caught:
        Scene.load(file)
    assert caught.value.line == 3 and "bad.toml:3" in str(caught.value)


def test_missing_scene_file(tmp_path):
    with pytest.raises(SceneError, match="not found"):
        Scene.load(tmp_path / "none.toml")


@pytest.mark.parametrize("bad", ["nan", "empty"])
def test_nan_and_empty_meshes_name_file_and_body(tmp_path, bad):
    rows = {"nan": "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", "empty": "v 0 0 0\nv 1 0 0\nv 0 1 0\n"}
    (tmp_path / "m.obj").write_text(rows[bad])
    (tmp_path / "s.toml").write_text('[[bodies]]\nname = "b"\nmesh = "m.obj"\n')
    with pytest.raises(SceneError) as caught:
        Scene.load(tmp_path / "s.toml")
    assert caught.value.key == "bodies.b" and "m.obj" in str(caught.value)


@pytest.mark.parametrize(
    ("line", "key", "says"),
    [
        ("unit = 'xyz'", "unit", "unknown unit 'xyz'; allowed: one of cm"),
        ("up = 'q'", "up", "unknown axis 'q'; allowed: x, y, z"),
        ("forward = 'z'", "forward", "'z' lies along up; allowed: an axis across up = 'z'"),
        ("mesh = '.'", "mesh", ": is a folder; allowed: a mesh file"),
        ("mesh = 'm.xyz'", "mesh", "m.xyz: mesh file not found; allowed: a path to a file that exists"),
    ],
)
def test_a_wrong_key_of_a_mesh_is_told_by_the_scene_it_stands_in(tmp_path, line, key, says):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    mesh = "" if key == "mesh" else "mesh = 'm.obj'\n"
    file = tmp_path / "s.toml"
    file.write_text(f"[[bodies]]\nname = 'b'\n{mesh}{line}\n")
    with pytest.raises(SceneError) as caught:
        Scene.load(file)
    assert (caught.value.file, caught.value.key) == (file, f"bodies.b.{key}")
    assert says in str(caught.value)


def test_diffraction_to_a_receiver_elsewhere_is_refused_before_anything_is_traced():
    text = BARE_RADAR.replace("[radar]", "[radar]\nrx_position = [0.0, 3.0, 1.0]") + BALL
    with pytest.raises(SceneError) as caught:
        Scene.from_text(text + "\n[model]\ndiffraction = true\n")
    assert caught.value.key == "model.diffraction"
    assert "rx_position" in str(caught.value)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Scene(bodies=None), "bodies: None is not possible; allowed: a list of Body"),
        (lambda: Scene(bodies="car"), "bodies: 'car' is not possible; allowed: a list of Body"),
        (lambda: Scene(bodies=["a"]), "bodies.0: 'a' is not possible; allowed: a Body"),
        (lambda: Scene(materials={"tin": 3}), "materials.tin: 3 is not possible; allowed: a Material"),
        (lambda: Scene(materials=3), "materials: 3 is not possible; allowed: a dict of Material by name"),
        (lambda: Scene(radar=3), "radar: 3 is not possible; allowed: a Radar, its table, or None"),
        (lambda: Scene(frequency="a"), "frequency: 'a' is not possible; allowed: between 1e.08"),
        (lambda: Scene(interferers=None), "interferers: None is not possible; allowed: a list of Interferer"),
        (lambda: Scene.load(None), "path: None is not possible; allowed: a scene file, or the name of a bundled"),
        (lambda: Scene.from_text(None), "None is not possible; allowed: the text of a scene file"),
        (lambda: Scene.from_dict(None), "None is not possible; allowed: a table"),
        (lambda: Scene().at("x"), "time: 'x' is not possible; allowed: a number between"),
        (lambda: Scene().at(float("nan")), "time: nan is not possible; allowed: a number between"),
        (lambda: Scene.from_text(BALL).override("a=b"), "changes: 'a=b' is not possible; allowed: a list of texts"),
        (lambda: Scene.from_text("# caf\udce9"), "holds bytes that are no text; allowed: a text in UTF-8"),
        (lambda: Scene.from_text(BALL).override([3]), r"changes: \[3\] is not possible; allowed: a list of texts"),
    ],
)
def test_what_is_given_in_python_is_told_with_what_is_allowed(make, said):
    with pytest.raises(SceneError, match=said):
        make()


def test_a_key_given_twice_is_named_with_its_line():
    with pytest.raises(SceneError, match=r"not valid TOML: .frequency_ghz. is given twice") as said:
        Scene.from_text("[radar]\nfrequency_ghz = 77\nfrequency_ghz = 78\n")
    assert "Cannot" not in str(said.value)


def test_a_file_in_another_encoding_is_told_by_its_byte_and_line(tmp_path):
    file = tmp_path / "latin.toml"
    file.write_bytes('[radar]\nname = "Stra\xdfe"\n'.encode("latin-1"))
    with pytest.raises(SceneError, match=r"latin.toml:2: not valid TOML: byte 0xdf is no text in UTF-8"):
        Scene.load(file)
