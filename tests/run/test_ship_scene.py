"""A ship's scene file: what is wrong in it is told with file, key and what is allowed; defaults sail."""

import numpy as np
import pytest

import raychan as rc
from raychan.dynamics.ship import KNOT, PHI, PSI, U
from raychan.run.ship.bridge import Steered, bridge_of
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.scene import read_ship_scene, ship_scene
from raychan.run.ship.schema import ShipFile
from raychan.world.scene_files.build import SHIP_TABLES
from raychan.world.scene_files.bundled import ship_names
from raychan.world.scene_files.schema import SceneFile

WRONG = {
    "[shipp]\nmodel = 'yacht'": "unknown key 'shipp'; did you mean 'ship'?",
    "[steering]\nweigths = [1, 1, 1, 1, 1]": r"steering\.weigths: unknown key 'weigths'; did you mean 'weights'\?",
    "[steering.noise]\nroll_degg = 1": "unknown key 'roll_degg'; did you mean 'roll_deg'",
    "[ship]\nmodel = 'tanker'": "ship.model: 'tanker' is not possible; allowed: 'printed', 'corrected'",
    "[ship]\nspeed_mps = -3": "ship.speed_mps: -3 is not possible; allowed: a number between 0.5 and 60 m/s",
    "[ship]\nmodel = 'container'\nspeed_mps = 40": "ship.speed_mps: 40.0 m/s is not possible; allowed: at most 160 rev",
    "[ship]\nmodel = 'yacht'\nspeed_mps = 40": "allowed: at most 18.0 m/s",
    "[ship]\nmodel = 'printed'": "steering.controller: the Riccati equation has no stabilising solution",
    "[steering]\nkp = 1.0": "steering: keys do not fit together; allowed: kp and kd together",
    "[steering]\ncontroller = 'pd'\ngain = [1, 1, 1, 1, 1]": "gain only with controller = 'lqr' or 'lqg'",
    "[steering]\nweights = [1, 2]": "steering.weights: .* allowed: 5 weights, of sway velocity",
    "[steering]\nmax_rudder_deg = 0": "steering.max_rudder_deg: 0 is not possible; allowed: a number above 0",
    "[programme]\nheadings = [[0, 0], [10, 360]]": "longer turns need turn_rate_dps",
    "[programme]\nheadings = [[5, 0]]": "programme.headings: times do not begin at 0 s and grow; allowed: times",
    "[programme]\nheadings = [[0, 0]]\nway_points = [[0, 0], [9, 9]]": "either headings or way_points",
    "[programme]\nway_points = [[0, 0], [0, 0]]": "programme.way_points: fewer .*; allowed: two way-points or",
    "[scanner]\nstep_deg = 0.3": r"scanner.step_deg: 0.3 is not possible; allowed: 1, 0.5 or 0.25",
    "[scanner]\nfan_deg = 180.5": "scanner.fan_deg: 180.5 is not possible; allowed: whole steps of 1 deg, up to 360",
    "[scanner]\nfan_deg = 400": "scanner.fan_deg: 400 is not possible; allowed: a number above 0 and at most 360 deg",
    "[[bodies]]\nname = 'a'\nshape = 'box'\nmaterial = 'PVC'": r"a.material: unknown material 'PVC'; .*'PVC, grey'",
    "[[bodies]]\nname = 'a'\nshape = 'boxx'": "bodies.a.shape: unknown shape 'boxx'; did you mean 'box'",
    "[[bodies]]\nname = 'a'\nmesh = 'nowhere.stl'": "bodies.a.mesh: .*nowhere.stl: mesh file not found",
    "[[bodies]]\nname = 'a'": "either shape or mesh",
    "[run]\nduration_s = nan": "run.duration_s",
    "[run]\nseed = -1": "run.seed",
    "[replay]\nfile = 'nowhere.csv'": "replay.file: .*nowhere.csv: file not found",
    "[ship\n": ":2: not valid TOML|:1: not valid TOML",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_told_with_its_file_and_what_is_allowed(text, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(rc.SceneError, match=WRONG[text]) as told:
        read_ship_scene(file)
    assert str(told.value).startswith(str(file))


def test_a_scene_that_is_nowhere_and_one_of_a_radar_are_told():
    with pytest.raises(rc.SceneError, match="did you mean 'ship_turn'"):
        read_ship_scene("ship_turm")
    with pytest.raises(rc.SceneError, match="a scene of a radar, not of a ship; allowed: raychan run"):
        read_ship_scene("urban")
    with pytest.raises(rc.SceneError, match="is a scene of a ship, not of a radar; allowed: raychan ship"):
        rc.Scene.load("ship_turn")


def test_the_tables_by_which_a_scene_of_a_ship_is_known_are_those_that_only_it_has():
    assert set(SHIP_TABLES) == set(ShipFile.model_fields) - set(SceneFile.model_fields)


@pytest.mark.parametrize("name", ship_names())
@pytest.mark.parametrize("model", ["printed", "corrected", "container", "yacht"])
@pytest.mark.parametrize("controller", ["pd", "lqr", "lqg"])
def test_every_model_sails_under_every_autopilot_that_it_has(name, model, controller):
    changes = [f"ship.model={model}", f"steering.controller={controller}", "ship.speed_mps=6", "run.duration_s=1"]
    if model == "printed" and controller != "pd":
        with pytest.raises(rc.SceneError, match=r"steering\.controller: .*; allowed: .*any ship.model but 'printed'"):
            read_ship_scene(name, changes)
        return
    loop = ShipLoop(read_ship_scene(name, changes))
    while not loop.done:
        frame = loop.step_scan()
    assert frame.time == pytest.approx(1.0 - 1 / 75)
    assert np.isfinite(loop.state).all()


def test_the_printed_ship_sails_with_its_printed_gain_and_its_heading_never_changes():
    gain = [2.4448, -0.0786, -12.6437, 0.4462, -1.0]
    tables = {"ship": {"model": "printed"}, "steering": {"gain": gain}, "programme": {"headings": [[0.0, 90.0]]}}
    loop = ShipLoop(ship_scene(tables))
    for _ in range(200):
        frame = loop.step_scan()
    assert frame.rudder != 0.0 and frame.heading == 0.0


def test_lqg_knows_its_own_error_in_the_loop():
    # The estimate's error about the disturbed ship has the covariance that the filter states.
    tables = {"ship": {"model": "yacht"}, "steering": {"controller": "lqg"}}
    bridge = bridge_of(ship_scene(tables).tables, 0.2)
    ship = Steered(bridge, tuple(np.random.default_rng(5).spawn(2)))
    off = []
    for _ in range(20000):
        ship.step()
        off.append(ship.estimate - ship.state[[1, 6, 2, 7, 5]])
    stated = np.sqrt(np.diag(bridge.watch.filter.predicted))
    assert np.std(np.array(off)[500:], axis=0) == pytest.approx(stated, rel=0.1)


def test_changed_keys_are_keys_of_the_file():
    scene = read_ship_scene("ship_trial", ["ship.speed_mps=4", "run.seed=7"])
    assert scene.bridge.start[U] == 4.0 and scene.tables.run.seed == 7
    assert "# changed: run.seed=7" in scene.text
    assert ship_scene({}).bridge.start[U] == pytest.approx(20 * KNOT)
    assert ship_scene({"ship": {"heading_deg": 90.0}}).bridge.start[PSI] == pytest.approx(np.pi / 2)
    assert ship_scene({}).bridge.start[PHI] == 0.0
