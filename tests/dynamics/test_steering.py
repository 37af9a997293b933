"""Autopilots, limits of the rudder and programmes, on the printed and on the container ship."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from raychan.dynamics import container, ship
from raychan.dynamics.steering import (
    PD,
    HeadingProgramme,
    StateFeedback,
    SteeringGear,
    WayPoints,
    lqr,
    nomoto,
    pd_by_poles,
    riccati,
    turn,
)
from raychan.dynamics.voyage import ContainerPlant, LinearPlant, sail

SPEED = 20.0 * ship.KNOT
EAST = HeadingProgramme(times=np.array([0.0]), headings=np.array([np.pi / 2]))


def printed_course_change(gear: SteeringGear):
    start = np.zeros(10)
    start[ship.U] = SPEED
    plant = LinearPlant(ship.exact_step(ship.CORRECTED, 0.05), gear)
    return sail(plant, start, StateFeedback(ship.PRINTED_GAIN), EAST, 200.0)


def test_the_printed_gain_turns_by_90_degrees_in_44_8_s_and_limits_lengthen_it():
    """C090: within 2 %; the rudder asked for at the start is 90 deg."""
    free = printed_course_change(SteeringGear())
    assert free.settling_time() == pytest.approx(44.8, abs=0.1)
    assert np.degrees(free.order[0]) == pytest.approx(-90.0)
    assert np.degrees(free.state[:, ship.PSI].max()) == pytest.approx(90.04, abs=0.01)
    angle = printed_course_change(SteeringGear(max_angle=np.radians(10.0)))
    both = printed_course_change(SteeringGear(max_angle=np.radians(10.0), max_rate=np.radians(5.0)))
    assert both.settling_time() > angle.settling_time() > free.settling_time() + 10
    assert (angle.settling_time(), both.settling_time()) == pytest.approx((60.5, 61.4), abs=0.1)
    assert np.degrees(np.abs(both.state[:, ship.DELTA])).max() <= 10.0 + 1e-9
    assert np.degrees(np.abs(np.diff(both.state[:, ship.DELTA]))).max() <= 5.0 * 0.05 + 1e-9


def test_lqr_on_the_published_container_ship_doubles_the_roll_damping():
    """C091: 20 knots, Q = I, R = 1."""
    model = container.published_linear(SPEED)
    feedback = lqr(model)
    np.testing.assert_allclose(feedback.gain, [-0.791, 2.245, 14.83, 0.594, 1.0], rtol=2e-3)

    def roll_damping(gain):
        poles = model.poles(gain)
        return ship.natural_frequency_and_damping(poles[np.argmax(poles.imag * (poles.imag > 0.2))])[1]

    assert roll_damping(None) == pytest.approx(0.04, abs=0.01)
    assert roll_damping(feedback.gain) == pytest.approx(0.08, abs=0.01)


def test_the_riccati_solution_solves_its_equation_and_costs_what_it_says():
    model, x = container.linearised(SPEED), np.array([0.0, 0.0, 0.0, 0.1, 0.5])
    s = riccati(model.a, model.b, np.eye(5), 1.0)
    residual = model.a.T @ s + s @ model.a - np.outer(s @ model.b, model.b @ s) + np.eye(5)
    assert np.abs(residual).max() < 1e-8 * np.abs(s).max()
    gain, dt, cost = lqr(model).gain, 0.05, 0.0
    closed = ship.exact_step(ship.LinearShip(model.a - np.outer(model.b, gain), np.zeros(5), SPEED), dt)
    y = x
    for _ in range(round(900 / dt)):
        after = closed(y, 0.0, 0.0)
        cost += 0.5 * dt * sum(z @ z + (gain @ z) ** 2 for z in (y, after))
        y = after
    assert cost == pytest.approx(x @ s @ x, rel=1e-4)


def test_any_other_gain_costs_more():
    """The cost is x'Px with P of the Lyapunov equation of a gain."""
    model, best = container.linearised(SPEED), lqr(container.linearised(SPEED)).gain

    def cost(gain):
        closed = model.a - np.outer(model.b, gain)
        return np.trace(solve_continuous_lyapunov(closed.T, -np.eye(5) - np.outer(gain, gain)))

    for k in range(5):
        for factor in (0.9, 1.1):
            other = best.copy()
            other[k] *= factor
            assert cost(other) > cost(best)


