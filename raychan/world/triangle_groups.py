"""Groups of triangles that Embree casts rays at (the only import of embreex)."""

from __future__ import annotations

import threading
from collections.abc import Callable
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import transform
from raychan.parallel import cached

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MISS = np.int32(-1)
_FEW = 64  # facets up to which each has a sphere of its own; other values not measured


class Triangles:
    """Embree's scene of triangles, built for the first ray.

    Args: corners returns them, (n, 3, 3) [m]; centre (3,) [m], from which float32 coordinates count.
    """

    def __init__(self, corners: Callable[[], Floats], centre: Floats) -> None:
        self._corners: Callable[[], Floats] | None = corners
        self.centre, self.making = centre, threading.RLock()

    @cached
    def scene(self) -> Any:
        """Embree's scene; origins of rays count from the centre."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        assert self._corners is not None
        scene = EmbreeScene(robust=True)
        self._mesh = TriangleMesh(scene, np.ascontiguousarray(self._corners() - self.centre, np.float32))
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        self._corners = None
        return scene


class Group:
    """Facets that rays are cast at together, in the world's frame or in one of their own.

    Args: corners returns them, (n, 3, 3) [m]; extents (b, 2, 3) [m] that hold them; rows (n,) their numbers among all,
    None if they are all; behind [m] by which a hit must lie before those of earlier groups.
    """

    def __init__(self, corners: Callable[[], Floats], extents: Floats, rows: Ints | None, behind: float = 0.0) -> None:
        self.behind = behind
        low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
        self.centre, self.radius = 0.5 * (low + high), 0.5001 * float(np.linalg.norm(high - low))
        self.mesh, self._rows = Triangles(corners, self.centre), rows
        self._frame: tuple[Floats, Floats] | None = None
        self.spheres = self.centre[None], np.array([self.radius])

    def posed(self, turn: Floats, origin: Floats) -> Group:
        """Return the same facets with their frame at turn (3, 3) to world axes, origin (3,) [m]."""
        now = copy(self)
        now.centre, now._frame = turn @ self.mesh.centre + origin, (np.ascontiguousarray(turn.T), -turn.T @ origin)
        now.spheres = now.centre[None], self.spheres[1]
        return now

    def facet_by_facet(self, corners: Floats) -> Group:
        """Return the same few facets with a sphere about each: facets far apart leave most rays alone."""
        if len(corners) <= _FEW:
            middle = corners.mean(axis=1)
            reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
            self.spheres = middle, 1.001 * reach + self.behind
        return self

    def to_frame(self, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Return origins and directions (n, 3) of rays in the group's frame."""
        if self._frame is None:
            return origin, direction
        return transform(origin, *self._frame), transform(direction, self._frame[0], np.zeros(3))

    def run(self, origin: NDArray[np.float32], direction: NDArray[np.float32]) -> Ints:
        """Return the facet (n,) that each ray meets first, -1 for none; origins from the mesh's centre in its frame."""
        hit: Ints = self.mesh.scene.run(origin, direction)
        return hit if self._rows is None else np.where(hit >= 0, self._rows[hit], _MISS)
