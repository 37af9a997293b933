"""The container ship of Son and Nomoto: its linearisation against the published one, symmetry, turns, steps."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from raychan.dynamics import container, ship

SPEED = 20.0 * ship.KNOT
MIRROR = np.array([1, -1, -1, 1, -1, -1, -1, -1, -1, 1.0])
"""Port and starboard exchanged: sway, yaw, east, heading, roll and rudder change sign."""


def prime(model: ship.LinearShip) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N (3, 3), G (3,) and b (3,) of (v, r, p) of a linear ship in the prime system."""
    order, per = [0, 2, 1], container.LENGTH / model.speed
    m = container.PUBLISHED_M @ np.diag([1.0, container.LENGTH, container.LENGTH])
    damping = -m @ model.a[np.ix_(order, order)] @ np.diag([1.0, 1 / container.LENGTH, 1 / container.LENGTH]) * per
    return damping, -m @ model.a[order, 3] * per / model.speed, m @ model.b[order] * per / model.speed


def test_the_inertia_is_the_published_one_to_its_printed_digits():
    order = [0, 2, 1]
    np.testing.assert_allclose(container.INERTIA[np.ix_(order, order)], container.PUBLISHED_M, rtol=1e-3)


def test_the_linearisation_at_20_knots_has_the_published_damping():
    """MSS prints N rounded from another state of the propeller: 5 % of the entry or 1 % of its row."""
    damping, _, _ = prime(container.linearised(SPEED))
    for row, printed in zip(damping, container.PUBLISHED_N, strict=True):
        np.testing.assert_allclose(row, printed, rtol=0.05, atol=0.01 * np.abs(printed).max())


def test_the_published_roll_stiffness_is_that_of_7_m_s():
    _, at_7, _ = prime(container.linearised(7.0))
    _, at_20_knots, _ = prime(container.linearised(SPEED))
    assert at_7[2] == pytest.approx(container.PUBLISHED_G[2], rel=2e-3)
    # Buoyancy does not grow with speed; the hull's own share, 2.1e-5, does.
    weight = container.PUBLISHED_G[2] - 2.1e-5
    assert at_20_knots[2] == pytest.approx(weight * (7.0 / SPEED) ** 2 + 2.1e-5, rel=2e-3)


def test_it_rolls_in_27_8_s_at_20_knots_where_the_published_linear_ship_rolls_in_19_7_s():
    """Near the undamped limit 2 pi / sqrt(stiffness): low GM makes a slow roll."""
    models = (container.linearised(SPEED), container.published_linear(SPEED), container.published_linear(7.0))
    periods = [2 * np.pi / model.poles().imag.max() for model in models]
    np.testing.assert_allclose(periods, [27.8, 19.7, 29.0], atol=0.05)
    limits = [2 * np.pi / np.sqrt(-model.a[1, 3]) for model in models]
    np.testing.assert_allclose(periods, limits, rtol=0.05)


def test_the_rudder_acts_as_published_but_for_the_flow_of_the_race():
    """One factor, the speed of the flow at the rudder squared, joins all three: 1.16 of the published."""
    _, _, rudder = prime(container.linearised(SPEED))
    np.testing.assert_allclose(rudder / container.PUBLISHED_B, 1.16, rtol=0.02)


def test_the_printed_matrix_of_the_paper_is_not_this_ships():
    """C088: the roll is 1e4 stiffer than published at 7 m/s, sway by yaw and the rudder have the other sign."""
    theirs, ours = ship.PRINTED, container.published_linear(7.0)
    assert theirs.a[1, 3] / ours.a[1, 3] > 8e3
    assert theirs.a[0, 2] > 0 > ours.a[0, 2] and theirs.b[2] < 0 < ours.b[2]


