"""A ship under way: plant, steering gear, autopilot and programme in a closed loop, with or without noisy sensors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from raychan.dynamics import container
from raychan.dynamics.kalman import KalmanFilter, Noise
from raychan.dynamics.ship import DELTA, OF_LINEAR, PSI, Array, ExactStep, X, Y, over_ground
from raychan.dynamics.steering import Autopilot, SteeringGear


class Plant(Protocol):
    """What carries a full state (10,) of `ship.STATE` over its time step `dt` [s] under an ordered rudder [rad]."""

    @property
    def dt(self) -> float: ...  # noqa: D102

    def advance(self, state: Array, order: float) -> Array: ...  # noqa: D102


class Programme(Protocol):
    """What wants a heading [rad], of time [s] and position (2,) [m]; returns also the programme as it goes on."""

    def at(self, time: float, position: Array) -> tuple[float, Programme]: ...  # noqa: D102


def steered(step: ExactStep, gear: SteeringGear, state: Array, order: float) -> Array:
    """Return the full state (10,) one exact step on in rudder, sway, roll and yaw; the rest of it as it was."""
    places = list(OF_LINEAR)
    after = state.copy()
    after[DELTA] = gear.toward(float(state[DELTA]), order, step.dt)
    after[places] = step(state[places], float(state[DELTA]), float(after[DELTA]))
    return after


@dataclass(frozen=True)
class LinearPlant:
    """A linear ship at constant surge speed, carried by exact steps; the rudder moves evenly within a step."""

    step: ExactStep
    gear: SteeringGear = field(default_factory=SteeringGear)

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self.step.dt

    def advance(self, state: Array, order: float) -> Array:
        """Return the full state (10,) one step on; the track by the mean of the velocities at both ends."""
        after = steered(self.step, self.gear, state, order)
        after[[X, Y]] += 0.5 * self.dt * (over_ground(state) + over_ground(after))
        return after


@dataclass(frozen=True)
class ContainerPlant:
    """The container ship at an ordered shaft speed [rev/s], by Runge-Kutta steps of `dt` [s]."""

    shaft: float
    dt: float
    machinery: container.Machinery = field(default_factory=container.Machinery)

    def advance(self, state: Array, order: float) -> Array:
        """Return the full state (10,) one step on."""
        return container.advance(state, container.Orders(delta=order, n=self.shaft), self.dt, self.machinery)

    def at_shaft(self, shaft: float) -> ContainerPlant:
        """Return the plant at another shaft speed [rev/s]. Raises: ValueError where the model does not hold."""
        if not 0.0 < shaft <= self.machinery.max_shaft:
            raise ValueError(f"shaft speed {shaft} rev/s; allowed: above 0 and at most {self.machinery.max_shaft:.4g}")
        return replace(self, shaft=shaft)


@dataclass(frozen=True)
class Watch:
    """How the autopilot learns the state: sensors with `noise` through the `filter`, started at the true state."""

    filter: KalmanFilter
    noise: Noise


@dataclass(frozen=True)
class Track:
    """What a voyage was: `time` (n,) [s], `state` (n, 10) of `ship.STATE`, `order` (n,) and `wanted` (n,) [rad].

    `estimate` (n, 5): what the autopilot took as (v, p, r, phi, psi).
    """

    time: Array
    state: Array
    order: Array
    wanted: Array
    estimate: Array

    @property
    def position(self) -> Array:
        """Position (n, 2) [m], north and east."""
        return self.state[:, [X, Y]]

    def settling_time(self, share: float = 0.02) -> float:
        """Return when [s] the heading enters the last wanted one for good, within a share of the whole change.

        Infinite if it has not at the end. The change is the shorter turn.
        """
        off = np.abs((self.state[:, PSI] - self.wanted[-1] + np.pi) % (2.0 * np.pi) - np.pi)
        out = np.flatnonzero(off > share * off[0])
        if len(out) == 0:
            return 0.0
        return float(self.time[out[-1] + 1]) if out[-1] + 1 < len(off) else float("inf")


def sail(
    plant: Plant,
    start: Array,
    autopilot: Autopilot,
    programme: Programme,
    duration: float,
    watch: tuple[Watch, np.random.Generator] | None = None,
) -> Track:
    """Return the track of a ship from a full state (10,) over `duration` [s].

    Without `watch` the autopilot knows the true state; with it, what the filter makes of noisy sensors (LQG). The
    filter's rudder is the true one: a steering gear reports its angle.
    """
    n = round(duration / plant.dt) + 1
    places = list(OF_LINEAR)
    state, order, wanted, estimate = np.empty((n, 10)), np.empty(n), np.empty(n), np.empty((n, 5))
    now, guess = np.array(start, float), np.array(start, float)[places]
    for k in range(n):
        state[k] = now
        if watch is None:
            guess = now[places]
        else:
            guess = watch[0].filter.update(guess, watch[0].noise.measure(now[places], watch[1]))
        wanted[k], programme = programme.at(k * plant.dt, now[[X, Y]])
        estimate[k], order[k] = guess, autopilot.order(guess, wanted[k])
        now = plant.advance(now, order[k])
        if watch is not None:
            guess = watch[0].filter.predict(guess, float(state[k, DELTA]), float(now[DELTA]))
    return Track(time=np.arange(n, dtype=float) * plant.dt, state=state, order=order, wanted=wanted, estimate=estimate)
