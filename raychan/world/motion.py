"""Pose and motion of a body: constant velocity, constant turn rate about the vertical through its origin, and constant
spin about an axis of its own, as of a wheel or a rotor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.poses import rotation, yaw_pitch_roll

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Pose at time 0 and rates; the body's origin moves on a straight line.

    Args: position (3,) [m], yaw, pitch, roll [rad], velocity (3,) [m/s] world axes, turn_rate [rad/s] about world z
    (positive turns left), own_spin (3,) [rad/s] about the body's own axes.
    """

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_rate: float = 0.0
    own_spin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def origin(self, time: float = 0.0) -> Array:
        """Return the body's origin (3,) [m] at a time [s]."""
        return np.asarray(self.position, float) + time * np.asarray(self.velocity, float)

    def heading(self, time: float = 0.0) -> float:
        """Return the yaw [rad] at a time [s]."""
        return self.yaw + self.turn_rate * time

    def rotation(self, time: float = 0.0) -> Array:
        """Return the matrix (3, 3) from body to world axes at a time [s]."""
        turned = rotation(self.heading(time), self.pitch, self.roll)
        return turned @ about(time * np.asarray(self.own_spin)) if any(self.own_spin) else turned

    def spin(self, time: float = 0.0) -> Array:
        """Return the turn-rate vector (3,) [rad/s] about the origin, world axes, at a time [s]."""
        turn = np.array([0.0, 0.0, self.turn_rate])
        return turn + self.rotation(time) @ np.asarray(self.own_spin) if any(self.own_spin) else turn

    @property
    def moves(self) -> bool:
        """Whether it moves or turns."""
        return any(self.velocity) or self.turns

    @property
    def turns(self) -> bool:
        """Whether its velocity and its turn do not tell where its points are after some time."""
        return bool(self.spin().any())

    def poses(self, times: Array) -> tuple[Array, Array]:
        """Return rotations (t, 3, 3) to world axes and origins (t, 3) [m] at times (t,) [s]."""
        turns = np.array([self.rotation(t) for t in times]).reshape(-1, 3, 3)
        return turns, self.origin() + np.asarray(times)[:, None] * np.asarray(self.velocity)

    def velocity_of_origin(self, time: float = 0.0) -> Array:
        """Return the velocity (3,) [m/s] of the origin at a time [s]."""
        return np.asarray(self.velocity, float)

    def swerve(self, time: float) -> float:
        """Return how far [m] the origin is from even motion a time [s] before or after now; it never is."""
        return 0.0

    def at(self, time: float) -> Motion:
        """Return the same motion counted from a time [s]."""
        x, y, z = map(float, self.origin(time))
        if not any(self.own_spin):
            return replace(self, position=(x, y, z), yaw=self.heading(time))
        yaw, pitch, roll = yaw_pitch_roll(self.rotation(time))
        return replace(self, position=(x, y, z), yaw=yaw, pitch=pitch, roll=roll)

    def to_world(self, point: Array, time: float = 0.0) -> Array:
        """Return world coordinates (..., 3) of body points (..., 3)."""
        return np.asarray(point, float) @ self.rotation(time).T + self.origin(time)

    def to_body(self, point: Array, time: float = 0.0) -> Array:
        """Return body coordinates (..., 3) of world points (..., 3)."""
        return (np.asarray(point, float) - self.origin(time)) @ self.rotation(time)

    def velocity_at(self, point: Array, time: float = 0.0) -> Array:
        """Return the velocity (..., 3) [m/s] of the body's matter at world points (..., 3)."""
        arm = np.asarray(point, float) - self.origin(time)
        return self.velocity_of_origin(time) + np.cross(self.spin(time), arm)


def about(turn: Array) -> Array:
    """Return the matrix (3, 3) of a turn [rad] about the direction of a vector. Source: Rodrigues' formula."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
