"""Collision avoidance fed by the scanner only: the ship keeps its distance from what stands anywhere in its way."""

import numpy as np
import pytest

import raychan as rc
from raychan.dynamics import yacht
from raychan.dynamics.avoidance import Lookout, Prediction
from raychan.dynamics.ship import PSI, X, Y
from raychan.dynamics.steering import SteeringGear, lqr
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.scene import ship_scene

KEPT = 10.0
GEAR = SteeringGear(np.radians(30.0), np.radians(15.0))
WEIGHTS = [0.0, 0.0, 1.0, 0.0, 2.0]


def tables(bodies, avoid=True, **scanner):
    """Return a yacht's way along x between two way-points, past bodies; scans 15 times a second."""
    made = {
        "ship": {"model": "yacht", "speed_mps": 5.0},
        "steering": {"weights": WEIGHTS, "max_rudder_deg": 30.0, "max_rudder_rate_dps": 15.0},
        "programme": {"way_points": [[0.0, 0.0], [400.0, 0.0]], "lookahead_m": 40.0},
        "scanner": {"position": [0.0, 0.0, 3.0], "noise_m": 0.02, "mirror_hz": 15.0} | scanner,
        "sea": {"reflectivity": 0.3},
        "bodies": bodies,
        "run": {"duration_s": 50.0},
    }
    return made | ({"avoidance": {"distance_m": KEPT}} if avoid else {})


def sailed(scene):
    loop = ShipLoop(scene)
    return [loop.step_scan() for _ in range(loop.scans)]


def outline(body):
    """Return points (n, 2) of the outline of an upright box, every 10 cm."""
    half = 0.5 * np.array([body["params"]["length"], body["params"]["width"]])
    side = np.linspace(-1.0, 1.0, 200)
    one = np.ones(200)
    rim = np.concatenate([np.stack(p, 1) for p in ((side, one), (side, -one), (one, side), (-one, side))]) * half
    yaw = np.radians(body["yaw_deg"])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    return rim @ turn.T + body["position"][:2]


def nearest(frames, bodies):
    """Return the least distance [m] of the ship's midpoint from the outline of any body."""
    track = np.array([(f.x, f.y) for f in frames])[::3]
    return min(float(np.hypot(*(track[:, None] - outline(b)).T).min()) for b in bodies)


def random_boxes(seed):
    rng = np.random.default_rng(seed)
    length, width = rng.uniform(0.5, 12.0, 2)
    place = [rng.uniform(70.0, 110.0), rng.uniform(-8.0, 8.0), 0.0]
    return [
        {
            "name": "box", "shape": "box", "params": {"length": length, "width": width, "height": 12.0},
            "position": place, "yaw_deg": rng.uniform(0.0, 180.0),
        }
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
def test_the_ship_keeps_its_distance_wherever_a_body_stands_and_returns_to_its_track(seed):
    bodies = random_boxes(seed)
    frames = sailed(ship_scene(tables(bodies)))
    assert nearest(frames, bodies) >= KEPT
    assert nearest(sailed(ship_scene(tables(bodies, avoid=False))), bodies) < KEPT - 1.0
    end = frames[-1]
    assert end.x > 200.0 and abs(end.y) < 0.5 and np.cos(end.heading) > 0.999


def test_two_bodies_on_both_sides_are_passed_between_or_around():
    bodies = random_boxes(1)[0], random_boxes(2)[0]
    bodies = [
        body | {"name": name, "position": [90.0, y, 0.0]}
        for body, name, y in zip(bodies, "ab", (-14.0, 14.0), strict=True)
    ]
    assert nearest(sailed(ship_scene(tables(bodies))), bodies) >= KEPT


def test_an_empty_sea_turns_no_ship_though_its_heeled_scanner_meets_the_water():
    scene = tables([], roll_deg=-8.0)
    frames = sailed(ship_scene(scene))
    assert np.isfinite(frames[300].scan.range).any()
    assert max(abs(f.y) for f in frames) < 1e-6


def test_what_the_scanner_does_not_meet_is_not_avoided():
    # Black beyond its range: of a reflectivity of 0 nothing comes back.
    bodies = [random_boxes(1)[0] | {"reflectivity": 0.0}]
    assert nearest(sailed(ship_scene(tables(bodies))), bodies) < KEPT - 1.0


def test_predicted_paths_are_those_that_the_ship_then_sails():
    pilot = lqr(yacht.linear(5.0), WEIGHTS)
    prediction = Prediction.of(yacht.linear(5.0), pilot.gain, GEAR)
    state, dt = yacht.straight(5.0, 0.3), 0.02
    paths = prediction.paths(state, np.array([0.3, 1.5, -2.0]))
    plant = yacht.plant(5.0, dt, GEAR)
    for heading, path in zip((0.3, 1.5, -2.0), paths, strict=True):
        now = state
        for k in range(len(path) * 20):
            now = plant.advance(now, pilot.order(now[[1, 6, 2, 7, PSI]], heading))
            if (k + 1) % 20 == 0:
                assert np.hypot(*(now[[X, Y]] - path[(k + 1) // 20 - 1])) < 1.5


def test_echoes_are_forgotten_and_those_of_the_water_never_kept():
    lookout = Lookout(Prediction.of(yacht.linear(5.0), np.array([0.0, 0, 1, 0, 1]), GEAR), KEPT)
    lookout.see(np.array([[20.0, 0.0, 3.0], [10.0, 5.0, 0.2]]), 0.0)
    here = np.zeros(2)
    assert lookout.echoes(here, 1.0).tolist() == [[20.5, 0.5]]
    assert lookout.heading(yacht.straight(5.0), 0.0, 1.0) != 0.0
    assert lookout.heading(yacht.straight(5.0), 0.0, 100.0) == 0.0


def test_a_log_does_not_avoid():
    with pytest.raises(rc.SceneError, match="avoidance without replay"):
        ship_scene({"avoidance": {}, "replay": {"file": "none.csv"}})
