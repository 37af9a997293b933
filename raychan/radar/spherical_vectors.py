"""Fields along theta-hat and phi-hat as vectors, and the pattern of a patch (numba loops)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit


@njit(cache=True, nogil=True)
def cosine_power(direction, over_y, over_z):  # type: ignore[no-untyped-def]
    """Return x^p (n,) of unit directions (n, 3), 0 behind.

    p goes from `over_y` in the plane z = 0 to `over_z` in y = 0, as the square of the cosine of the angle about x.
    """
    out = np.empty(len(direction))
    for i in range(len(direction)):
        y2, z2 = direction[i, 1] ** 2, direction[i, 2] ** 2
        off = y2 + z2
        out[i] = max(direction[i, 0], 0.0) ** ((over_y * y2 + over_z * z2) / off if off > 0.0 else over_y)
    return out


@njit(cache=True, nogil=True)
def turned(vector, axes):  # type: ignore[no-untyped-def]
    """Return vectors (n, 3) in a frame of axes (3, 3), its columns."""
    out = np.empty((len(vector), 3))
    for i in range(len(vector)):
        for c in range(3):
            out[i, c] = vector[i, 0] * axes[0, c] + vector[i, 1] * axes[1, c] + vector[i, 2] * axes[2, c]
    return out


@njit(cache=True, nogil=True)
def vectors(field, direction, axes):  # type: ignore[no-untyped-def]
    """Return fields (n, 3), world axes, of their parts (n, 2) along theta-hat and phi-hat of directions (n, 3).

    Directions are in a frame of axes (3, 3), its columns; at the poles azimuth is zero, as in `poses.theta_phi`.
    """
    out = np.empty((len(field), 3), np.complex128)
    for i in range(len(field)):
        x, y, z = direction[i, 0], direction[i, 1], direction[i, 2]
        level = math.sqrt(x * x + y * y)
        size = math.sqrt(level * level + z * z)
        cosine, sine = (x / level, y / level) if level > 0.0 else (1.0, 0.0)
        up, flat = (z / size, level / size) if size > 0.0 else (0.0, 1.0)
        theta, phi = field[i, 0], field[i, 1]
        along_x = theta * (up * cosine) - phi * sine
        along_y = theta * (up * sine) + phi * cosine
        along_z = theta * -flat
        for c in range(3):
            out[i, c] = along_x * axes[c, 0] + along_y * axes[c, 1] + along_z * axes[c, 2]
    return out
