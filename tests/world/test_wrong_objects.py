"""Scenes, bodies and materials made of values of another type are refused by the key, with what is allowed."""

from fractions import Fraction

import numpy as np
import pytest
import trimesh

import raychan as rc


def scene(**body):
    return rc.Scene([rc.Body(**({"name": "b", "shape": "box", "position": (9, 0, 0)} | body))])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        *((lambda x=x: rc.Material(pec=x), f"pec: {x!r} is not possible; allowed: true or false") for x in ("no", 1)),
        *(
            (lambda key=key, x=x: rc.Material(**{key: x}), f"{key}: {x!r} is not possible; allowed: .*between|above")
            for key in ("eps_r", "sigma", "thickness", "roughness")
            for x in ("3", True, float("nan"))
        ),
        (lambda: rc.Material(name=3), "name: 3 is not possible; allowed: a text"),
        *(
            (lambda key=key: rc.Scene(**{key: 3}), f"^{key}: 3 is not possible; allowed: a table")
            for key in ("processing", "model", "atmosphere")
        ),
        (
            lambda: rc.Scene(radar={"waveform": rc.Waveform(77e9, 1e9, 25e-6)}),
            r"^radar.waveform: Waveform\(.* is not possible; allowed: a table with keys among bandwidth_mhz, carrier",
        ),
        (
            lambda: rc.Scene(radar={"waveform": {"bandwidth_mhz": 1, "chirp_us": 9}, "impairments": rc.Impairments()}),
            r"^radar.impairments: .* is not possible; allowed: a table with keys among adc_bits, adc_full",
        ),
        (lambda: rc.Scene(model=0), "^model: 0 is not possible; allowed: a table"),
        (lambda: rc.Scene(radar=3), "^radar: 3 is not possible; allowed: a Radar, its table, or None"),
        (lambda: rc.Scene(atmosphere={"foo": 1}), "^atmosphere.foo: unknown key 'foo'"),
        (lambda: rc.Scene(model={"foo": 1}), "^model.foo: unknown key 'foo'"),
        (lambda: rc.Scene(processing={"foo": 1}), "^processing.foo: unknown key 'foo'"),
        (lambda: rc.Scene(radar={"foo": 1}), "^radar.foo: unknown key 'foo'"),
        *((lambda x=x: rc.Scene(title=x), r"^title: .* is not possible; allowed: a text") for x in (3, None, ["a"])),
        (lambda: rc.Scene(text=3), "^text: 3 is not possible; allowed: a text"),
        (lambda: rc.Scene(path=3), "^path: 3 is not possible; allowed: a Path, or None"),
        (lambda: rc.Scene(folder=3), "^folder: 3 is not possible; allowed: a Path, or None"),
        *(
            (
                lambda key=key, x=x: scene(**{key: x}),
                rf"^bodies\.b\.{key}: .* is not possible; allowed: 3 numbers",
            )
            for key in ("position", "velocity", "spin_dps")
            for x in (("5", 0, 0), [[5, 0, 0]], (True, 0, 0), 3)
        ),
        *(
            (lambda key=key, x=x: scene(**{key: x}), rf"^bodies\.b\.{key}: {x!r} is not possible; allowed: between")
            for key in ("yaw_deg", "turn_rate_dps")
            for x in ("30", True)
        ),
        (lambda: scene(rcs_dbsm=1.0, swerling=True), r"^bodies\.b\.swerling: True is not possible; allowed: 0, 1, 2"),
        (lambda: scene(material=""), r"^bodies\.b\.material: unknown material ''; allowed: one of asphalt"),
    ],
)
def test_a_value_of_another_type_is_told_by_its_key(make, said):
    with pytest.raises(rc.SceneError, match=said):
        make()


def test_scalars_of_numpy_lists_and_whole_floats_stay_allowed():
    assert rc.Material(eps_r=np.float32(3.0), sigma=1, pec=np.False_).kind is rc.Material(3.0, 1.0).kind
    given = {"position": np.array([9, 0, 0]), "velocity": [np.int8(1), 0, 0.0], "yaw_deg": np.float64(3)}
    (body,) = scene(**given, rcs_dbsm=1, swerling=1.0).bodies
    assert body.motion.velocity == (1.0, 0.0, 0.0) and body.fluctuates


ONE = (np.int64(8), np.float64(8), np.float32(8), np.array(8), np.array(8.0), 8.0)


def radar(processing=None, **wave):
    given = {"carrier": 77e9, "bandwidth": 5e8, "chirp_duration": 4e-5, "n_chirps": 8, "n_samples": 32}
    return rc.Radar(rc.Waveform(**(given | wave)), processing=processing or rc.Processing())


