"""Currents beyond the horizon: they radiate through the body on which they flow, to where their ray leaves it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MOST = 64  # facets met within overlapping bodies before a ray is dropped; not measured


def exit_points(geometry: Geometry, leg: Leg, points: Floats, facet: Ints) -> tuple[Floats, Ints]:
    """Return points (n, 3) [m] and facets (n,), moved along the ray to the end to where it leaves the bodies, for rays
    that enter them.

    A closed body does not hide its own currents: in physical optics they radiate in free space (Ufimtsev 2014, ch. 1).
    What stands behind its other side hides them as it hides all else.
    """
    d, length = leg.rays(points)
    inward = np.einsum("ij,ij->i", d, geometry.normal[facet]) > 0.0
    rows = np.flatnonzero(geometry.closed_opaque[facet] & inward)
    points, facet = points.copy(), facet.copy()
    way, far = -d[rows], np.full(len(rows), np.inf) if leg.far else length[rows]
    skip, start, depth = facet[rows], np.zeros(len(rows)), np.ones(len(rows), int)
    for _ in range(_MOST):
        if not len(rows):
            break
        hit, t = geometry.cast(points[rows], way, skip, start)
        met = (hit >= 0) & (t < far)
        leaves = np.einsum("ij,ij->i", way, geometry.normal[hit]) > 0.0
        depth += np.where(met & geometry.closed_opaque[hit], np.where(leaves, -1, 1), 0)
        out = met & (depth <= 0)
        points[rows[out]] += t[out, None] * way[out]
        facet[rows[out]] = hit[out]
        on = met & ~out
        start = np.where(on, t + geometry.touch, 0.0)[on]
        rows, way, far, skip, depth = rows[on], way[on], far[on], skip[on], depth[on]
    return points, facet
