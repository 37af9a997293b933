"""Poses and angles: right-handed world, x forward, y left, z up; boresight +x.

Azimuth is measured from +x towards +y, elevation from the horizontal plane towards +z.
V is theta-hat and H is phi-hat of the direction's spherical coordinates about +z.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotation(yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Array:
    """Return the matrix that turns body coordinates into world ones.

    Order Rz(yaw) Ry(pitch) Rx(roll), angles in radians; positive pitch lowers the nose (+x towards -z).
    """
    cy, sy, cp, sp, cr, sr = (f(a) for a in (yaw, pitch, roll) for f in (np.cos, np.sin))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def yaw_pitch_roll(matrix: Array) -> tuple[float, float, float]:
    """Return the angles [rad] of which `rotation` makes the matrix (3, 3); roll 0 where the nose is upright."""
    level = float(np.hypot(matrix[0, 0], matrix[1, 0]))
    pitch = float(np.arctan2(-matrix[2, 0], level))
    if level < 1e-9:
        return float(np.arctan2(-matrix[0, 1], matrix[1, 1])), pitch, 0.0
    return float(np.arctan2(matrix[1, 0], matrix[0, 0])), pitch, float(np.arctan2(matrix[2, 1], matrix[2, 2]))


def direction(azimuth: Any, elevation: Any = 0.0) -> Array:
    """Return unit vectors (..., 3) of azimuth and elevation [rad]."""
    az, el = np.broadcast_arrays(np.asarray(azimuth, float), np.asarray(elevation, float))
    return np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)


def sizes(vector: Array) -> Array:
    """Return the lengths (...) of vectors (..., 3); three times as fast as numpy's norm over an axis of three."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vector, vector)))


def angles(vector: Any) -> tuple[Array, Array]:
    """Return azimuth and elevation [rad] of vectors (..., 3) of any length."""
    v = np.asarray(vector, float)
    return np.arctan2(v[..., 1], v[..., 0]), np.arctan2(v[..., 2], np.hypot(v[..., 0], v[..., 1]))


def theta_phi(vector: Any) -> tuple[Array, Array]:
    """Return theta-hat (V) and phi-hat (H), each (..., 3), of directions (..., 3).

    At the poles azimuth is taken as zero.
    """
    v = np.asarray(vector, float)
    az, el = angles(v)
    theta = np.stack([np.sin(el) * np.cos(az), np.sin(el) * np.sin(az), -np.cos(el)], axis=-1)
    phi = np.stack([-np.sin(az), np.cos(az), np.zeros_like(az)], axis=-1)
    return theta, phi
