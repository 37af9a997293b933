"""Mirrors: planes that reflect, and what holds each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]

_EDGES = 64  # longest edges of a plane along which its rectangle may lie; not measured


@dataclass(frozen=True, eq=False)
class Mirror:
    """A plane that reflects: a point on it [m], its unit normal towards the lit side, one of its facets, its body, and
    what holds all of it: a circle (centre [m], radius [m]), and a rectangle from low (2,) to high (2,) [m] along axes
    (2, 3) in the plane."""

    point: Floats
    normal: Floats
    facet: int
    body: int
    centre: Floats
    radius: float
    low: Floats
    high: Floats
    axes: Floats

    @staticmethod
    def of(geometry: Geometry, facet: int, side: float) -> Mirror:
        """Return the mirror of the plane of a facet, lit on its outward side (+1) or from behind (-1)."""
        v = geometry.facets.vertices[geometry.plane == geometry.plane[facet]].reshape(-1, 3)
        centre = 0.5 * (v.min(axis=0) + v.max(axis=0))
        radius = float(np.linalg.norm(v - centre, axis=1).max())
        body, normal = int(geometry.facets.body[facet]), geometry.normal[facet]
        return Mirror(geometry.first[facet], side * normal, facet, body, centre, radius, *_rectangle(v, normal))

    def turned(self) -> Mirror:
        """Return the same plane lit from its other side."""
        return replace(self, normal=-self.normal)

    @cached_property
    def corners(self) -> Floats:
        """Corners (4, 3) [m] of the rectangle, one after the other around it."""
        foot, ends = self.point - (self.axes @ self.point) @ self.axes, np.array([self.low, self.high])
        return np.asarray(
            foot + ends[[0, 1, 1, 0], 0, None] * self.axes[0] + ends[[0, 0, 1, 1], 1, None] * self.axes[1]
        )

    def image(self, x: Floats) -> Floats:
        """Return x mirrored at the plane."""
        return x - 2.0 * np.dot(x - self.point, self.normal) * self.normal


def _rectangle(corners: Floats, normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the ends low (2,), high (2,) [m] and axes (2, 3) of the smallest rectangle about triangles of a plane, of
    corners (3 k, 3) [m], that lies along one of their edges."""
    of = corners.reshape(-1, 3, 3)
    edges = (np.roll(of, -1, axis=1) - of).reshape(-1, 3)
    length = np.linalg.norm(edges, axis=1)
    along = edges[np.argsort(-length, kind="stable")[:_EDGES]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    axes = np.stack([along, np.cross(normal, along)], axis=1)
    low, high = ((axes @ corners.T).min(axis=2), (axes @ corners.T).max(axis=2))
    best = int(np.argmin((high - low).prod(axis=1)))
    return low[best], high[best], axes[best]
