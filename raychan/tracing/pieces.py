"""Pieces of surfaces that can be halved along two axes: quadrilaterals of facets, and sectors of rings on a plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.poses import sizes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Rows = NDArray[np.generic]


@dataclass(frozen=True)
class Quads:
    """Plane, convex pieces of corners (n, 2, 2, 3) [m], from near to far and from start to stop of a turn, halved along
    the lines between the middles of opposite sides; two corners may be one."""

    corners: Floats

    @property
    def middle(self) -> Floats:
        """Middle of area (n, 3) [m]."""
        c = self.corners
        first, second = c[:, 0, 1], c[:, 1, 0]
        weights = np.stack(self._triangles, axis=1)
        share = weights / weights.sum(axis=1, keepdims=True)
        return np.asarray((c[:, 0, 0] + c[:, 1, 1] + share[:, :1] * first + share[:, 1:] * second) / 3.0)

    @property
    def axes(self) -> Floats:
        """Lines (n, k, 2, 3) [m] along which a piece may be halved, from end to end."""
        return np.stack([self.corners.mean(axis=2), self.corners.mean(axis=1)], axis=1)

    @property
    def area(self) -> Floats:
        """Area (n,) [m^2]."""
        return np.asarray(sum(self._triangles))

    def take(self, rows: Rows) -> Quads:
        """Return some of the pieces."""
        return Quads(self.corners[rows])

    def halved(self, axis: Ints) -> Quads:
        """Return the first, then the second halves (2 n) of the pieces, each along its axis (n,)."""
        first, second, turned = self.corners.copy(), self.corners.copy(), axis == 1
        for on, x, y in ((~turned, first[:, 1], second[:, 0]), (turned, first[:, :, 1], second[:, :, 0])):
            x[on] = y[on] = 0.5 * (x[on] + y[on])
        return Quads(np.concatenate([first, second]))

    @property
    def _triangles(self) -> tuple[Floats, Floats]:
        """Areas (n,) [m^2] on either side of the diagonal from the near start to the far stop."""
        c = self.corners
        across = c[:, 1, 1] - c[:, 0, 0]
        first, second = (0.5 * sizes(np.cross(across, x - c[:, 0, 0])) for x in (c[:, 0, 1], c[:, 1, 0]))
        return first, second


@dataclass(frozen=True)
class Sectors:
    """Sectors of rings on a plane, halved along the radius and across it.

    Args: bounds (n, 2, 2): squares of both radii [m^2], of which a piece's area is linear, and both angles [rad];
    plane (3, 3): foot of the radius [m] and two unit vectors.
    """

    bounds: Floats
    plane: Floats

    @property
    def middle(self) -> Floats:
        """Middle of area (n, 3) [m]."""
        return self._at(*self._halves)

    @property
    def axes(self) -> Floats:
        """Lines (n, k, 2, 3) [m] along which a piece may be halved, from end to end."""
        square, angle = self._halves
        ends = np.empty((len(square), 2, 2, 3))
        for i in range(2):
            ends[:, 0, i] = self._at(self.bounds[:, 0, i], angle)
            ends[:, 1, i] = self._at(square, self.bounds[:, 1, i])
        return ends

    @property
    def area(self) -> Floats:
        """Area (n,) [m^2]."""
        return np.asarray(0.5 * np.ptp(self.bounds, axis=2).prod(axis=1))

    def take(self, rows: Rows) -> Sectors:
        """Return some of the pieces."""
        return Sectors(self.bounds[rows], self.plane)

    def halved(self, axis: Ints) -> Sectors:
        """Return the first, then the second halves (2 n) of the pieces, each along its axis (n,)."""
        rows = np.arange(len(axis))
        first, second = self.bounds.copy(), self.bounds.copy()
        first[rows, axis, 1] = second[rows, axis, 0] = self._halves[axis, rows]
        return Sectors(np.concatenate([first, second]), self.plane)

    @property
    def _halves(self) -> Floats:
        return 0.5 * (self.bounds[:, :, 0] + self.bounds[:, :, 1]).T

    def _at(self, square: Floats, angle: Floats) -> Floats:
        radius = np.sqrt(square)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1) @ self.plane[1:] + self.plane[0]


Pieces = Quads | Sectors
