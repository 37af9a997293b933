"""Chains: the way from an end over plane mirrors to a place (numba loops).

Everywhere: images (m + 1, 3) [m] of the end, itself first (unit directions when far), at, normal (m, 3) of the mirrors'
planes, centre (m, 3) and radius (m,) [m] of the circles that hold them, the end's side first.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.kernels.jit import njit
from raychan.kernels.patch import length_to


@njit(cache=True, nogil=True, error_model="numpy")
def _possible(point, size, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Tell whether a ball could be met: in front of the last mirror, and by way of each mirror's circle."""
    m = len(at)
    if m == 0:
        return True
    height = 0.0
    for c in range(3):
        height += (point[c] - at[m - 1, c]) * normal[m - 1, c]
    if not height > -size:
        return False
    x, y, z = point[0], point[1], point[2]
    for i in range(m - 1, -1, -1):
        dx, dy, dz = images[i + 1, 0] - x, images[i + 1, 1] - y, images[i + 1, 2] - z
        over = (at[i, 0] - x) * normal[i, 0] + (at[i, 1] - y) * normal[i, 1] + (at[i, 2] - z) * normal[i, 2]
        t = over / (dx * normal[i, 0] + dy * normal[i, 1] + dz * normal[i, 2])
        if not math.isfinite(t):
            t = 0.0
        x, y, z = x + t * dx, y + t * dy, z + t * dz
        # A ray to the ball's rim meets a mirror nearer to the ray to its centre than the ball's radius.
        off = math.sqrt((x - centre[i, 0]) ** 2 + (y - centre[i, 1]) ** 2 + (z - centre[i, 2]) ** 2)
        if not off < radius[i] + size:
            return False
    return True


@njit(cache=True, nogil=True)
def possible(points, size, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Return which balls about points (n, 3) of radius size (n,) [m] could be met over the chain."""
    ok = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        ok[i] = _possible(points[i], size[i], images, at, normal, centre, radius)
    return ok


@njit(cache=True, nogil=True)
def may_leave(points, normals, far, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Return which tubes of corners and centre (n, 4, 3) could send something to the end: turned to it, and possible.

    Args: normals (n, 4, 3) of the surface they stand on.
    """
    ok = np.empty(len(points), np.bool_)
    image = images[len(at)]
    for i in range(len(points)):
        p, n = points[i, 3], normals[i, 3]
        towards = 0.0
        for c in range(3):
            towards += (-image[c] if far else p[c] - image[c]) * n[c]
        ok[i] = towards < 0.0
        if ok[i] and len(at):
            size = 0.0
            for q in range(3):
                size = max(size, length_to(points[i, q], p, False))
            ok[i] = _possible(p, size, images, at, normal, centre, radius)
    return ok
