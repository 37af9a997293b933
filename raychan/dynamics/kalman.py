"""The steady Kalman filter of a ship's noisy sensors, and the LQG autopilot: LQR on the filter's estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from raychan.dynamics.ship import Array, ExactStep, LinearShip, exact_step
from raychan.dynamics.steering import turn

MEASURED = np.array(
    [[0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.0], [0, 0, 0, 0, 1.0]]
)
"""Sensors (p, r, phi, psi) of the state (v, p, r, phi, psi): gyros, inclinometer, compass; none for sway."""
MEASURED.setflags(write=False)
_DECAY = 1e-8  # of an error a step, at least: less is rounding of a double eigenvalue at one


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the sensors and strength of what disturbs the ship.

    Sensors: `p`, `r` [rad/s], `phi`, `psi` [rad] of one sample. Disturbance, white accelerations: `sway` [m/s^2 per
    sqrt(Hz)], `roll`, `yaw` [rad/s^2 per sqrt(Hz)].
    """

    p: float
    r: float
    phi: float
    psi: float
    sway: float
    roll: float
    yaw: float

    def __post_init__(self) -> None:
        if not min(self.p, self.r, self.phi, self.psi, self.sway, self.roll, self.yaw) > 0.0:
            raise ValueError("every standard deviation must be positive")

    @property
    def sensors(self) -> Array:
        """Standard deviations (4,) of the sensors (p, r, phi, psi)."""
        return np.array([self.p, self.r, self.phi, self.psi])

    def measure(self, state: Array, rng: np.random.Generator) -> Array:
        """Return a noisy measurement (4,) of the state (5,)."""
        return np.asarray(MEASURED @ state + self.sensors * rng.standard_normal(4))


def disturbance_covariance(ship: LinearShip, noise: Noise, dt: float) -> Array:
    """Return the covariance (5, 5) that white accelerations add to the state over `dt` [s].

    Source: Van Loan 1978, IEEE Transactions on Automatic Control 23, 395-404, equation 2.1.
    """
    whole = np.zeros((10, 10))
    whole[:5, :5] = -ship.a * dt
    whole[:5, 5:] = np.diag([noise.sway**2, noise.roll**2, noise.yaw**2, 0.0, 0.0]) * dt
    whole[5:, 5:] = ship.a.T * dt
    grown = expm(whole)
    covariance = grown[5:, 5:].T @ grown[:5, 5:]
    return np.asarray(0.5 * (covariance + covariance.T))


@dataclass(frozen=True)
class Disturbance:
    """What white accelerations add to (v, p, r, phi, psi) over a time step: `root` (5, 5) of its covariance."""

    root: Array

    @classmethod
    def of(cls, ship: LinearShip, noise: Noise, dt: float) -> Disturbance:
        """Return the disturbance of a ship over steps of `dt` [s]."""
        values, vectors = np.linalg.eigh(disturbance_covariance(ship, noise, dt))
        return cls(root=vectors * np.sqrt(np.maximum(values, 0.0)))

    def draw(self, rng: np.random.Generator) -> Array:
        """Return one addition (5,) to the state."""
        return np.asarray(self.root @ rng.standard_normal(5))


@dataclass(frozen=True)
class KalmanFilter:
    """The steady filter of a linear ship at one time step.

    Arrays: `gain` (5, 4); `predicted` (5, 5) covariance before a measurement; `innovation` (4, 4) covariance of what a
    measurement adds; `step` carries the estimate over `dt`.
    Source: Anderson and Moore, Optimal Filtering, 1979, section 4.4.
    """

    step: ExactStep
    gain: Array
    predicted: Array
    innovation: Array

    def surprise(self, estimate: Array, measured: Array) -> Array:
        """Return the innovation (4,): measured less predicted, its heading by the shorter turn."""
        off = measured - MEASURED @ estimate
        off[3] = turn(float(measured[3]), float(estimate[4]))
        return np.asarray(off)

    def update(self, estimate: Array, measured: Array) -> Array:
        """Return the estimate (5,) after a measurement (4,)."""
        return np.asarray(estimate + self.gain @ self.surprise(estimate, measured))

    def predict(self, estimate: Array, before: float, after: float) -> Array:
        """Return the estimate (5,) one step on, for the rudder [rad] before and after."""
        return self.step(estimate, before, after)


def kalman_filter(ship: LinearShip, noise: Noise, dt: float) -> KalmanFilter:
    """Return the steady filter for measurements every `dt` [s].

    Raises: ValueError for a ship whose states the sensors do not tell (a heading that nothing disturbs or turns).
    """
    step = exact_step(ship, dt)
    sensed = np.diag(noise.sensors**2)
    lost = "the filter has no steady state: something neither decays nor is disturbed"
    try:
        predicted = solve_discrete_are(step.state.T, MEASURED.T, disturbance_covariance(ship, noise, dt), sensed)
    except np.linalg.LinAlgError as error:
        raise ValueError(lost) from error
    innovation = MEASURED @ predicted @ MEASURED.T + sensed
    gain = np.linalg.solve(innovation, MEASURED @ predicted).T
    # Not every build of LAPACK notices: a filter that keeps an error for ever is none.
    kept = np.abs(np.linalg.eigvals(step.state @ (np.eye(len(gain)) - gain @ MEASURED))).max()
    if not kept < 1.0 - _DECAY:
        raise ValueError(lost)
    return KalmanFilter(step=step, gain=gain, predicted=predicted, innovation=innovation)
