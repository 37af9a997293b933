"""Collect: tubes on their last surface, and their way out, become Routes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.legs import Leg
from raychan.channel.surface import Surface
from raychan.channel.tubes import CENTRE, Tubes, middles, vector_area
from raychan.frames import sizes
from raychan.kernels.footprint import tapers
from raychan.tables import REFLECT, SCATTER, TRANSMIT, Routes

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def routes_of(surface: Surface, leg: Leg, out: Leg, tubes: Tubes, first: bool, corners: Floats, passed: Ints) -> Routes:
    """Return the routes of tubes that scatter on their present footprint and leave over `out`.

    Args: first whether this is their first surface; corners (n, m, 3) mirror points of the way out, receiver's side
    first; passed (n, l) layers on its last stretch.
    """
    n = len(tubes)
    end = np.asarray(out.end, float)
    back_k, back = out.rays(tubes.points)
    middle, half_way = middles(surface, leg, tubes, first)
    bent = surface.curved[tubes.facet] if first else np.zeros(n, bool)
    lit = tubes.points, tubes.k, tubes.length, tubes.normals, back_k, back, out.far
    shape = tubes.facet, tubes.bary, bent, surface.normal[tubes.facet], surface.facets.vertices, surface.bulge
    lengths = np.concatenate([tubes.length[:, :3] + back[:, :3], half_way + out.rays(middle)[1]], axis=1)
    vertices, normals, facets, kinds = tubes.history.tables(tubes.last, tubes.slots)
    if not first:
        _retrace(surface, tubes, vertices, normals, facets, kinds)
    every = np.arange(n)
    slots = tubes.slots.copy()

    def append(rows: NDArray[np.signedinteger], vertex: Floats, normal: Floats, facet: Ints, kind: int) -> None:
        at = rows, slots[rows]
        vertices[at], normals[at], facets[at], kinds[at] = vertex, normal, facet, kind
        slots[rows] += 1

    append(every, tubes.points[:, CENTRE], tubes.normals[:, CENTRE], tubes.facet, SCATTER)
    for j in range(passed.shape[1] - 1, -1, -1):
        rows = np.flatnonzero(passed[:, j] >= 0)
        facet = passed[rows, j]
        p, k = tubes.points[rows, CENTRE], -back_k[rows, CENTRE]
        t = surface.distance(facet, p, k)
        append(rows, p + t[:, None] * k, surface.normal[facet], facet, TRANSMIT)
    for i in range(len(out.mirrors) - 1, -1, -1):
        m = out.mirrors[i]
        append(every, corners[:, i], m.normal, np.full(n, m.facet, np.int32), REFLECT)
    vertices[kinds == 0] = 0.0 if out.far else end
    body = surface.facets.body[np.maximum(facets, 0)] if n else np.zeros_like(facets)
    return Routes(
        tx=np.asarray(leg.end, float),
        rx=end,
        far=out.far,
        vertices=vertices,
        normals=normals,
        facet=facets,
        body=np.where(facets >= 0, body, -1).astype(np.int16),
        kind=kinds,
        scatter=tubes.slots.copy(),
        points=np.concatenate([tubes.points[:, :3], middle], axis=1),
        lengths=lengths,
        length=tubes.length[:, CENTRE] + back[:, CENTRE],
        taper=tapers(*(*lit, *shape)),
        area=sizes(vector_area(tubes.points)),
        spread_in=tubes.spread,
        spread_out=out.spread(back[:, CENTRE]),
        caustics=tubes.caustics,
        sigma=np.zeros(n),
    )


def _retrace(
    surface: Surface, tubes: Tubes, vertices: Floats, normals: Floats, facets: Ints, kinds: NDArray[np.int8]
) -> None:
    """Put vertices (n, d, 3) of the history under the centre ray as it is now, after cuts: backwards over the plane
    mirrors."""
    point, k = tubes.points[:, CENTRE].copy(), tubes.k[:, CENTRE].copy()
    for back in range(int(tubes.slots.max(initial=0))):
        slot = tubes.slots - 1 - back
        rows = np.flatnonzero((slot >= 0) & tubes.flat)
        at = slot[rows]
        facet, normal = facets[rows, at], normals[rows, at]
        t = surface.distance(facet, point[rows], -k[rows])
        point[rows] -= np.where(np.isfinite(t), t, 0.0)[:, None] * k[rows]
        vertices[rows, at] = point[rows]
        turn = 2.0 * np.einsum("ij,ij->i", k[rows], normal) * (kinds[rows, at] == REFLECT)
        k[rows] -= turn[:, None] * normal
