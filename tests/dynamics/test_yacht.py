"""The yacht: Nomoto's circle, heel of static stability, a surge that its power explains; whole circles."""

import numpy as np
import pytest

from raychan.dynamics import yacht
from raychan.dynamics.kalman import Disturbance, Noise, disturbance_covariance
from raychan.dynamics.ship import PHI, PSI, N, P, R, U, V, X, Y
from raychan.dynamics.steering import HeadingProgramme, SteeringGear, nomoto

SPEED = 6.0


def turned(rudder, seconds, dt=0.02):
    plant = yacht.plant(SPEED, dt, SteeringGear())
    state, track = yacht.straight(SPEED), []
    for _ in range(round(seconds / dt)):
        state = plant.advance(state, rudder)
        track.append(state)
    return np.array(track)


def test_a_steady_circle_is_as_wide_as_nomoto_says():
    track = turned(0.3, 120.0)[3000:]
    k, t = nomoto(yacht.linear(SPEED))
    assert (k, t) == (pytest.approx(SPEED / yacht.LENGTH), pytest.approx(yacht.LENGTH / SPEED))
    speed = np.hypot(track[-1, U], track[-1, V])
    assert track[-1, R] == pytest.approx(0.3 * k)
    assert np.ptp(track[:, X]) == pytest.approx(2.0 * speed / (0.3 * k), rel=1e-3)
    assert np.ptp(track[:, Y]) == pytest.approx(2.0 * speed / (0.3 * k), rel=1e-3)


def test_a_turn_to_starboard_heels_to_port_by_static_stability_and_drifts_about_the_pivot_point():
    state = turned(0.3, 60.0)[-1]
    arm, gm = yacht.HEEL_ARM, yacht.GM
    assert state[PHI] == pytest.approx(-SPEED * state[R] * arm / (yacht.GRAVITY * gm), rel=1e-6)
    assert state[P] == pytest.approx(0.0, abs=1e-9)
    assert state[V] + yacht.PIVOT * yacht.LENGTH * state[R] == pytest.approx(0.0, abs=1e-9)
    assert turned(-0.3, 60.0)[-1, PHI] == pytest.approx(-state[PHI])


def test_roll_has_the_period_of_its_metacentric_height():
    roll = yacht.linear(SPEED).poles()[np.abs(yacht.linear(SPEED).poles().imag) > 0.1][0]
    assert abs(roll) == pytest.approx(np.sqrt(yacht.GRAVITY * yacht.GM) / yacht.GYRADIUS)
    assert -roll.real / abs(roll) == pytest.approx(yacht.ROLL_DAMPING)


def test_speed_follows_the_shaft_with_the_lag_of_a_quadratic_drag():
    plant = yacht.plant(SPEED, 0.01, SteeringGear()).at_shaft(1.02 * yacht.shaft_speed(SPEED))
    state = yacht.straight(SPEED)
    for _ in range(100):
        state = plant.advance(state, 0.0)
    # By hand: m du/dt = D (held^2 - u^2) over one second, with D from the thrust power at top speed.
    drag = yacht.PROPULSION * yacht.POWER / yacht.TOP_SPEED**3
    u = SPEED
    for _ in range(10000):
        u += 1e-4 * drag * ((1.02 * SPEED) ** 2 - u * u) / yacht.MASS
    assert state[U] - SPEED == pytest.approx(u - SPEED, rel=0.02)
    assert state[N] == pytest.approx(1.02 * yacht.shaft_speed(SPEED))
    assert yacht.shaft_speed(yacht.TOP_SPEED) == pytest.approx(yacht.TOP_SHAFT)


def test_a_programme_with_a_rate_of_turn_runs_a_full_circle_and_one_without_steps():
    programme = HeadingProgramme(np.array([0.0, 10.0, 60.0]), np.array([0.0, 2.0 * np.pi, 2.5 * np.pi]), 0.2)
    wanted = [programme.at(t, np.zeros(2))[0] for t in (0.0, 10.0, 15.0, 41.4, 41.5, 60.0, 65.0, 99.0)]
    full = 2.0 * np.pi
    assert wanted == pytest.approx([0.0, 0.0, 1.0, 6.28, full, full, full + 1.0, 2.5 * np.pi])
    # A leg that is cut short goes on from where it was.
    cut = HeadingProgramme(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), 0.1)
    assert [cut.at(t, np.zeros(2))[0] for t in (2.0, 2.5, 3.0)] == pytest.approx([0.1, 0.05, 0.0])
    steps = HeadingProgramme(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    assert [steps.at(t, np.zeros(2))[0] for t in (0.5, 1.0)] == [0.0, 1.0]
    with pytest.raises(ValueError, match="rate"):
        HeadingProgramme(np.zeros(1), np.zeros(1), 0.0)


def test_a_drawn_disturbance_has_its_covariance():
    ship = yacht.linear(SPEED)
    noise = Noise(p=1.0, r=1.0, phi=1.0, psi=1.0, sway=0.1, roll=0.2, yaw=0.05)
    disturbance, rng = Disturbance.of(ship, noise, 0.5), np.random.default_rng(0)
    wanted = disturbance_covariance(ship, noise, 0.5)
    assert disturbance.root @ disturbance.root.T == pytest.approx(wanted, abs=1e-12)
    drawn = np.cov(np.array([disturbance.draw(rng) for _ in range(40000)]).T)
    size = np.sqrt(np.diag(wanted))
    assert drawn / np.outer(size, size) == pytest.approx(wanted / np.outer(size, size), abs=0.03)


def test_heading_north_is_along_x():
    straight = turned(0.0, 2.0)[-1]
    assert straight[X] == pytest.approx(2.0 * SPEED) and straight[Y] == 0.0 and straight[PSI] == 0.0
