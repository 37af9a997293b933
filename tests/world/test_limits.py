"""Every figure has limits, said with unit and reason; what a run asks of the machine is known before it starts."""

from __future__ import annotations

import itertools
import re
import tracemalloc
from dataclasses import replace

import pytest
from pydantic import BaseModel
from support.scene_texts import PLATE

import raychan as rc
from raychan.cli import invoke
from raychan.processing.cfar import fitting_guard
from raychan.run import rules
from raychan.run.ship import schema as ship_schema
from raychan.world import limits
from raychan.world.errors import SceneError
from raychan.world.limits import Limit
from raychan.world.scene_files import antenna, impairments, materials, schema
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.quantities import Within

TABLES = [
    table
    for module in (schema, antenna, impairments, materials, ship_schema)
    for table in vars(module).values()
    if isinstance(table, type) and issubclass(table, BaseModel)
]
LIMITS = {name: value for name, value in vars(limits).items() if isinstance(value, Limit)}


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "plate.toml"
    file.write_text(PLATE)
    return file


def figures(annotation, metadata=()):
    """Return the metadata of each number within an annotation."""
    metadata = (*metadata, *getattr(annotation, "__metadata__", ()))
    annotation = annotation.__origin__ if hasattr(annotation, "__metadata__") else annotation
    if annotation in (int, float):
        yield metadata
    for inner in getattr(annotation, "__args__", ()):
        yield from figures(inner, metadata)


def test_every_number_of_the_schema_has_limits():
    fields = [(t, name, f) for t in TABLES for name, f in t.model_fields.items()]
    numbers = [(f"{t.__name__}.{n}", m) for t, n, f in fields for m in figures(f.annotation, tuple(f.metadata))]
    assert len(numbers) > 50
    assert [name for name, m in numbers if not any(isinstance(x, Within) for x in m)] == []


@pytest.mark.parametrize("name", LIMITS)
def test_a_limit_keeps_its_ends_and_says_why(name):
    limit = LIMITS[name]
    assert limit.allows(limit.high) and limit.allows(limit.low) is not limit.above
    assert not any(limit.allows(x) for x in (limit.high * 1.001 + 1, limit.low - 1, float("nan"), float("inf")))
    assert limit.why and limit.unit in limit.text
    for value in ("3", None, True, [1]):
        assert "number is wanted" in limit.problem(value)


