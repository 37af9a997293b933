"""Collect: tubes on their last surface, and their way out, become Routes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.records import Routes
from raychan.tracing.footprints import footprints
from raychan.tracing.legs import Leg
from raychan.tracing.replay import chains, way_back
from raychan.tracing.tubes import Tubes, middles
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def routes_of(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, first: bool, corners: Floats, passed: Ints
) -> Routes:
    """Return the routes of tubes that scatter on their present footprint and leave over `out`.

    Args: first whether this is their first surface; corners (n, m, 3) mirror points of the way out, receiver's side
    first; passed (n, l) layers on its last stretch. Chains are as long as the longest.
    """
    n, m, f = len(tubes), len(out.mirrors), geometry.facets
    end = np.asarray(out.end, float)
    middle, half_way = middles(geometry, leg, tubes, first)
    slots = int((tubes.slots + (passed >= 0).sum(axis=1)).max(initial=0)) + 1 + m
    vertices, normals = np.empty((2, n, slots, 3))
    facet, body = np.empty((n, slots), np.int32), np.empty((n, slots), np.int16)
    kind = np.empty((n, slots), np.int8)
    points, lengths, taper = np.empty((n, 6, 3)), np.empty((n, 6)), np.empty((n, 3))
    length, area, way_out = np.empty((3, n))
    planes = geometry.first, geometry.normal, f.body
    mirrors = np.array([x.normal for x in out.mirrors]).reshape(m, 3), np.array([x.facet for x in out.mirrors], int)
    shape = geometry.normal, f.vertices, geometry.edge_curvature, geometry.curved
    # Far off, nothing is said of where unused slots are.
    fill = np.zeros(3) if out.far else end

    def some(at: slice) -> None:
        chains(
            tuple(getattr(tubes, x)[at] for x in ("points", "k", "normals", "facet", "last", "slots", "flat")),
            tubes.history.rows, not first, planes, corners[at], mirrors, passed[at], out.image, out.far, fill,
            tuple(x[at] for x in (vertices, normals, facet, body, kind)),
        )  # fmt: skip
        footprints(
            tuple(getattr(tubes, x)[at] for x in ("points", "k", "normals", "length", "facet", "bary")), middle[at],
            half_way[at], shape, out.image, out.far,
            tuple(x[at] for x in (points, lengths, length, taper, area, way_out)),
        )  # fmt: skip

    parallel_for(n, some)
    return Routes(
        tx=np.asarray(leg.end, float),
        rx=end,
        far=out.far,
        vertices=vertices,
        normals=normals,
        facet=facet,
        body=body,
        kind=kind,
        scatter=tubes.slots.copy(),
        points=points,
        lengths=lengths,
        length=length,
        taper=taper,
        area=area,
        spread_in=tubes.spread,
        spread_out=out.spread(way_out),
        caustics=tubes.caustics,
        sigma=np.zeros(n),
    )


def same_way_back(tubes: Tubes, mirrors: int, layers: int) -> tuple[Floats, Ints]:
    """Return the mirror points (n, m, 3) and the layers (n, l) on the way out of first-bounce tubes over the leg they
    came by, from their history."""
    corners = np.zeros((len(tubes), mirrors, 3))
    passed = np.empty((len(tubes), layers), np.int32)
    way_back(tubes.last, tubes.slots, tubes.history.rows, mirrors, corners, passed)
    return corners, passed
