"""Where a body is and how it moves: constant velocity, constant turn about the vertical through its own origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.frames import rotation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Pose at time 0 and rates; the body's origin moves on a straight line.

    Args: position (3,) [m], yaw, pitch, roll [rad], velocity (3,) [m/s] world axes, turn_rate [rad/s] about world z
    (positive turns left).
    """

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_rate: float = 0.0

    def origin(self, time: float = 0.0) -> Array:
        """Return the body's origin (3,) [m] at a time [s]."""
        return np.asarray(self.position, float) + time * np.asarray(self.velocity, float)

    def heading(self, time: float = 0.0) -> float:
        """Return the yaw [rad] at a time [s]."""
        return self.yaw + self.turn_rate * time

    def rotation(self, time: float = 0.0) -> Array:
        """Return the matrix (3, 3) from body to world axes at a time [s]."""
        return rotation(self.heading(time), self.pitch, self.roll)

    @property
    def spin(self) -> Array:
        """Turn-rate vector (3,) [rad/s] about the origin."""
        return np.array([0.0, 0.0, self.turn_rate])

    def to_world(self, point: Array, time: float = 0.0) -> Array:
        """Return world coordinates (..., 3) of body points (..., 3)."""
        return np.asarray(point, float) @ self.rotation(time).T + self.origin(time)

    def to_body(self, point: Array, time: float = 0.0) -> Array:
        """Return body coordinates (..., 3) of world points (..., 3)."""
        return (np.asarray(point, float) - self.origin(time)) @ self.rotation(time)

    def velocity_at(self, point: Array, time: float = 0.0) -> Array:
        """Return the velocity (..., 3) [m/s] of the body's matter at world points (..., 3)."""
        return np.asarray(self.velocity, float) + np.cross(self.spin, np.asarray(point, float) - self.origin(time))
