"""The two ways of a wave between ends that stand apart: from the transmitter, and from the receiver.

Rays are followed from one end, and the currents on the last surface radiate to the other: over several surfaces that is
not reciprocal, and the mean of both ways is. What both ways have alike is traced once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import Routes
from raychan.tracing.images import Images
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry


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

    def counted(self, geometry: Geometry, leg: Leg, routes: Routes, depth: int) -> Routes:
        """Return routes of tubes, which scatter at bounce `depth`, from the transmitter to the receiver, by half where
        the other way has routes of its own for them."""
        if self.alone:
            return routes
        rows = np.arange(len(routes.kind))
        half = (depth > 1) | self.images.one_way(geometry, leg, routes.facet[rows, routes.scatter])
        counted = replace(routes, area=np.where(half, 0.5, 1.0) * routes.area)
        return turned_round(counted) if self.back else counted


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