@pytest.mark.parametrize(
    ("change", "key", "says"),
    [
        ("processing.rate_window=foo", "processing.rate_window", "hann"),
        ("processing.range_window=foo", "processing.range_window", "hann"),
        ("processing.range_window=taylor(3.3.3)", "processing.range_window", "hann"),
        ("processing.pad=[4,0]", "processing.pad.1", "between 1 and 64"),
        ("processing.pad=[1000000,1]", "processing.pad.0", "between 1 and 64"),
        ("processing.guard=[-1,0]", "processing.guard.0", "between 0 and 1000"),
        ("processing.train=[1,1001]", "processing.train.1", "between 0 and 1000"),
        ("radar.position=[1e30,0,0]", "radar.position.x", "1e+06 m"),
        ("bodies.sign.position.y=-1e30", "bodies.sign.position.y", "1e+06 m"),
        ("bodies.sign.velocity_mps=[1e308,0,0]", "bodies.sign.velocity_mps.x", "100000 m/s"),
        ("bodies.sign.velocity_mps=[9e18,0,0]", "bodies.sign.velocity_mps.x", "100000 m/s"),
        ("bodies.sign.rcs_dbsm=4000", "bodies.sign.rcs_dbsm", "100 dBsm"),
        ("bodies.sign.rcs_dbsm=[[0,4000],[9,1]]", "bodies.sign.rcs_dbsm.0.1", "100 dBsm"),
        ("radar.power_dbm=4000", "radar.power_dbm", "100 dBm"),
        ("radar.waveform.samples=1e30", "radar.waveform.samples", "a whole number between"),
        ("radar.waveform.chirps=1.5", "radar.waveform.chirps", "a whole number between 1 and 1,048,576"),
        ("radar.position=[0,0]", "radar.position", "3 numbers, each between"),
        ("radar.elements_mm=[]", "radar.elements_mm", "1 to 4096 receivers"),
        ("processing.pad=2", "processing.pad", "2 whole numbers, each between 1 and 64"),
        ("processing.guard=[1]", "processing.guard", "2 whole numbers, each between 0 and 1000"),
        ("model.retrace=0", "model.retrace", "'auto' or a whole number between 1 and 4096"),
        ("bodies.sign.rcs_dbsm=[[0,1]]", "bodies.sign.rcs_dbsm", "2 or more pairs"),
        ("radar.waveform.samples=1000000000000000000000000000000", "radar.waveform.samples", "between 1 and"),
        ("radar.waveform.carrier_ghz=77e9", "radar.waveform.carrier_ghz", "1000 GHz"),
        ("radar.waveform.bandwidth_mhz=1e9", "radar.waveform.bandwidth_mhz", "MHz"),
        ("radar.waveform.bandwidth_mhz=77000", "radar.waveform", "below the carrier"),
        ("radar.antenna={kind='array', ny=256, spacing_y=1.0}", "radar.antenna", "wavelengths"),
        ("model.tolerance_db=1e9", "model.tolerance_db", "40 dB"),
        ("materials.x={eps_r=1e9}", "materials.x.eps_r", "10000"),
        ("bodies.sign.params.width=1e9", "bodies.sign.params.width", "positive number"),
        ("bodies.sign.params.width=1e-9", "bodies.sign.params.width", "at least 1e-08 m, 1e-08 of its height"),
        ("bodies.sign.swerling=true", "bodies.sign.swerling", "a whole number between 0 and 4: 0 steady"),
        ("bodies.sign.up=x", "bodies.sign.up", "'x' lies along forward; allowed: an axis across forward = 'x'"),
        ("bodies.sign.forward=-z", "bodies.sign.forward", "'-z' lies along up"),
        ("bodies.sign.up=''", "bodies.sign.up", "allowed: x, y, z, -x"),
        ("bodies.sign.forward=''", "bodies.sign.forward", "allowed: x, y, z, -x"),
        ("radar.power_dbm=1979-05-27", "radar.power_dbm", ": 1979-05-27 is not possible"),
        ("radar.elements_mm=[[0,0,nan]]", "radar.elements_mm.0.2", "nan is not possible"),
    ],
)
def test_figures_beyond_limits_are_refused_by_key_with_what_is_allowed(scene, change, key, says):
    with pytest.raises(SceneError) as caught:
        rc.Scene.load(scene).override([change])
    assert caught.value.key == key and says in str(caught.value)


def test_true_is_no_length_though_it_equals_one(scene):
    one = rc.Scene.load(scene).override(["bodies.sign.params.width=1.0"])
    with pytest.raises(SceneError, match=r"bodies\.sign\.params\.width: true is not a number"):
        one.override(["bodies.sign.params.width=true"])


PAIRS = [
    ("phase_noise_hz_dbc", "1 or more pairs [offset Hz, level dBc/Hz]", "[offset Hz, level dBc/Hz], a pair of numbers"),
    ("chirp_error_us_khz", "2 or more pairs [time us, error kHz]", "[time us, error kHz], a pair of numbers"),
]


@pytest.mark.parametrize(("name", "every", "one"), PAIRS)
def test_a_list_of_pairs_is_refused_with_the_pair_that_is_allowed(scene, name, every, one):
    key = f"radar.impairments.{name}"
    for given, at, says in (("1", "", every), ("[]", "", every), ('["x"]', ".0", one), ("[[1],[2]]", ".0", one)):
        with pytest.raises(SceneError) as caught:
            rc.Scene.load(scene).override([f"{key}={given}"])
        assert caught.value.key == key + at and str(caught.value).endswith(f"is not possible; allowed: {says}")


@pytest.mark.parametrize(
    ("name", "rows", "says"),
    [
        ("chirp_error_us_khz", "[[1,2],[1,3]]", "a first number does not rise; allowed: rows whose first numbers rise"),
        ("phase_noise_hz_dbc", "[[9,-90],[1,-91]]", "a first number does not rise; allowed: rows whose first"),
        ("phase_noise_hz_dbc", "[[1,-90],[9,-80]]", "rises from -90 dBc/Hz at 1 Hz to -80 dBc/Hz at 9 Hz; allowed: "),
    ],
)
def test_pairs_that_do_not_go_together_are_told_by_their_key_alone(scene, name, rows, says):
    with pytest.raises(SceneError, match=r"^[^:]*: radar.impairments") as caught:
        rc.Scene.load(scene).override([f"radar.impairments.{name}={rows}"])
    assert caught.value.key == f"radar.impairments.{name}" and f"{name}: {says}" in str(caught.value)
    assert "ChirpError" not in str(caught.value) and "PhaseNoise" not in str(caught.value)


