"""The closed loop of ship and scanner: poses of a rolling deck, orders, time, and equal seeds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from raychan.dynamics import ship
from raychan.dynamics.steering import HeadingProgramme, StateFeedback, SteeringGear
from raychan.dynamics.voyage import LinearPlant, sail
from raychan.run.ship.loop import ShipLoop
from raychan.run.ship.scene import ship_scene
from raychan.sensors.laser import NO_BODY, SEA

EAST = {"headings": [[0.0, 90.0]]}
BOX = {"name": "box", "shape": "box", "params": {"length": 4.0, "width": 4.0, "height": 20.0}}


def frames(tables, count):
    loop = ShipLoop(ship_scene(tables))
    return [loop.step_scan() for _ in range(count)]


def test_the_loop_sails_as_the_ship_alone_does():
    tables = {"steering": {"gain": ship.PRINTED_GAIN.tolist(), "max_rudder_deg": 10.0}, "programme": EAST}
    found = frames(tables, 1500)
    start = np.zeros(10)
    start[ship.U] = ship.CORRECTED.speed
    plant = LinearPlant(ship.exact_step(ship.CORRECTED, 1 / 75), SteeringGear(np.radians(10.0), np.radians(5.0)))
    course = HeadingProgramme(np.zeros(1), np.array([np.pi / 2]))
    track = sail(plant, start, StateFeedback(ship.PRINTED_GAIN), course, 1500 / 75)
    assert [f.heading for f in found] == pytest.approx(track.state[:1500, ship.PSI], abs=1e-12)
    assert [f.x for f in found] == pytest.approx(track.state[:1500, ship.X], abs=1e-9)
    assert [f.y for f in found] == pytest.approx(-track.state[:1500, ship.Y], abs=1e-9)
    assert [f.time for f in found] == pytest.approx(np.arange(1500) / 75, abs=1e-12)


@pytest.mark.parametrize("model", ["corrected", "container", "yacht"])
def test_equal_seeds_give_equal_bytes_and_others_do_not(model):
    tables = {"ship": {"model": model}, "steering": {"controller": "lqg"}, "sea": {"reflectivity": 0.5}}
    tables |= {"scanner": {"noise_m": 0.1, "pitch_deg": 10.0}}
    first, again = frames(tables, 40), frames(tables, 40)
    other = frames(tables | {"run": {"seed": 1}}, 40)
    assert [f.scan.range.tobytes() for f in first] == [f.scan.range.tobytes() for f in again]
    assert [f.heading for f in first] == [f.heading for f in again]
    assert first[-1].heading != other[-1].heading
    assert np.isfinite(first[-1].scan.range).any()


def test_orders_take_the_helm_and_give_it_back():
    loop = ShipLoop(ship_scene({"ship": {"model": "yacht"}}))
    loop.order(rudder=np.radians(20.0), shaft=10.0)
    for _ in range(600):
        frame = loop.step_scan()
    assert frame.rudder == pytest.approx(np.radians(20.0)) and frame.yaw_rate > 0.05
    assert frame.shaft == 10.0
    loop.order()
    for _ in range(3000):
        frame = loop.step_scan()
    assert np.cos(frame.heading) == pytest.approx(1.0, abs=1e-4)
    assert frame.shaft == pytest.approx(loop.scene.bridge.plant.shaft)


def test_an_order_that_a_ship_does_not_take_is_told():
    linear = ShipLoop(ship_scene({}))
    with pytest.raises(ValueError, match="keeps its speed"):
        linear.order(shaft=1.0)
    assert not linear.takes_shaft
    yacht = ShipLoop(ship_scene({"ship": {"model": "yacht"}}))
    with pytest.raises(ValueError, match="allowed: 0 to 30"):
        yacht.order(shaft=99.0)
    with pytest.raises(ValueError, match="finite"):
        yacht.order(rudder=float("nan"))


def test_a_body_abeam_is_met_at_its_distance_from_the_scanner_not_from_the_ship():
    body = BOX | {"position": [10.0, 30.0, 0.0]}
    tables = {"scanner": {"position": [10.0, 0.0, 5.0]}, "bodies": [body]}
    (frame,) = frames(tables, 1)
    # To port is the last beam, at +90 deg; the box's near side is 28 m away. It moves on by 10.3 m/s x 6.7 ms.
    assert frame.scan.range[-1] == pytest.approx(28.0, abs=1e-6)
    assert frame.scan.body[-1] == 0 and frame.scan.body[0] == NO_BODY


def test_a_heeled_deck_meets_the_sea_on_one_side_and_the_sky_on_the_other():
    scene = ship_scene({"ship": {"model": "yacht"}, "sea": {"reflectivity": 1.0}})
    loop = ShipLoop(scene)
    loop.order(rudder=np.radians(30.0))
    for _ in range(900):
        frame = loop.step_scan()
    assert frame.roll < np.radians(-5.0)  # a turn to starboard heels to port
    angle = scene.scanner.angles
    met = frame.scan.body == SEA
    assert met[angle > np.radians(60.0)].all() and not met[angle < 0.0].any()
    roll = -frame.beams.roll[met]
    assert frame.scan.range[met] == pytest.approx(5.0 * np.cos(roll) / (np.sin(roll) * np.sin(angle[met])), rel=1e-9)


def test_beams_leave_from_where_the_ship_is_at_their_own_time():
    for step, turns in ((1.0, 1), (0.25, 4)):
        tables = {"ship": {"model": "yacht"}, "scanner": {"step_deg": step}}
        first, second = frames(tables, 2)
        times = ship_scene(tables).scanner.times
        along = first.x + first.speed * times
        assert first.beams.position[:, 0] == pytest.approx(along, abs=1e-9)
        assert second.time == pytest.approx(turns / 75)
        (still,) = frames({**tables, "scanner": {"step_deg": step, "motion": False}}, 1)
        assert (still.beams.position[:, 0] == still.x).all()


def test_a_body_that_moves_is_met_where_it_is_then():
    body = BOX | {"position": [30.0, 0.0, 0.0], "velocity_mps": [-3.0, 0.0, 0.0]}
    found = frames({"ship": {"model": "yacht"}, "scanner": {"motion": False}, "bodies": [body]}, 76)
    ahead = [f.scan.range[90] for f in found]
    assert ahead[0] == pytest.approx(28.0, abs=1e-6)
    assert ahead[-1] == pytest.approx(28.0 - 3.0 - found[-1].x, abs=1e-4)


def test_beams_of_the_stiff_printed_ship_roll_as_it_does_within_a_step():
    gain = {"steering": {"gain": ship.PRINTED_GAIN.tolist()}}
    start = np.zeros(10)
    start[ship.U], start[ship.PHI] = ship.CORRECTED.speed, 0.1
    scene = ship_scene({**gain, "scanner": {"step_deg": 0.25}})
    loop = ShipLoop(replace(scene, bridge=replace(scene.bridge, start=start)))
    frame = loop.step_scan()
    # Four steps of 1/75 s; the exact roll with the rudder amidships, which hardly rolls this ship.
    times = scene.scanner.times
    exact = [float((expm(ship.CORRECTED.a * t) @ [0.0, 0.0, 0.0, 0.1, 0.0])[3]) for t in times]
    assert frame.beams.roll == pytest.approx(exact, abs=0.1 * 3e-5)
    assert np.ptp(exact) > 0.03


@pytest.mark.parametrize("mirror_hz", [1.0, 10.0, 25.0])
def test_a_slow_mirror_does_not_change_how_the_ship_sails_nor_where_beams_look(mirror_hz):
    """Rudder and autopilot act 75 times a second all the same; the roll of each beam is the matrix exponential's. By
    one step a turn of the mirror it is 17 deg off at 1 Hz, of a ship that heels 5 deg and rolls in 0.32 s."""
    slow, fast = (ShipLoop(ship_scene({"scanner": {"mirror_hz": hz}})) for hz in (mirror_hz, 75.0))
    for loop in (slow, fast):
        while loop.now < 2.0 - 1e-9:
            loop.step_scan()
    np.testing.assert_allclose(slow.state, fast.state, rtol=1e-9, atol=1e-12)
    loop = ShipLoop(ship_scene({"ship": {"model": "corrected"}, "scanner": {"mirror_hz": mirror_hz}}))
    loop._steered.state[ship.PHI] = np.radians(5.0)
    loop.order(0.0)
    for _ in range(2):
        frame = loop.step_scan()
        times = frame.time + loop.scene.scanner.times[::20]
        roll = [(expm(ship.CORRECTED.a * t) @ [0.0, 0.0, 0.0, np.radians(5.0), 0.0])[3] for t in times]
        np.testing.assert_allclose(frame.beams.roll[::20], roll, atol=np.radians(1e-4))


def test_a_container_ship_whose_propeller_brakes_slows_down_and_sails_on():
    loop = ShipLoop(ship_scene({"ship": {"model": "container"}, "scanner": {"mirror_hz": 5.0}}))
    loop.order(rudder=np.radians(5.0), shaft=0.1)
    speeds = [loop.step_scan().speed for _ in range(3000)]
    assert (np.diff(speeds[50:]) < 0.0).all() and 0.1 < speeds[-1] < 4.0
    with pytest.raises(ValueError, match="allowed: above 0"):
        loop.order(shaft=0.0)


WALL = {"name": "wall", "shape": "box", "params": {"length": 2.0, "width": 60.0, "height": 10.0}, "reflectivity": 1.0}


@pytest.mark.parametrize("turn", [0.0, 1e-9])
def test_each_beam_meets_a_moving_wall_where_it_is_at_the_beams_own_time(turn, tmp_path):
    # A body that turns is posed anew for each scan, one that does not is shifted: both must move within the scan.
    (tmp_path / "still.csv").write_text("t_s,x_m,y_m,heading_deg,roll_deg\n0,0,0,0,0\n1,0,0,0,0\n")
    wall = WALL | {"position": [50.0, 0.0, 0.0], "velocity_mps": [-20.0, 3.0, 0.0], "turn_rate_dps": turn}
    post = BOX | {"name": "post", "position": [20.0, 10.0, 0.0], "reflectivity": 1.0}
    tables = {
        "replay": {"file": str(tmp_path / "still.csv")},
        "scanner": {"step_deg": 0.25, "dark_range_m": 200.0},
        "bodies": [wall, post],
    }
    scanner = ship_scene(tables).scanner
    angle, found = scanner.angles, frames(tables, 15)
    for frame in (found[0], found[14]):
        times = frame.time + scanner.times
        expected = (49.0 - 20.0 * times) / np.cos(angle)
        hit = frame.scan.body == 0
        assert hit.sum() > 150 and (frame.scan.body == 1).sum() > 20, "and a body that stands still before it"
        assert frame.scan.range[hit] == pytest.approx(expected[hit], abs=1e-6)
    still = frames(tables | {"scanner": tables["scanner"] | {"motion": False}}, 15)[14]
    hit = still.scan.body == 0
    frozen = (49.0 - 20.0 * still.time) / np.cos(angle)
    assert still.scan.range[hit] == pytest.approx(frozen[hit], abs=1e-6)
