"""Pieces of surfaces that can be halved along several axes: triangles of facets, and sectors of rings on a plane. Both
halves of a piece have the same area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Rows = NDArray[np.generic]


@dataclass(frozen=True)
class Triangles:
    """Triangles of corners (n, 3, 3) [m], halved along their edges."""

    corners: Floats

    @property
    def middle(self) -> Floats:
        """Middle of area (n, 3) [m]."""
        return np.asarray(self.corners.mean(axis=1))

    @property
    def axes(self) -> Floats:
        """Lines (n, k, 2, 3) [m] along which a piece may be halved, from end to end."""
        return np.stack([self.corners, np.roll(self.corners, -1, axis=1)], axis=2)

    def take(self, rows: Rows) -> Triangles:
        """Return some of the pieces."""
        return Triangles(self.corners[rows])

    def halved(self, axis: Ints) -> Triangles:
        """Return the first, then the second halves (2 n) of the pieces, each along its axis (n,)."""
        rows, after = np.arange(len(axis)), (axis + 1) % 3
        half = 0.5 * (self.corners[rows, axis] + self.corners[rows, after])
        first, second = self.corners.copy(), self.corners.copy()
        first[rows, after] = second[rows, axis] = half
        return Triangles(np.concatenate([first, second]))


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


Pieces = Triangles | Sectors