def refusals():
    """Yield what is said of each key of all tables that holds something else."""
    for table, junk in itertools.product(TABLES, ("x", 1, [], ["x"], [1, 2], [[1]], [[1, 2, 3]], {"a": 1}, True, None)):
        for key in table.model_fields:
            try:
                checked(table, {key: junk})
            except SceneError as refused:
                yield str(refused)


def test_every_key_is_refused_with_more_than_a_type():
    said = list(refusals())
    assert len(said) > 1000
    assert [x for x in said if re.search("allowed: (a valid |a list$|a list of at)", x)] == []


def test_a_ball_too_fine_to_build_is_refused_at_once():
    with pytest.raises(SceneError, match="larger max_sag"):
        rc.Scene([rc.Body(name="moon", shape="sphere", params={"radius": 1e5})])


@pytest.mark.parametrize("text", ["a = " + "[" * 5000 + "]" * 5000, "a = " + "9" * 6000, "a = 2024-02-31"])
def test_toml_that_python_cannot_hold_is_told(text):
    with pytest.raises(SceneError):
        rc.Scene.from_text(text)


@pytest.mark.parametrize(
    ("flags", "says"),
    [
        (["--tolerance", "inf"], "0.001 and 40 dB"),
        (["--tolerance", "nan"], "0.001 and 40 dB"),
        (["--max-bounces", "99"], "between 1 and 12"),
        (["--seed", "-1"], "63 bits"),
        (["--frames", "0"], "between 1 and"),
        (["--frames", "2", "--frame-interval", "1e300"], "1e+06 s"),
        (["--set", "radar.waveform.chirps=100000", "--set", "radar.waveform.samples=100000"], "radar.waveform.samples"),
        (["--set", "processing.train=[0,0]", "--set", "processing.guard=[0,0]"], "processing.train"),
        (["--set", "radar.waveform.chirps=1", "--set", "radar.waveform.samples=4"], "12 samples"),
    ],
)
def test_flags_have_the_limits_of_their_keys_and_nothing_is_written(scene, tmp_path, capsys, flags, says):
    assert invoke(["run", str(scene), "--out", str(tmp_path / "out"), "--no-pictures", *flags]) == 2
    assert says in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == [scene.name]


@pytest.mark.parametrize(
    "given", [{"tolerance_db": float("inf")}, {"tolerance_db": "x"}, {"max_bounces": 99}, {"seed": -1}, {"seed": 1.5}]
)
def test_python_arguments_have_the_limits_of_the_flags(scene, given):
    with pytest.raises(ValueError, match=next(iter(given))):
        rc.simulate(rc.Scene.load(scene), **given)


@pytest.mark.parametrize("field", ["position", "velocity", "yaw_deg", "turn_rate_dps", "spin_dps"])
@pytest.mark.parametrize("value", [float("nan"), 1e30, "x", None])
def test_bodies_made_in_python_have_the_limits_of_scene_files(field, value):
    vector = field in ("position", "velocity", "spin_dps")
    with pytest.raises(SceneError, match=f"b.{field}"):
        rc.Scene([rc.Body(name="b", shape="box", **{field: (0.0, value, 0.0) if vector else value})])


def test_two_chirps_by_sixteen_samples_make_a_map_and_the_smaller_guard_is_told(scene, tmp_path, capsys):
    small = ["--set", "radar.waveform.chirps=2", "--set", "radar.waveform.samples=16"]
    assert invoke(["run", str(scene), "--out", str(tmp_path / "out"), "--no-pictures", *small]) == 0
    assert "processing.guard = [1, 1] taken" in capsys.readouterr().err


