"""The Kalman filter of the ship's sensors: white innovations of the stated covariance, and steering by it."""

import numpy as np
import pytest

from raychan.dynamics import container, ship
from raychan.dynamics.kalman import MEASURED, Noise, disturbance_covariance, kalman_filter
from raychan.dynamics.steering import HeadingProgramme, lqr
from raychan.dynamics.voyage import ContainerPlant, Watch, sail

SPEED, DT = 20.0 * ship.KNOT, 0.5
MODEL = container.linearised(SPEED)
NOISE = Noise(p=1e-3, r=1e-3, phi=2e-3, psi=5e-3, sway=0.01, roll=1e-3, yaw=1e-4)


def disturbed(n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return true states, innovations and errors before the measurement (n, ...) of a ship under white disturbance."""
    filtered, root = kalman_filter(MODEL, NOISE, DT), np.linalg.cholesky(disturbance_covariance(MODEL, NOISE, DT))
    x, estimate = np.zeros(5), np.zeros(5)
    states, innovations, errors = np.empty((n, 5)), np.empty((n, 4)), np.empty((n, 5))
    for k in range(n):
        measured = NOISE.measure(x, rng)
        states[k], innovations[k], errors[k] = x, filtered.surprise(estimate, measured), x - estimate
        rudder = 0.05 * np.sin(0.02 * k), 0.05 * np.sin(0.02 * (k + 1))
        estimate = filtered.predict(filtered.update(estimate, measured), *rudder)
        x = filtered.step(x, *rudder) + root @ rng.standard_normal(5)
    return states, innovations, errors


def test_innovations_are_white_and_of_the_stated_covariance():
    n = 20000
    _, innovations, errors = disturbed(n + 200, np.random.default_rng(7))
    filtered = kalman_filter(MODEL, NOISE, DT)
    white = np.linalg.solve(np.linalg.cholesky(filtered.innovation), innovations[200:].T)
    # Of n white samples a covariance scatters by 1/sqrt(n); 4.5 of these in 16 x 31 figures are one in 300.
    assert np.abs(white @ white.T / n - np.eye(4)).max() < 4.5 * np.sqrt(2 / n)
    for lag in range(1, 31):
        assert np.abs(white[:, lag:] @ white[:, :-lag].T / n).max() < 4.5 / np.sqrt(n)
    spread = errors[200:].std(axis=0) / np.sqrt(np.diag(filtered.predicted))
    np.testing.assert_allclose(spread, 1.0, atol=0.1)


def test_the_steady_gain_is_the_limit_of_the_recursion():
    filtered = kalman_filter(MODEL, NOISE, DT)
    f, w, r = filtered.step.state, disturbance_covariance(MODEL, NOISE, DT), np.diag(NOISE.sensors**2)
    p = np.eye(5)
    for _ in range(5000):
        k = p @ MEASURED.T @ np.linalg.inv(MEASURED @ p @ MEASURED.T + r)
        p = f @ (np.eye(5) - k @ MEASURED) @ p @ f.T + w
    np.testing.assert_allclose(filtered.gain, k, rtol=1e-6, atol=1e-9)


def test_the_disturbance_of_two_short_steps_is_that_of_a_long_one():
    half, whole = (disturbance_covariance(MODEL, NOISE, t) for t in (0.25, 0.5))
    f = ship.exact_step(MODEL, 0.25).state
    np.testing.assert_allclose(f @ half @ f.T + half, whole, rtol=1e-9, atol=1e-18)


def test_the_filter_is_better_than_its_sensors_and_tells_the_sway_that_none_measures():
    states, _, errors = disturbed(5000, np.random.default_rng(8))
    assert (errors[200:, 1:].std(axis=0) < NOISE.sensors).all()
    assert errors[200:, 0].std() < 0.8 * states[200:, 0].std()


def test_lqg_steers_by_noisy_sensors_where_lqr_steers_by_the_truth():
    plant = ContainerPlant(shaft=container.service_shaft_speed(SPEED), dt=DT)
    course = HeadingProgramme(np.array([0.0]), np.array([0.3]))
    true = sail(plant, container.straight(SPEED), lqr(MODEL), course, 600.0)

    def noisy(seed: int):
        watch = Watch(kalman_filter(MODEL, NOISE, DT), NOISE), np.random.default_rng(seed)
        return sail(plant, container.straight(SPEED), lqr(MODEL), course, 600.0, watch)

    track = noisy(5)
    assert np.abs(track.state[:, ship.PSI] - true.state[:, ship.PSI]).max() < 0.02
    np.testing.assert_array_equal(track.state, noisy(5).state)
    assert (track.state != noisy(6).state).any()


def test_noise_must_be_positive():
    with pytest.raises(ValueError, match="positive"):
        Noise(p=0.0, r=1e-3, phi=1e-3, psi=1e-3, sway=1e-3, roll=1e-3, yaw=1e-3)


def test_a_heading_that_nothing_turns_has_no_steady_filter():
    with pytest.raises(ValueError, match="no steady state"):
        kalman_filter(ship.PRINTED, NOISE, DT)
