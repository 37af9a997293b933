"""Routes from a transmitter to a receiver elsewhere without any scatterer: line of sight, and over the ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR, REFLECT, TRANSMIT, Routes
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]


def direct_routes(geometry: Geometry, ways_in: list[Leg], rx: Floats, slots: int, layers: int) -> Routes | None:
    """Return the exact routes to a receiver at rx (3,) [m] over legs whose mirrors only reflect; None if there is none.

    Other surfaces reflect by their tubes. Args: slots for interactions; layers that the last stretch may pass.
    """
    body_role, rows = geometry.facets.role, []
    for leg in ways_in:
        if any(body_role[m.body] != MIRROR for m in leg.mirrors) or not leg.may_reach(rx[None], np.zeros(1))[0]:
            continue
        view = leg.visible(geometry, rx[None], np.array([-1], np.int32), np.full(1, 1e-6), layers)
        if not view.seen[0]:
            continue
        heading, length = leg.rays(rx[None])
        stops = [(spot, m.normal, m.facet, REFLECT) for spot, m in zip(view.corners[0], leg.mirrors, strict=True)]
        start = view.corners[0, -1] if leg.mirrors else leg.end
        through = []
        for facet in view.passed[0][view.passed[0] >= 0]:
            t = geometry.distance(np.array([facet]), start[None], heading)[0]
            through.append((float(t), (start + t * heading[0], geometry.normal[facet], int(facet), TRANSMIT)))
        stops += [stop for _, stop in sorted(through, key=lambda pair: pair[0])]
        rows.append((float(length[0]), stops))
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
    return Routes(
        tx=ways_in[0].end,
        rx=rx,
        far=False,
        vertices=vertices,
        normals=normals,
        facet=facet,
        body=np.where(facet >= 0, body, -1).astype(np.int16),
        kind=kind,
        scatter=np.full(n, -1, np.int8),
        points=np.zeros((n, 6, 3)),
        lengths=np.repeat(length[:, None], 6, axis=1),
        length=length,
        taper=np.ones((n, 3)),
        area=np.zeros(n),
        spread_in=1.0 / length,
        spread_out=np.ones(n),
        caustics=np.zeros(n, np.int8),
        sigma=np.zeros(n),
    )
