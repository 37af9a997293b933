"""Occluders: large plane walls, and spheres inside solid bodies, that hide from a leg all that lies behind them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.poses import sizes
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_LEAST_AREA = 0.25  # m^2 of a wall: trades clusters culled for tests of each; not measured
_MOST = 24  # walls, and spheres, tested over one leg; not measured
_OUTSIDE = 1.001  # of a sphere's radius: an end nearer to its centre does not look at it from outside
_MOST_EDGES = 64  # around one wall; not measured


class HidingWalls(NamedTuple):
    """Walls before a leg: point (w, 3) [m], normal (w, 3) towards the leg, body (w,); the edges edge[first[i] :
    first[i + 1]] (e, 3) [m] around wall i, a point of each, and normals inward (e, 3) of the planes through these and
    the leg's image; and by how much, touch [m], a thing must lie behind all of these."""

    point: Floats
    normal: Floats
    body: Ints
    first: NDArray[np.int64]
    edge: Floats
    inward: Floats
    touch: float


class HidingSpheres(NamedTuple):
    """Spheres inside closed opaque bodies: centre (k, 3) [m], radius (k,) [m], body (k,)."""

    centre: Floats
    radius: Floats
    body: Ints


class Occluders:
    """The large opaque planes of a geometry with the edges around them, and the spheres inside closed opaque bodies."""

    def __init__(self, geometry: Geometry) -> None:
        f = geometry.facets
        area = geometry.wall_area
        # A plane has no edges around it where two facets lie back to back: a closed body without thickness.
        edges = geometry.scene_topology.edges_around
        large = (area >= _LEAST_AREA) & (edges > 0) & (edges <= _MOST_EDGES)
        if len(f.role) < 2:
            # A wall hides other bodies only: how far its own body's curved surface lies before its facets is unknown.
            large[:] = False
        rows = np.flatnonzero(large[geometry.plane])
        rows = rows[np.argsort(geometry.plane[rows], kind="stable")]
        numbers, lead = np.unique(geometry.plane[rows], return_index=True)
        half = (3 * rows[:, None] + np.arange(3)).ravel()
        half = half[geometry.scene_topology.borders[half]]
        self.touch = 1e-4 + geometry.touch
        self.area, self.edge = area[numbers], geometry.ends(half)
        self.first = np.searchsorted(geometry.plane[half // 3], np.append(numbers, len(area)))
        none = np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int32)
        self.spheres = geometry.inner_spheres if len(f.role) > 1 else none
        self.point, self.normal, self.owner = (
            geometry.first[rows[lead]],
            geometry.normal[rows[lead]],
            f.body[rows[lead]],
        )

    def walls_over(self, leg: Leg) -> HidingWalls:
        """Return the walls that hide most over a leg."""
        image = np.asarray(leg.image, float)
        height = self.normal @ image if leg.far else np.einsum("ij,ij->i", image - self.point, self.normal)
        away = np.ones(len(height)) if leg.far else np.linalg.norm(image - self.point, axis=1)
        view = self.area * np.abs(height) / away**3
        if leg.mirrors and len(view):
            m = leg.mirrors[-1]
            over = self.edge.reshape(-1, 3) @ m.normal - m.point @ m.normal
            view = np.where(np.minimum.reduceat(over, 2 * self.first[:-1]) > self.touch, view, 0.0)
        pick = np.argsort(-view, kind="stable")[:_MOST]
        pick = pick[view[pick] > 0.0]
        count = np.diff(self.first)[pick]
        first = np.concatenate([[0], np.cumsum(count)])
        edge = np.repeat(self.first[pick] - first[:-1], count) + np.arange(first[-1])
        a, b = self.edge[edge, 0], self.edge[edge, 1]
        side = np.repeat(np.sign(height[pick]), count)
        p, q = (image[None], b - a) if leg.far else (b - image, a - image)
        # The cross product of p and q; numpy's own takes as long as all else here.
        inward = p[:, [1, 2, 0]] * q[:, [2, 0, 1]] - p[:, [2, 0, 1]] * q[:, [1, 2, 0]]
        size = np.linalg.norm(inward, axis=1, keepdims=True)
        inward *= side[:, None] / np.where(size > 0.0, size, 1.0)
        normal = self.normal[pick] * np.sign(height[pick])[:, None]
        # Columns picked from an array lie one after the other; kernels are compiled for rows.
        inward = np.ascontiguousarray(inward)
        return HidingWalls(self.point[pick], normal, self.owner[pick], first, a, inward, self.touch)

    def spheres_over(self, leg: Leg) -> HidingSpheres:
        """Return the spheres that hide most over a leg."""
        centre, radius, owner = self.spheres
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
        return HidingSpheres(centre[pick], radius[pick], owner[pick])
