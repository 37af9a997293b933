"""Tubes whose echoes the radar tells apart by range rate: none of them hides another's in a preview."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.radar.radar import Radar
from raychan.tracing.tubes import CENTRE, Tubes
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_CELLS = 4.0  # of rate: within so many a window smears a strong echo over a weak one; not measured
# Cells of rate by which the corners of a tube may differ: of 143 echoes of 60 lone walkers 131 or 132 are found with
# 0.25, 0.5 and 1, 124 without; 0.25 takes 10 % more CPU than 0.5 (no command).
_SPREAD = 0.5
# Strips of one rate each across what turns fastest, at most: a disc of 1 m at 10 turns a second takes 0.05 s of CPU,
# with 128 0.11, with any number 4.5 s (no command).
_STRIPS = 64
_MOST = 16  # classes of rate: with as many as there are cells hardly anything is pruned (not measured)


@dataclass(frozen=True)
class RateClasses:
    """Classes of range rate of a scene as a radar sees it: those `width` [m/s] wide from `least` [m/s] on; ends, their
    places [m] and velocities [m/s]; `spread` [m/s] by which rates of the corners of a tube may differ; `longest` [m],
    more than any two-way path of the scene."""

    geometry: Geometry
    ends: list[tuple[Floats, Floats]]
    spread: float
    width: float
    least: float
    longest: float

    @staticmethod
    def of(geometry: Geometry, radar: Radar, cell: float) -> RateClasses:
        """Return the classes of a scene's bodies, for range cells [m]."""
        ends = [(np.asarray(radar.position, float), np.asarray(radar.velocity, float))]
        if radar.rx_position is not None:
            moves = radar.velocity if radar.rx_velocity is None else radar.rx_velocity
            ends.append((np.asarray(radar.rx_position, float), np.asarray(moves, float)))
        f, (middle, radius, _) = geometry.facets, geometry.body_spheres
        arm = np.linalg.norm(middle - f.origin, axis=1) + radius
        turning = np.linalg.norm(f.spin, axis=1) * arm
        fastest, far = 0.0, 0.0
        for place, velocity in ends:
            moving = np.linalg.norm(f.velocity - velocity, axis=1) + turning
            fastest = max(fastest, float(moving.max(initial=0.0)))
            far = max(far, float((np.linalg.norm(middle - place, axis=1) + radius).max(initial=0.0)))
        told = radar.channel_waveform.rate_resolution
        width = max(_CELLS * told, 2.0 * fastest / _MOST, 1e-9)
        # Over the ground a path is at most three times as long as across the scene.
        longest = cell * (np.ceil(2.0 * 3.0 * far / cell) + 4.0)
        # Bodies at rest, and a little faster or slower, are of one class.
        least = -(np.floor(fastest / width) + 0.5) * width
        spread = max(_SPREAD * told, 2.0 * float(turning.max(initial=0.0)) / _STRIPS)
        return RateClasses(geometry, ends, spread, width, least, longest)

    def lengths(self, tubes: Tubes) -> Floats:
        """Return lengths (n,) [m] to add to the two-way paths of tubes, so that those of two classes never share a
        range cell: multiples of `longest`."""
        rate = self._rate(tubes.facet, tubes.points[:, CENTRE])
        return np.asarray(self.longest * np.maximum(np.floor((rate - self.least) / self.width), 0.0))

    def edge_to_cut(self, facet: Ints, bary: Floats) -> NDArray[np.int8]:
        """Return at which edge (n,) to bisect each tube, so that one rate serves all of it; -1: none.

        Args: facet (n,), bary (n, 3, 3) of its corners.
        """
        f, edge = self.geometry.facets, np.full(len(facet), -1, np.int8)
        rows = np.flatnonzero((f.spin != 0.0).any(axis=1)[f.body[facet]])
        if not len(rows):
            return edge
        corner = (bary[rows] @ f.vertices[facet[rows]]).reshape(-1, 3)
        rate = self._rate(np.repeat(facet[rows], 3), corner).reshape(-1, 3)
        apart = np.abs(rate - np.roll(rate, -1, axis=1))
        edge[rows] = np.where(apart.max(axis=1) > self.spread, np.argmax(apart, axis=1), -1)
        return edge

    def _rate(self, facet: Ints, at: Floats) -> Floats:
        """Return the range rates (n,) [m/s] of points (n, 3) [m] on facets (n,), the mean of those from the ends."""
        f = self.geometry.facets
        body = f.body[facet]
        moved = f.velocity[body] + np.cross(f.spin[body], at - f.origin[body])
        rate = np.zeros(len(at))
        for place, velocity in self.ends:
            way = at - place
            length = np.sqrt((way**2).sum(axis=1))
            rate += ((moved - velocity) * way).sum(axis=1) / np.maximum(length, 1e-9) / len(self.ends)
        return rate
