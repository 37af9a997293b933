"""Spherical waves at the elements of an array (numba loops)."""

from __future__ import annotations

import math

from raychan.compile.jit import njit


@njit(cache=True, nogil=True, error_model="numpy")
def lengthen(radius, look, offset, longer, factor):  # type: ignore[no-untyped-def]
    """Add to `longer` (n,) [m] how much longer the way to spherical waves' sources is from `offset` (3,) [m] than from
    0, and multiply `factor` (n,) by how much stronger the waves are there.

    Args: radius (n,) [m] and unit directions look (n, 3) of the sources as seen from 0. The way is |radius look -
    offset| - radius, without the difference of two large numbers; -look @ offset longer in the far field.
    """
    square = offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2
    for i in range(len(radius)):
        along = look[i, 0] * offset[0] + look[i, 1] * offset[1] + look[i, 2] * offset[2]
        far = math.sqrt(max(radius[i] * (radius[i] - 2.0 * along) + square, 0.0)) + radius[i]
        # A source at the phase centre itself is as far as the offset is long.
        more = (square - 2.0 * radius[i] * along) / far if far > 0.0 else 0.0
        longer[i] += more
        if radius[i] + more > 0.0:
            factor[i] *= radius[i] / (radius[i] + more)


@njit(cache=True, nogil=True, error_model="numpy")
def quicken(radius, look, drift, offset, faster):  # type: ignore[no-untyped-def]
    """Add to `faster` (n,) [m/s] by how much faster the way to spherical waves' sources grows from `offset` (3,) [m]
    than from 0. Args: as for `lengthen`; drift (n, 3) [m/s] of the sources."""
    for i in range(len(radius)):
        x, y, z = (
            radius[i] * look[i, 0] - offset[0],
            radius[i] * look[i, 1] - offset[1],
            radius[i] * look[i, 2] - offset[2],
        )
        far = math.sqrt(x * x + y * y + z * z)
        if far > 0.0:
            faster[i] += drift[i, 0] * (x / far - look[i, 0])
            faster[i] += drift[i, 1] * (y / far - look[i, 1])
            faster[i] += drift[i, 2] * (z / far - look[i, 2])