def test_port_and_starboard_are_alike():
    rng = np.random.default_rng(3)
    for _ in range(20):
        state = container.straight(SPEED) + rng.normal(size=10) * [1, 0.5, 0.01, 9, 9, 1, 0.02, 0.2, 0.1, 0.1]
        one = container.rates(state, container.Orders(0.1, 1.5), container.Machinery())
        other = container.rates(state * MIRROR, container.Orders(-0.1, 1.5), container.Machinery())
        np.testing.assert_allclose(other, one * MIRROR, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("speed", [4.0, 7.0, SPEED])
def test_the_service_shaft_speed_holds_the_speed(speed: float):
    state = container.straight(speed)
    rates = container.rates(state, container.Orders(0.0, float(state[ship.N])), container.Machinery())
    assert abs(rates[ship.U]) < 1e-12 and rates[ship.X] == pytest.approx(speed)


def sailed(state: np.ndarray, orders: container.Orders, seconds: float, dt: float = 0.1) -> np.ndarray:
    track = [state]
    for _ in range(round(seconds / dt)):
        track.append(container.advance(track[-1], orders, dt))
    return np.array(track)


def test_a_positive_rudder_turns_to_starboard_heels_inward_first_then_outward_and_takes_speed():
    start = container.straight(SPEED)
    track = sailed(start, container.Orders(np.radians(10.0), float(start[ship.N])), 600.0)
    end = track[-1]
    assert end[ship.R] > 0 and end[ship.V] < 0 and track[:, ship.Y].max() > 100
    assert track[50:80, ship.PHI].max() > 0 > end[ship.PHI]
    assert np.hypot(end[ship.U], end[ship.V]) < 0.8 * SPEED
    # A steady turn is a circle: its radius is speed over the rate of the course.
    radius = np.hypot(end[ship.U], end[ship.V]) / (end[ship.R] * np.cos(end[ship.PHI]))
    last = track[-round(2 * np.pi / end[ship.R] / 0.1) :]
    assert np.ptp(last[:, ship.X]) / 2 == pytest.approx(radius, rel=0.02)
    assert np.ptp(last[:, ship.Y]) / 2 == pytest.approx(radius, rel=0.02)


def test_small_motion_is_the_linear_ships():
    """Forces are odd in sway, yaw and roll: what the linear ship lacks falls with the cube."""
    linear, errors = container.linearised(SPEED), []
    for size in (1e-2, 1e-3):
        start = container.straight(SPEED)
        start[ship.PHI] = size
        track = sailed(start, container.Orders(0.0, float(start[ship.N])), 60.0)
        x = ship.exact_step(linear, 60.0)(np.array([0, 0, 0, size, 0.0]), 0.0, 0.0)
        errors.append(np.abs(track[-1][list(ship.OF_LINEAR)] - x)[3] / size)
    assert errors[0] < 1e-2 and errors[1] < 1e-4


def test_released_from_a_heel_the_roll_decays():
    start = container.straight(SPEED)
    start[ship.PHI] = 0.1
    roll = np.abs(sailed(start, container.Orders(0.0, float(start[ship.N])), 120.0)[:, ship.PHI])
    peaks = roll[1:-1][(roll[1:-1] > roll[:-2]) & (roll[1:-1] > roll[2:])]
    assert len(peaks) >= 5 and (np.diff(np.r_[0.1, peaks]) < 0).all()


def test_a_step_is_of_fourth_order_and_right():
    start = container.straight(SPEED)
    start[ship.DELTA] = 0.05
    orders = container.Orders(0.08, float(start[ship.N]))
    gear = container.Machinery()
    true = solve_ivp(lambda t, y: container.rates(y, orders, gear), (0, 20), start, "DOP853", rtol=1e-12, atol=1e-13)
    scale = np.maximum(np.abs(true.y).max(axis=1), 1e-9)
    off = [(np.abs(sailed(start, orders, 20.0, dt)[-1] - true.y[:, -1]) / scale).max() for dt in (0.4, 0.2)]
    assert off[1] < 1e-6 and off[0] / off[1] == pytest.approx(16.0, rel=0.2)


def test_rudder_and_shaft_keep_their_limits():
    start = container.straight(SPEED)
    track = sailed(start, container.Orders(1.0, 9.0), 100.0)
    assert np.abs(np.diff(track[:, ship.DELTA])).max() / 0.1 <= np.radians(5.0) * (1 + 1e-9)
    assert track[:, ship.DELTA].max() <= np.radians(10.0) and track[:, ship.N].max() <= 160 / 60
    assert track[-1, ship.DELTA] == pytest.approx(np.radians(10.0)) and track[-1, ship.N] == pytest.approx(160 / 60)


def test_astern_or_adrift_is_refused():
    start = container.straight(SPEED)
    for place in (ship.U, ship.N):
        state = start.copy()
        state[place] = -1.0
        with pytest.raises(ValueError, match="ahead"):
            container.accelerations(state)
    with pytest.raises(ValueError, match="speed"):
        container.service_shaft_speed(0.0)
    with pytest.raises(ValueError, match="max_rudder"):
        container.Machinery(max_rudder=0.0)
