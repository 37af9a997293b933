"""Routes that need no tubes: to the ground's foot points and back, and straight to a receiver elsewhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR, REFLECT, Routes
from raychan.tracing.legs import Leg, Stop
from raychan.tracing.routes import Interactions, ray_routes
from raychan.tracing.tubes import Refinement
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]


def foot_points(geometry: Geometry, legs: list[Leg], rule: Refinement) -> Routes | None:
    """Return the exact routes to the ground's foot points and back: a plane mirror too large for tubes."""
    f, direct, rows = geometry.facets, legs[0], list[tuple[float, list[Stop]]]()
    for leg in legs:
        if len(leg.mirrors) != 1 or f.role[leg.mirrors[0].body] != MIRROR:
            continue
        m = leg.mirrors[0]
        height = float((leg.end - m.point) @ m.normal)
        foot = leg.end - height * m.normal
        view = direct.visible(geometry, foot[None], np.array([m.facet], np.int32), np.full(1, 1e-6), rule.layers)
        if view.seen[0]:
            down = direct.stops(geometry, view, 0, foot)
            rows.append((2.0 * height, [*down, (foot, m.normal, m.facet, int(REFLECT)), *down[::-1]]))
    return _specular(geometry, direct.end, direct.end, rows, rule.slots)


def direct_routes(geometry: Geometry, legs: list[Leg], rx: Floats, slots: int, layers: int) -> Routes | None:
    """Return the exact routes to a receiver elsewhere, at rx (3,) [m], over legs whose mirrors only reflect: line of
    sight, and over the ground; None if there is none.

    Other surfaces reflect by their tubes. Args: slots for interactions; layers that each stretch may pass.
    """
    body_role, rows = geometry.facets.role, []
    for leg in legs:
        if any(body_role[m.body] != MIRROR for m in leg.mirrors) or not leg.may_reach(rx[None], np.zeros(1))[0]:
            continue
        view = leg.visible(geometry, rx[None], np.array([-1], np.int32), np.full(1, 1e-6), layers)
        if not view.seen[0]:
            continue
        rows.append((float(leg.rays(rx[None])[1][0]), leg.stops(geometry, view, 0, rx)))
    return _specular(geometry, legs[0].end, rx, rows, slots)


def _specular(
    geometry: Geometry, tx: Floats, rx: Floats, rows: list[tuple[float, list[Stop]]], slots: int
) -> Routes | None:
    """Return the routes of single rays from tx to rx (3,) [m], of such lengths [m] and stops; None if there is none.

    Args: slots for interactions.
    """
    if not rows:
        return None
    n = len(rows)
    vertices, normals = np.broadcast_to(rx, (n, slots, 3)).copy(), np.zeros((n, slots, 3))
    facet, kind = np.full((n, slots), -1, np.int32), np.zeros((n, slots), np.int8)
    for i, (_, stops) in enumerate(rows):
        for j, stop in enumerate(stops):
            vertices[i, j], normals[i, j], facet[i, j], kind[i, j] = stop
    body = geometry.facets.body[np.maximum(facet, 0)] if len(geometry.facets.body) else facet
    length = np.array([r[0] for r in rows])
    met = Interactions(vertices, normals, facet, np.where(facet >= 0, body, -1).astype(np.int16), kind)
    return ray_routes(tx, rx, met, length)
