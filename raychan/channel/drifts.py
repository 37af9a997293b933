"""How the sources of waves move as an array sees them: what makes range rates differ from element to element."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.fields_along import heading, slot, vec
from raychan.channel.rates import of_body
from raychan.compile.jit import njit
from raychan.radar.array import reach
from raychan.records import DIFFUSE, POINT, REFLECT, SCATTER, Facets, Routes
from raychan.vectors import dot, less

Floats = NDArray[np.float64]


def drifts(routes: Routes, facets: Facets, radar: Any, tx_velocity: Floats, rx_velocity: Floats) -> Floats:
    """Return the velocities (n, 2, 3) [m/s] of the last scatterer's image over the mirrors on the way to transmitter
    and receiver, relative to these; without a scatterer, of the other end's image. No ends (n, 0, 3) where all
    elements of a radar stand at the phase centres, or nothing moves."""
    moving = (facets.velocity, facets.spin, tx_velocity, rx_velocity)
    if not any(reach(radar)) or not any(np.any(x) for x in moving):
        return np.zeros((len(routes.kind), 0, 3))
    return source_velocities(routes, facets, tx_velocity, rx_velocity)


def source_velocities(routes: Routes, facets: Facets, tx_velocity: Floats, rx_velocity: Floats) -> Floats:
    """Return the velocities (n, 2, 3) [m/s] of the same, whatever stands where."""
    ends = routes.tx, routes.rx, np.asarray(tx_velocity, float), np.asarray(rx_velocity, float)
    out = np.zeros((len(routes.kind), 2, 3))
    _drifts(routes.vertices, routes.kind, routes.body, facets.velocity, facets.spin, facets.origin, *ends, out)
    return out


@njit(cache=True, nogil=True)
def _drifts(vertices, kind, body, velocity, spin, origin, tx, rx, tx_velocity, rx_velocity, out):  # type: ignore[no-untyped-def]
    n, slots = kind.shape
    for i in range(n):
        used = slots
        at = -1
        for j in range(slots - 1, -1, -1):
            if kind[i, j] == 0:
                used = j
            elif kind[i, j] == SCATTER or kind[i, j] == POINT or kind[i, j] == DIFFUSE:
                at = j
        for end in range(2):
            # From the source to the end, over the mirrors between them.
            step = 1 if end == 1 else -1
            stop = used if end == 1 else -1
            here, there = (vec(tx), vec(rx)) if end == 1 else (vec(rx), vec(tx))
            v, own = (vec(tx_velocity), vec(rx_velocity)) if end == 1 else (vec(rx_velocity), vec(tx_velocity))
            j = 0 if end == 1 else used - 1
            if at >= 0:
                here, v, j = slot(vertices, i, at), of_body(vertices, body, velocity, spin, origin, i, at), at + step
            while j != stop:
                y = slot(vertices, i, j)
                if kind[i, j] == REFLECT:
                    z = there if j + step == stop else slot(vertices, i, j + step)
                    v = _mirrored(v, of_body(vertices, body, velocity, spin, origin, i, j), here, y, z)
                here = y
                j += step
            for k in range(3):
                out[i, end, k] = v[k] - own[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _mirrored(v, u, x, y, z):  # type: ignore[no-untyped-def]
    """Return the velocity of the image of what moves by v, over a mirror that moves by u: of a ray from x over y to z,
    whose change of direction is along the mirror's normal."""
    m = less(heading(x, y), heading(y, z))
    size = dot(m, m)
    s = 2.0 * dot(less(v, u), m) / size if size > 0.0 else 0.0
    return v[0] - s * m[0], v[1] - s * m[1], v[2] - s * m[2]
