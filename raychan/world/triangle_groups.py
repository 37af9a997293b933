"""Groups of triangles that rays are cast at."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.intersect import FacetGroups
from raychan.parallel import cached
from raychan.world.embree_library import EmbreeScene, intersect_address

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_FEW = 64  # facets up to which each has a sphere of its own; other values not measured


class Triangles:
    """Embree's scene of triangles, built for the first ray.

    Args: corners returns them, (n, 3, 3) [m]; centre (3,) [m], from which float32 coordinates count.
    """

    def __init__(self, corners: Callable[[], Floats], centre: Floats) -> None:
        self._corners: Callable[[], Floats] | None = corners
        self.centre, self.making = centre, threading.RLock()

    @cached
    def scene(self) -> EmbreeScene:
        """Embree's scene; origins of rays count from the centre."""
        assert self._corners is not None
        scene = EmbreeScene(np.ascontiguousarray(self._corners() - self.centre, np.float32))
        self._corners = None
        return scene


class Group:
    """Facets that rays are cast at together, in the world's frame or in one of their own.

    Args: corners returns them, (n, 3, 3) [m]; extents (b, 2, 3) [m] that hold them; rows (n,) their numbers among all;
    behind [m] by which a hit must lie before those of earlier groups.
    """

    def __init__(self, corners: Callable[[], Floats], extents: Floats, rows: Ints, behind: float = 0.0) -> None:
        self.behind, self.rows = behind, rows
        low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
        self.centre, self.radius = 0.5 * (low + high), 0.5001 * float(np.linalg.norm(high - low))
        self.mesh = Triangles(corners, self.centre)
        self.frame: tuple[Floats, Floats] | None = None
        self.spheres = self.centre[None], np.array([self.radius])

    def posed(self, turn: Floats, origin: Floats) -> Group:
        """Return the same facets with their frame at turn (3, 3) to world axes, origin (3,) [m]."""
        now = copy(self)
        now.centre, now.frame = turn @ self.mesh.centre + origin, (np.ascontiguousarray(turn.T), -turn.T @ origin)
        now.spheres = now.centre[None], self.spheres[1]
        return now

    def facet_by_facet(self, corners: Floats) -> Group:
        """Return the same few facets with a sphere about each: facets far apart leave most rays alone."""
        if len(corners) <= _FEW:
            middle = corners.mean(axis=1)
            reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
            self.spheres = middle, 1.001 * reach + self.behind
        return self


def facet_groups(groups: Sequence[Group]) -> FacetGroups:
    """Return groups as compiled code reads them, their scenes built. It holds addresses of scenes, not the scenes."""
    world = np.eye(3), np.zeros(3)
    frames = [g.frame or world for g in groups]
    return FacetGroups(
        intersect=intersect_address(),
        scene=np.array([g.mesh.scene.address for g in groups], np.uintp),
        facet=groups[0].rows if len(groups) == 1 else np.concatenate([g.rows for g in groups]),
        first_facet=np.cumsum([0, *(len(g.rows) for g in groups)], dtype=np.int64),
        sphere_centre=np.concatenate([g.spheres[0] for g in groups]),
        sphere_radius=np.concatenate([g.spheres[1] for g in groups]),
        first_sphere=np.cumsum([0, *(len(g.spheres[1]) for g in groups)], dtype=np.int64),
        behind=np.array([g.behind for g in groups]),
        centre=np.array([g.centre for g in groups]),
        radius=np.array([g.radius for g in groups]),
        middle=np.array([g.mesh.centre for g in groups]),
        turned=np.array([g.frame is not None for g in groups]),
        matrix=np.array([matrix for matrix, _ in frames]),
        shift=np.array([shift for _, shift in frames]),
    )
