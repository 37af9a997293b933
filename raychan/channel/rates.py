"""Range rates of routes, from the velocities of what they meet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.fields_along import heading, slot, vec
from raychan.compile.jit import njit
from raychan.records import Facets, Routes
from raychan.vectors import dot, less, row

Floats = NDArray[np.float64]


def rates(routes: Routes, facets: Facets, tx_velocity: Floats, rx_velocity: Floats) -> Floats:
    """Return range rates (n,) [m/s]: half the rate of each route's length, from the velocities of its vertices.

    A mirror that slides in its own plane has no effect: the length is stationary there (Fermat's principle).
    """
    return _rates(
        routes.tx, routes.rx, routes.vertices, routes.kind, routes.body, facets.velocity, facets.spin,
        facets.origin, np.asarray(tx_velocity, float), np.asarray(rx_velocity, float),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _rates(  # type: ignore[no-untyped-def]
    tx, rx, vertices, kind, body, velocity, spin, origin, tx_velocity, rx_velocity
):
    n, d = kind.shape
    out = np.empty(n)
    for i in range(n):
        x, v, total = vec(tx), vec(tx_velocity), 0.0
        for j in range(d + 1):
            last = j == d or kind[i, j] == 0
            y, w = vec(rx), vec(rx_velocity)
            if not last:
                y, w = slot(vertices, i, j), of_body(vertices, body, velocity, spin, origin, i, j)
            total += dot(less(w, v), heading(x, y))
            if last:
                break
            x, v = y, w
        out[i] = 0.5 * total
    return out


@njit(cache=True, nogil=True)
def of_body(vertices, body, velocity, spin, origin, i, j):  # type: ignore[no-untyped-def]
    """Return the velocity of the body at vertex j of route i."""
    b = max(body[i, j], 0)
    s, arm, u = row(spin, b), less(slot(vertices, i, j), row(origin, b)), row(velocity, b)
    return (
        u[0] + s[1] * arm[2] - s[2] * arm[1],
        u[1] + s[2] * arm[0] - s[0] * arm[2],
        u[2] + s[0] * arm[1] - s[1] * arm[0],
    )
