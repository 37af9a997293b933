"""Collision avoidance by what a scanner meets: the heading nearest to the wanted one whose path keeps its distance.

The paths of many headings are predicted with the linear ship, its autopilot and its steering gear; echoes are kept for
a while, since a scanner that looks ahead loses what it passes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from raychan.dynamics.ship import DELTA, OF_LINEAR, Array, ExactStep, LinearShip, U, X, Y, exact_step
from raychan.dynamics.steering import SteeringGear, frozen

_CELL = 1.0  # echoes in one square of this side [m] count once: bounds what a choice costs (not measured)
_MARGIN = 1.5  # added to the distance [m]: half a cell's diagonal, and what the prediction errs
_ABOVE = 1.0  # echoes lower than this above the water [m] are taken for the sea's: 0.5 deg of roll at 80 m is 0.7 m
_MEMORY = 40.0  # seconds that an echo is kept; longer costs time, shorter forgets what is astern of the fan
_STEP = 0.4  # of the prediction [s]
_REACH = 100.0  # length [m] of a predicted path: a little more than a scanner's range
_OFFSETS = np.radians(np.array([0.0, *(side * a for a in range(5, 125, 5) for side in (1, -1))]))
"""Turns from the wanted heading that are tried [rad]."""
_STAY = 0.3  # weight of a change of the chosen heading against a turn from the wanted one: 0 swings from side to side


@dataclass(frozen=True)
class Prediction:
    """How a ship answers a heading: its `step`, the autopilot's `gain` (5,), the steering `gear`."""

    step: ExactStep
    gain: Array
    gear: SteeringGear

    @classmethod
    def of(cls, ship: LinearShip, gain: Array, gear: SteeringGear) -> Prediction:
        """Return the prediction for a ship about its straight course."""
        return cls(step=exact_step(ship, _STEP), gain=frozen(gain, (5,), "gain"), gear=gear)

    def paths(self, state: Array, headings: Array) -> Array:
        """Return the places (m, k, 2) [m] north and east, step by step, of a full state (10,) that takes one of the
        headings (m,) [rad]."""
        count = len(headings)
        x = np.tile(state[list(OF_LINEAR)], (count, 1))
        rudder, place = np.full(count, state[DELTA]), np.tile(state[[X, Y]], (count, 1))
        speed, dt = max(float(state[U]), 0.1), self.step.dt
        out = np.empty((count, max(2, int(_REACH / (speed * dt))), 2))
        velocity = _velocities(x, speed)
        for k in range(out.shape[1]):
            off = (headings - x[:, 4] + np.pi) % (2.0 * np.pi) - np.pi
            order = np.clip(self.gain[4] * off - x[:, :4] @ self.gain[:4], -self.gear.max_angle, self.gear.max_angle)
            reach = self.gear.max_rate * dt
            after = rudder + np.clip(order - rudder, -reach, reach)
            x = x @ self.step.state.T + np.outer(rudder, self.step.rudder) + np.outer(after - rudder, self.step.motion)
            before, rudder, velocity = velocity, after, _velocities(x, speed)
            place = place + 0.5 * dt * (before + velocity)
            out[:, k] = place
        return out


def _velocities(x: Array, speed: float) -> Array:
    """Return the velocities (m, 2) [m/s] to north and east of linear states (m, 5) at a surge speed [m/s]."""
    c, s, across = np.cos(x[:, 4]), np.sin(x[:, 4]), x[:, 0] * np.cos(x[:, 3])
    return np.stack([speed * c - across * s, speed * s + across * c], axis=1)


class Lookout:
    """Keeps echoes, and chooses headings that stay `distance` [m] away from each, of the ship's midpoint."""

    def __init__(self, prediction: Prediction, distance: float) -> None:
        self._prediction, self.distance = prediction, distance
        self._seen: dict[tuple[int, int], float] = {}
        self._chosen: float | None = None

    def see(self, points: Array, time: float) -> None:
        """Take echoes (n, 3) [m] north, east, up, at a time [s]; those of the water are left out."""
        high = points[points[:, 2] > _ABOVE]
        for cell in np.unique(np.floor(high[:, :2] / _CELL).astype(int), axis=0):
            self._seen[int(cell[0]), int(cell[1])] = time

    def echoes(self, position: Array, time: float) -> Array:
        """Return the echoes (n, 2) [m] that are still kept and within reach of a position (2,)."""
        self._seen = {cell: when for cell, when in self._seen.items() if time - when <= _MEMORY}
        cells = (np.array(list(self._seen), float).reshape(-1, 2) + 0.5) * _CELL
        near = np.hypot(*(cells - position).T) < _REACH + self.distance
        return np.asarray(cells[near])

    def heading(self, state: Array, wanted: float, time: float) -> float:
        """Return the heading [rad] to take at a full state (10,), for one that is wanted [rad]."""
        echoes = self.echoes(state[[X, Y]], time)
        if not len(echoes):
            self._chosen = None
            return wanted
        headings = wanted + _OFFSETS
        paths = self._prediction.paths(state, headings)
        nearest = np.sqrt(
            ((paths[:, :, None, 0] - echoes[:, 0]) ** 2 + (paths[:, :, None, 1] - echoes[:, 1]) ** 2).min(axis=(1, 2))
        )
        short = np.maximum(self.distance + _MARGIN - nearest, 0.0)
        last = wanted if self._chosen is None else self._chosen
        change = np.abs((headings - last + np.pi) % (2.0 * np.pi) - np.pi)
        # A metre too near outweighs any turn.
        best = int(np.argmin(10.0 * short + np.abs(_OFFSETS) + _STAY * change))
        self._chosen = float(headings[best])
        return self._chosen