@pytest.mark.parametrize("eight", ONE, ids=repr)
def test_a_whole_number_of_numpy_is_one_in_the_objects_that_a_scene_takes(eight):
    wave = rc.Scene(radar=radar(n_chirps=eight, n_samples=eight)).radar.waveform
    assert [type(n) for n in (wave.n_chirps, wave.n_samples)] == [int, int] and wave == radar(n_samples=8).waveform
    settings = rc.Processing(pad=(eight, 1), guard=[eight, 0], train=np.array([8, 1]))
    assert rc.Scene(radar=radar(settings)).processing == rc.Processing(pad=(8, 1), guard=(8, 0), train=(8, 1))
    array = rc.ArrayAntenna(eight, 2, 0.5, 0.5)
    adc = rc.Impairments(converter=rc.Converter(eight, 0.0))
    wave = rc.Waveform(77e9, 5e8, 4e-5, n_chirps=16)
    tx = {"tx_elements": rc.uniform_array(2, 2e-3), "multiplexing": "ddm", "ddm_slots": eight}
    table = rc.Scene(radar=rc.Radar(wave, antenna=array, impairments=adc, **tx)).radar_table
    assert (table.antenna.ny, table.impairments.adc_bits, table.ddm_slots) == (8, 8, 8)


@pytest.mark.parametrize("eight", ONE[:-1], ids=repr)
def test_a_number_of_numpy_is_one_in_shapes_and_tables(eight):
    height = rc.Scene([rc.Body("b", shape="box", params={"height": eight})])
    assert "height = 8" in height.to_toml()
    if not isinstance(getattr(eight, "item", int)(), float):
        assert rc.Scene(model={"max_bounces": eight, "max_rays": eight}).model.max_bounces == 8
        assert (
            scene(shape="bike_rack", params={"hoops": eight}).to_toml()
            == scene(shape="bike_rack", params={"hoops": 8}).to_toml()
        )


def test_a_truth_value_of_numpy_is_one():
    for no in (np.bool_(False), np.array(False)):
        quiet = rc.Scene(radar=rc.Radar(radar(complex_sampling=no).waveform, noise=no)).radar
        assert quiet.noise is False and quiet.waveform.complex_sampling is False
        assert rc.Scene(model={"simplify": no}).model.simplify is False


@pytest.mark.parametrize("key", ["eps_r", "sigma", "thickness", "roughness"])
@pytest.mark.parametrize("given", [np.array([4.0, 5.0]), np.array([]), 10**400, 10**5000], ids=type)
def test_arrays_and_numbers_beyond_floats_are_no_figure_of_a_material(key, given):
    with pytest.raises(rc.SceneError, match=f"{key}: .* is not possible; allowed: (between|above)"):
        rc.Material(**{key: given})
    assert rc.Material(**{key: Fraction(3, 2), "roughness": np.array(0.5)}).roughness == 0.5


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: rc.Scene(frequency=np.array([76e9, 77e9])),
            r"frequency: array\(.*\) is not possible; allowed: bet",
        ),
        (lambda: rc.Scene(bodies=np.array(1)), r"bodies: array\(1\) is not possible; allowed: a list of Body"),
        (lambda: rc.Scene(interferers=np.array(1)), r"interferers: array\(1\) is not possible; allowed: a list"),
        (lambda: scene().at(np.array([])), r"time: array\(.*\) is not possible; allowed: a number between"),
        (lambda: scene().at(10**400), r"time: 1000.* is not possible; allowed: a number between"),
        (lambda: scene(swerling=np.array([1, 2]), rcs_dbsm=1.0), r"swerling: array\(\[1, 2\]\) is not possible"),
        (lambda: rc.Scene.load("\0"), r"'\\x00' is not possible; allowed: a name without a zero byte"),
        (lambda: rc.load_antenna("\0"), r"path: '\\x00' is not possible; allowed: a name without a zero byte"),
        (lambda: rc.MeasuredAntenna.load("\0"), r"path = '\\x00': a name without a zero byte is wanted"),
    ],
)
def test_an_array_or_a_name_that_cannot_be_is_told_by_its_key(make, said):
    with pytest.raises(ValueError, match=said):
        make()


@pytest.mark.parametrize(("key", "given"), [("up", b"z"), ("forward", b"1"), ("unit", np.array("a")), ("unit", b"m")])
def test_an_axis_or_a_unit_that_is_no_text_is_told_by_its_key(tmp_path, key, given):
    file = tmp_path / "box.ply"
    trimesh.creation.box((0.3, 0.3, 0.3)).export(file)
    with pytest.raises(rc.SceneError, match=f"b.{key}: .* is not possible; allowed: a text"):
        scene(shape=None, mesh=file, **{key: given})
