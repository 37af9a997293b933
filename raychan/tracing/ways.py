"""The two ways of a wave between ends that stand apart: from the transmitter, and from the receiver.

Rays are followed from one end, and the currents on the last surface radiate to the other: over several surfaces, and on
those that only one end lights, that is not reciprocal, and the mean of both ways is. What both ways have alike, first
surfaces that both ends light, is traced once, from the transmitter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import Routes
from raychan.tracing.images import Images
from raychan.tracing.legs import Leg
from raychan.tracing.subdivide import clipped
from raychan.tracing.tubes import CENTRE, Tubes
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Way:
    """A way that rays are followed: over one of `legs`, and at last over one of `outs`.

    Fields: images of them; back whether it leads from the receiver to the transmitter; alone whether there is no other.
    """

    legs: list[Leg]
    outs: list[Leg]
    images: Images
    back: bool
    alone: bool

    @staticmethod
    def between(geometry: Geometry, legs: list[Leg], outs: list[Leg], both: bool) -> list[Way]:
        """Return the way over legs from the transmitter to those of the receiver, and the other one if both count."""
        forth = Way(legs, outs, Images.of(geometry, legs, outs), back=False, alone=not both)
        return [forth, Way(outs, legs, Images.of(geometry, outs, legs), back=True, alone=False)] if both else [forth]

    def may_have(self, geometry: Geometry, leg: Leg, outs: list[Leg], lit: Ints, only: Bools | None) -> Bools:
        """Tell on which facets (f,), of those (n,) that a leg may light and `only` (f,), first surfaces may lie that,
        seen over one of `outs`, the other way has not."""
        facet = lit if only is None else lit[only[lit]]
        found, side = self.images.one_way(geometry, leg, facet), _side(geometry, leg, facet)
        for out in outs:
            seen = _side(geometry, out, facet)
            found |= np.where(geometry.both_sides[facet], side * seen, seen) < 1
        every = np.zeros(len(geometry.plane), bool)
        every[facet[found]] = True
        return every

    def of_first_surface(self, geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes) -> Tubes:
        """Return the tubes, on their first surface, that this way has over a leg out, clipped at its horizon."""
        tubes = clipped(geometry, leg, tubes, _height(out, tubes.points[:, :CENTRE], tubes.normals[:, :CENTRE]))
        if not self.back:
            return tubes
        own = _height(out, tubes.points[:, CENTRE], tubes.normals[:, CENTRE]) <= 0.0
        return tubes.only(np.flatnonzero(own | self.images.one_way(geometry, leg, tubes.facet)))

    def counted(self, geometry: Geometry, leg: Leg, out: Leg, routes: Routes, depth: int) -> Routes:
        """Return routes of tubes, which scatter at bounce `depth`, from the transmitter to the receiver, by half where
        the other way has routes of its own for them."""
        if self.alone:
            return routes
        rows = np.arange(len(routes.kind))
        half = (depth > 1) | self.images.one_way(geometry, leg, routes.facet[rows, routes.scatter])
        half |= _height(out, routes.vertices[rows, routes.scatter], routes.normals[rows, routes.scatter]) <= 0.0
        counted = replace(routes, area=np.where(half, 0.5, 1.0) * routes.area)
        return turned_round(counted) if self.back else counted


def _height(out: Leg, points: Floats, normals: Floats) -> Floats:
    """Return how high [m] the end of a leg out stands above surfaces at points (..., 3) [m] with normals (..., 3)."""
    height: Floats = np.einsum("...i,...i->...", out.image - points, normals)
    return height


def _side(geometry: Geometry, leg: Leg, facet: Ints) -> NDArray[np.int8]:
    """Return 1 for each facet (n,) all of whose curved surface faces the end of a leg, -1 where all turns away, 0 where
    that is not sure (as `geometry.lit_parts` does)."""
    f = geometry.facets
    normals, bent = f.normals[facet], geometry.edge_curvature[facet]
    height = np.einsum("nic,njc->nij", normals, leg.image - f.vertices[facet])
    # Of a patch's three products l_i l_j the sum is at most 1/3.
    swell = np.abs(np.einsum("nic,njc->nij", normals, bent)).max(axis=2) / 3.0
    low, high = height.min(axis=2) - swell, height.max(axis=2) + swell
    return (low > 0.0).all(axis=1).astype(np.int8) - (high < 0.0).all(axis=1).astype(np.int8)


def turned_round(routes: Routes) -> Routes:
    """Return routes of tubes with their ends exchanged."""
    used, slot = (routes.kind > 0).sum(axis=1)[:, None], np.arange(routes.kind.shape[1])
    order = np.where(slot < used, used - 1 - slot, slot)

    def by(column: NDArray[Any]) -> NDArray[Any]:
        at = order if column.ndim == 2 else order[..., None]
        return np.ascontiguousarray(np.take_along_axis(column, at, axis=1))

    vertices = by(routes.vertices)
    vertices[slot >= used] = routes.tx
    scatter = np.where(routes.scatter >= 0, used[:, 0] - 1 - routes.scatter, -1)
    columns: dict[str, Any] = {name: by(getattr(routes, name)) for name in ("normals", "facet", "body", "kind")}
    return replace(
        routes, tx=routes.rx, rx=routes.tx, vertices=vertices, scatter=scatter.astype(np.int8),
        spread_in=routes.spread_out, spread_out=routes.spread_in, **columns,
    )  # fmt: skip