def test_the_nomoto_constants_are_those_of_a_slow_turn():
    """G(jw) against K / (1 + jwT), the error falling with the square of w."""
    for model in (ship.CORRECTED, container.linearised(SPEED)):
        k, t = nomoto(model)
        for w, within in ((1e-4, 3e-4), (1e-5, 3e-6)):
            x = np.linalg.solve(1j * w * np.eye(4) - model.a[:4, :4], model.b[:4].astype(complex))
            assert abs(x[2] / (k * (1 - 1j * w * t)) - 1) < within
    assert nomoto(ship.CORRECTED)[0] < 0 < nomoto(container.linearised(SPEED))[0]


def test_pd_by_poles_puts_the_poles_of_the_nomoto_loop():
    model = container.linearised(SPEED)
    (k, t), pd = nomoto(model), pd_by_poles(model, 0.03, 0.8)
    poles = np.roots([t, 1 + k * pd.kd, k * pd.kp])
    np.testing.assert_allclose(np.abs(poles), 0.03, rtol=1e-9)
    np.testing.assert_allclose(-poles.real / np.abs(poles), 0.8, rtol=1e-9)


@pytest.mark.parametrize("heading", [np.pi / 2, -np.pi / 2])
def test_pd_and_lqr_bring_the_container_ship_to_its_course_on_the_ordered_side(heading: float):
    model = container.linearised(SPEED)
    plant = ContainerPlant(shaft=container.service_shaft_speed(SPEED), dt=0.2)
    programme = HeadingProgramme(np.array([0.0]), np.array([heading]))
    for autopilot in (lqr(model), pd_by_poles(model, 0.03, 1.0)):
        track = sail(plant, container.straight(SPEED), autopilot, programme, 600.0)
        assert track.settling_time() < 450 and np.sign(track.order[0]) == np.sign(heading)
        assert np.sign(track.state[:, ship.PSI].sum()) == np.sign(heading)


def test_way_points_are_passed_and_the_last_leg_is_held():
    points = np.array([[0.0, 0.0], [3000.0, 0.0], [6000.0, 3000.0], [12000.0, 3000.0]])
    model = container.linearised(SPEED)
    plant = ContainerPlant(shaft=container.service_shaft_speed(SPEED), dt=0.5)
    course = WayPoints(points, acceptance=500.0, lookahead=700.0)
    track = sail(plant, container.straight(SPEED), pd_by_poles(model, 0.03, 1.0), course, 1300.0)
    for point in points[1:3]:
        assert np.hypot(*(track.position - point).T).min() < 500.0
    assert abs(track.position[-1, 1] - 3000.0) < 20.0 and track.position[-1, 0] > 11000


def test_line_of_sight_points_to_the_leg_one_lookahead_on():
    course = WayPoints(np.array([[0.0, 0.0], [1000.0, 0.0]]), acceptance=10.0, lookahead=100.0)
    assert course.at(0.0, np.array([50.0, 0.0]))[0] == 0.0
    assert course.at(0.0, np.array([50.0, 100.0]))[0] == pytest.approx(-np.pi / 4)
    assert course.at(0.0, np.array([50.0, -100.0]))[0] == pytest.approx(np.pi / 4)


def test_headings_turn_the_shorter_way():
    assert turn(np.radians(10), np.radians(350)) == pytest.approx(np.radians(20))
    assert turn(np.radians(350), np.radians(10)) == pytest.approx(np.radians(-20))
    assert turn(np.pi, 0.0) == pytest.approx(np.pi)
    assert PD(1.0, 0.0).order(np.zeros(5), 2 * np.pi + 0.1) == pytest.approx(0.1)


def test_a_heading_programme_changes_at_its_times():
    programme = HeadingProgramme(np.array([0.0, 10.0]), np.array([0.1, 0.2]))
    assert [programme.at(t, np.zeros(2))[0] for t in (0.0, 9.99, 10.0, 99.0)] == [0.1, 0.1, 0.2, 0.2]


def test_what_cannot_steer_is_refused():
    with pytest.raises(ValueError, match="grow"):
        HeadingProgramme(np.array([1.0]), np.array([0.1]))
    with pytest.raises(ValueError, match="two way-points"):
        WayPoints(np.zeros((2, 2)), 1.0, 1.0)
    with pytest.raises(ValueError, match="positive"):
        SteeringGear(max_rate=0.0)
    with pytest.raises(ValueError, match="negative"):
        lqr(ship.CORRECTED, weights=(-1.0, 1, 1, 1, 1))
    with pytest.raises(ValueError, match="singular"):
        nomoto(ship.LinearShip(np.zeros((5, 5)), np.ones(5), 1.0))