def test_the_guard_that_fits_is_the_wanted_one_wherever_that_leaves_training_cells():
    assert fitting_guard((128, 256)) == (2, 2)
    assert fitting_guard((128, 256), (3, 5), (2, 2)) == (3, 5)
    assert fitting_guard((2, 16)) == (1, 1)
    assert fitting_guard((1, 8)) is None and fitting_guard((64, 64), (2, 2), (0, 0)) is None


def test_auto_needs_nothing_where_nothing_returns_and_nothing_makes_noise(scene):
    changes = ["model.mode=auto", "radar.noise=false", "bodies.sign.position=[-9,0,1]"]
    result = rc.simulate(rc.Scene.load(scene).override(changes))
    chosen = result.ledger["model"]
    assert (chosen.bounces, chosen.transmissions, chosen.diffraction) == (1, 0, False)


@pytest.mark.parametrize(("chirps", "samples", "pad"), [(256, 256, "[2,2]"), (512, 256, "[1,1]"), (128, 128, "[4,4]")])
def test_the_memory_foreseen_holds_what_a_run_takes_and_not_three_times_it(scene, chirps, samples, pad):
    sized = [f"radar.waveform.chirps={chirps}", f"radar.waveform.samples={samples}", f"processing.pad={pad}"]
    large = rc.Scene.load(scene).override(sized)
    rc.simulate(rc.Scene.load(scene))
    tracemalloc.start()
    rc.simulate(large)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert taken < rules.demand(large).memory < 3.0 * taken


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        (["processing.pad=[64,64]"], "processing.pad"),
        (["radar.elements_mm=[[0,0,0],[0,2,0],[0,4,0],[0,6,0],[0,8,0]]", "processing.pad=[1,1]"], "radar.elements_mm"),
        (["radar.waveform.chirps=4096", "radar.waveform.samples=32", "processing.pad=[1,1]"], "radar.waveform.chirps"),
        (["radar.waveform.samples=4096", "radar.waveform.chirps=16", "processing.pad=[1,1]"], "radar.waveform.samples"),
    ],
)
def test_what_needs_too_much_memory_is_refused_by_the_key_that_mends_it(scene, changes, key):
    with pytest.raises(SceneError) as caught:
        rules.check_demand(rc.Scene.load(scene).override(changes), memory=2.7e6)
    assert caught.value.key == key and "at most" in caught.value.allowed


def test_a_long_run_is_told_and_a_short_one_is_not(scene):
    short = rc.Scene.load(scene)
    assert rules.long_run(short) == []
    (said,) = rules.long_run(short, frames=100_000)
    assert "min" in said and "memory" in said
    assert replace(rules.demand(short), seconds=5.0).text.startswith("roughly 5 s")


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (["bodies.sign.velocity_mps=[3, 0, 0]"], "bodies.sign.position"),
        (["radar.velocity_mps=[0, -3, 0]"], "radar.position"),
        (["radar.rx_position=[0, 9, 1]", "radar.rx_velocity_mps=[0, 0, 3]"], "radar.rx_position"),
    ],
)
def test_motion_leads_nothing_beyond_the_limit_of_places(scene, change, key):
    moving = rc.Scene.load(scene).override(["radar.velocity_mps=[0, 0, 0]", *change])
    assert moving.at(3e5)
    said = rf"{key}: motion leads to \[.*\] m 1e\+06 s on; allowed: each between -1e\+06 and 1e\+06 m"
    for run in (lambda: moving.at(1e6), lambda: rc.frames(moving, 2, 1e6)):
        with pytest.raises(SceneError, match=said):
            run()


def test_a_walker_that_is_led_too_far_is_named_as_a_whole():
    with pytest.raises(SceneError, match=r"bodies\.anna\.position: motion leads to"):
        rc.Scene(bodies=[rc.Body("anna", shape="walker")]).at(1e9)


def test_the_command_says_in_a_line_where_motion_leads_too_far(scene, tmp_path, capsys):
    args = ["run", str(scene), "--out", str(tmp_path / "out"), "--frames", "2", "--frame-interval", "1e6"]
    assert invoke([*args, "--set", "radar.velocity_mps=[3,0,0]"]) == 2
    said = capsys.readouterr().err
    assert "radar.position: motion leads to [3e+06, 0, 1] m 1e+06 s on" in said and "Traceback" not in said
    assert not (tmp_path / "out").exists()
