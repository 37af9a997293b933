"""Beam: the field of an antenna from a table over elevation and azimuth (numba loops).

Everywhere: table (s + 1, 2 s + 1) of fields at elevations -90 to 90 deg and azimuths -180 to 180 deg; look: unit
directions.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit


@njit(cache=True, forceinline=True, uncounted=True)
def field_towards(look, table):  # type: ignore[no-untyped-def]
    """Return the table's value in a direction (3,), linear in both angles."""
    steps = table.shape[0] - 1
    up = (math.asin(min(max(look[2], -1.0), 1.0)) / math.pi + 0.5) * steps
    round_ = (math.atan2(look[1], look[0]) / math.pi + 1.0) * steps
    a, b = min(int(up), steps - 1), min(int(round_), 2 * steps - 1)
    x, y = up - a, round_ - b
    low = (1.0 - y) * table[a, b] + y * table[a, b + 1]
    high = (1.0 - y) * table[a + 1, b] + y * table[a + 1, b + 1]
    return (1.0 - x) * low + x * high


@njit(cache=True, nogil=True)
def fields_towards(look, table):  # type: ignore[no-untyped-def]
    """Return the table's value (n,) in each direction (n, 3)."""
    out = np.empty(len(look))
    for i in range(len(look)):
        out[i] = field_towards(look[i], table)
    return out
