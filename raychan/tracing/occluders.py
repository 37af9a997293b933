"""Screens: plane walls and solid bodies of a scene that hide from a leg all that stands behind them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.poses import sizes
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_LEAST_AREA = 0.25  # m^2
_MOST = 24  # over one leg
_OUTSIDE = 1.001  # of a ball's radius: an end nearer to its centre does not look at it from outside
_MOST_EDGES = 64  # around one


class Occluders:
    """The large opaque planes of a surface with the edges around them, in the facets' own sense, and the balls inside
    closed opaque bodies."""

    def __init__(self, geometry: Geometry) -> None:
        f = geometry.facets
        area = geometry.wall_area
        large = (area >= _LEAST_AREA) & (geometry.scene_topology.around <= _MOST_EDGES)
        if len(f.role) < 2:
            # A body hides others only: how far its own surface may lie before its facets is not known here.
            large[:] = False
        rows = np.flatnonzero(large[geometry.plane])
        rows = rows[np.argsort(geometry.plane[rows], kind="stable")]
        numbers, lead = np.unique(geometry.plane[rows], return_index=True)
        half = (3 * rows[:, None] + np.arange(3)).ravel()
        half = half[geometry.scene_topology.borders[half]]
        self.touch = 1e-4 + geometry.touch
        self.area, self.edge = area[numbers], geometry.ends(half)
        self.first = np.searchsorted(geometry.plane[half // 3], np.append(numbers, len(area)))
        self.balls = (
            geometry.inner_spheres if len(f.role) > 1 else (np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int32))
        )
        self.point, self.normal, self.owner = (
            geometry.first[rows[lead]],
            geometry.normal[rows[lead]],
            f.body[rows[lead]],
        )

    def over(self, leg: Leg) -> tuple[Any, ...]:
        """Return the walls that hide most over a leg: point (w, 3), normal (w, 3) towards the leg, body (w,), the first
        of its edges (w + 1,), a point on each edge (e, 3), normal inward (e, 3) of the plane through it and the leg's
        image, and how far [m] behind these a thing must lie."""
        image = np.asarray(leg.image, float)
        height = self.normal @ image if leg.far else np.einsum("ij,ij->i", image - self.point, self.normal)
        away = np.ones(len(height)) if leg.far else np.linalg.norm(image - self.point, axis=1)
        view = self.area * np.abs(height) / away**3
        if leg.mirrors:
            m = leg.mirrors[-1]
            over = (self.edge - m.point) @ m.normal > self.touch
            behind = np.add.reduceat(~over.all(axis=1), self.first[:-1]) if len(view) else view
            view = np.where(behind, 0.0, view)
        pick = np.argsort(-view, kind="stable")[:_MOST]
        pick = pick[view[pick] > 0.0]
        count = np.diff(self.first)[pick]
        edge = np.concatenate([np.zeros(0, int), *(np.arange(self.first[w], self.first[w + 1]) for w in pick)])
        a, b = self.edge[edge, 0], self.edge[edge, 1]
        side = np.repeat(np.sign(height[pick]), count)
        inward = np.cross(image, b - a) if leg.far else np.cross(b - image, a - image)
        size = np.linalg.norm(inward, axis=1, keepdims=True)
        inward *= side[:, None] / np.where(size > 0.0, size, 1.0)
        first = np.concatenate([[0], np.cumsum(count)])
        normal = self.normal[pick] * np.sign(height[pick])[:, None]
        return self.point[pick], normal, self.owner[pick], first, a, inward, self.touch

    def within(self, leg: Leg) -> tuple[Floats, Floats, Ints]:
        """Return the balls that hide most over a leg: centre (k, 3) [m], radius (k,) [m], body (k,)."""
        centre, radius, owner = self.balls
        image = np.asarray(leg.image, float)
        view = radius
        if not leg.far:
            away = np.maximum(sizes(centre - image), 1e-300)
            view = np.where(away > _OUTSIDE * radius, radius / away, 0.0)
        if leg.mirrors:
            m = leg.mirrors[-1]
            # The last stretch begins at the mirror.
            view = np.where((centre - m.point) @ m.normal > radius + self.touch, view, 0.0)
        pick = np.argsort(-view, kind="stable")[:_MOST]
        pick = pick[view[pick] > 0.0]
        return centre[pick], radius[pick], owner[pick]
