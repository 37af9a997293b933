"""The horizon: which currents on a tube's last surface radiate to an end, whether the surface faces it or not (numba
kernel)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

FACING, OBLIQUE, LIT = 0, 1, 2
"""Which tubes radiate: those that face the end; also those whose reflected wave reaches beyond the horizon; all that
are lit."""


@njit(cache=True, nogil=True)
def radiating(points, k, normals, image, far, which):  # type: ignore[no-untyped-def]
    """Return what share of the obliquity cos_i of tubes (n,) is left towards an end, 0 where they do not radiate, and
    whether they face it.

    Args: points, k, normals (n, 4, 3) of arriving tubes, the centre last; image (3,) [m] of the end, or the direction
    to it when far; which of FACING, OBLIQUE, LIT. The reflected wave's obliquity is (cos_i + r . n) / 2 towards r: it
    goes on beyond the horizon r . n = 0 and ends where it changes its sign (Ufimtsev 2014, ch. 1).
    """
    share, facing = np.empty(len(points)), np.empty(len(points), np.bool_)
    for i in range(len(points)):
        size, towards, cosine = 0.0, 0.0, 0.0
        for c in range(3):
            d = image[c] if far else image[c] - points[i, 3, c]
            size += d * d
            towards += d * normals[i, 3, c]
            cosine -= k[i, 3, c] * normals[i, 3, c]
        towards /= math.sqrt(size)
        facing[i] = towards > 0.0
        if facing[i] or which == LIT:
            share[i] = 1.0
        else:
            left = 0.5 * (cosine + towards) if which == OBLIQUE else 0.0
            share[i] = left / cosine if left > 0.0 else 0.0
    return share, facing
