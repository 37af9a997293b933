"""Rays against facets: triangle ids from Embree, everything else in float64 (the only import of embreex).

Embree answers in float32, whose spacing at 200 m is 15 um: 0.05 rad two-way at 77 GHz. So only the triangle's id is
taken; the hit point is the float64 intersection with that triangle's plane. The world is shifted to the centre of the
facets before it is cast to float32, so a scene far from the origin gives the answer of one at the origin.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.intersect import arrive, companions, land, near_ball, plane_distances, set_out
from raychan.geometry.triangles import extents, planes_of, turned
from raychan.parallel import cached, parallel_for
from raychan.records import LAYER, Facets
from raychan.world.backed_layers import backed
from raychan.world.static_geometry import StaticGeometry, columns, lasting

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MISS = np.int32(-1)
_MANY = 4096  # rays from which on a second thread pays
_CHUNK = 1 << 16
_SLACK = 2e-6  # of a coordinate: a few float32 spacings
_EDGE = 0.15  # of the pace: what float32 may move a ray aside
# Of the size of a small scene, or of 1 m in a larger one:
_TOUCH = 2e-5  # surfaces nearer than this lie on each other
_NEAREST = 1e-6  # a hit closer than this is the surface the ray leaves


class Triangles:
    """Embree's scene of triangles, made for the first ray. Args: corners gives them, (n, 3, 3) [m]; centre (3,) [m]."""

    def __init__(self, corners: Callable[[], Floats], centre: Floats) -> None:
        self._corners: Callable[[], Floats] | None = corners
        self.centre, self.making = centre, threading.RLock()

    @cached
    def scene(self) -> Any:
        """What answers rays from the centre."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        assert self._corners is not None
        scene = EmbreeScene(robust=True)
        self._mesh = TriangleMesh(scene, np.ascontiguousarray(self._corners() - self.centre, np.float32))
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        self._corners = None
        return scene


class Group:
    """Facets that are cast at together, in the world's frame or one of their own.

    Args: corners gives them, (n, 3, 3) [m]; extents (b, 2, 3) [m] that they do not reach beyond; rows (n,) their
    numbers among all, None if they are all; behind [m] by which a hit must lie before those of earlier groups.
    """

    def __init__(self, corners: Callable[[], Floats], extents: Floats, rows: Ints | None, behind: float = 0.0) -> None:
        self.behind = behind
        low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
        self.centre, self.radius = 0.5 * (low + high), 0.5001 * float(np.linalg.norm(high - low))
        self.mesh, self._rows = Triangles(corners, self.centre), rows
        self._frame: tuple[Floats, Floats] | None = None

    def placed(self, turn: Floats, origin: Floats) -> Group:
        """Return the same facets where their frame stands now: turn (3, 3) to world axes, origin (3,) [m]."""
        now = copy(self)
        now.centre, now._frame = turn @ self.mesh.centre + origin, (np.ascontiguousarray(turn.T), -turn.T @ origin)
        return now

    def own(self, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Return origins and directions (n, 3) of rays in the group's frame."""
        if self._frame is None:
            return origin, direction
        return turned(origin, *self._frame), turned(direction, self._frame[0], np.zeros(3))

    def run(self, origin: NDArray[np.float32], direction: NDArray[np.float32]) -> Ints:
        """Return the facet (n,) that each ray, from the mesh's centre in its frame, meets first, -1 for none."""
        hit: Ints = self.mesh.scene.run(origin, direction)
        return hit if self._rows is None else np.where(hit >= 0, self._rows[hit], _MISS)


class RayCaster:
    """A scene of facets that answers rays, and counts them by thread."""

    def __init__(self, facets: Facets, still: StaticGeometry | None = None) -> None:
        self.facets = facets
        v, n = facets.vertices, len(facets.vertices)
        self.first = np.ascontiguousarray(v[:, 0])
        self.normal, self.area = columns(still, "planes", lambda rows: planes_of(v[rows]))
        self.extents = _extents(facets, still)
        kind = facets.materials.kind
        self.is_layer = lasting(still, "layer", lambda: kind[facets.material] == LAYER if n else np.zeros(0, bool))
        self._counts = threading.local()
        # Which facets are one surface; each for itself until someone knows better.
        self.plane = self.smooth = lasting(still, "apart", lambda: np.arange(n, dtype=np.int32))
        self._any_layer = bool(self.is_layer.any())
        # Whether facets never hide each other from a point that looks at their lit sides.
        self.hides_nothing = False
        # Held while something is made that serves all threads.
        self.making = threading.RLock()
        self.extent, self._size, self.touch, self._nearest = 0.0, 1.0, _TOUCH, _NEAREST
        self._groups: list[Group] = []
        if n:
            low, high = self.extents[:, 0].min(axis=0), self.extents[:, 1].max(axis=0)
            self._centre = 0.5 * (low + high)
            self.extent = float(np.linalg.norm(high - low))
            self._size = min(self.extent, 1.0)
            # Far from the origin coordinates themselves are only known to their float64 spacing.
            blur = 8.0 * float(np.spacing(np.maximum(-low, high).max()))
            self.touch, self._nearest = _TOUCH * self._size + blur, _NEAREST * self._size + blur
            self._groups = self._whole() if still is None else self._parted(still)

    def _whole(self) -> list[Group]:
        """Return all facets together, but for layers upon something opaque, which counts before them."""
        v = self.facets.vertices
        upon = backed(v - self._centre, self.normal, self.area, self.is_layer, self.touch)
        if not upon.any():
            return [Group(lambda: v, self.extents, None)]
        rest, thin = (np.flatnonzero(x).astype(np.int32) for x in (~upon, upon))
        return [
            Group(lambda: v[rest], self.extents, rest),
            Group(lambda: v[thin], self.extents, thin, behind=self.touch),
        ]

    def _parted(self, still: StaticGeometry) -> list[Group]:
        """Return what stands still, what is large and moves, and all that is small and moves, each by itself."""
        v, extents = self.facets.vertices, self.extents
        groups = []
        if len(still.rest):
            there = np.delete(extents, still.moving, 0)
            groups.append(still.lasting("group", lambda: Group(lambda: v[still.rest], there, still.rest)))
        for r in still.rigid:
            low, high = r.mesh.bounds
            one = partial(Group, lambda m=r.mesh: m.corners, np.array([[low, high]]), r.rows)
            groups.append(still.lasting(f"group {r.body}", one).placed(r.turn, r.origin))
        if len(still.few):
            groups.append(Group(lambda: v[still.few_rows], extents[still.few], still.few_rows))
        return groups

    @property
    def rays(self) -> int:
        """Rays cast so far by this thread."""
        return int(getattr(self._counts, "rays", 0))

    def _count(self, rays: int) -> None:
        self._counts.rays = self.rays + rays

    def distance(self, facet: Ints, origin: Floats, direction: Floats) -> Floats:
        """Return the float64 distance [m] along each ray to the plane of its facet (inf when parallel)."""
        found: Floats = plane_distances(facet, origin, direction, self.first, self.normal)
        return found

    def cast(self, origin: Floats, direction: Floats, skip: Ints, start: Floats | None = None) -> tuple[Ints, Floats]:
        """Return the first facet (-1: none) hit by each ray and its distance [m].

        Args: origin (n, 3) [m], direction (n, 3) unit, skip (n,) facet that the ray leaves and cannot
        hit (-1: none), start (n,) distance [m] from which hits count.
        """
        n = len(origin)
        facet, distance = np.full(n, _MISS, np.int32), np.full(n, np.inf)
        if not len(self.first) or n == 0:
            return facet, distance
        # Rows that lie apart, as those of one ray in four, would be compiled for by themselves.
        origin, direction = np.ascontiguousarray(origin), np.ascontiguousarray(direction)
        begin = np.zeros(n) if start is None else np.ascontiguousarray(start, float)
        casts = []
        for group in self._groups:
            _ = group.mesh.scene

        def some(rows: slice) -> None:
            for i in range(rows.start, rows.stop, _CHUNK):
                at = slice(i, min(i + _CHUNK, rows.stop))
                ways = origin[at], direction[at], skip[at], begin[at]
                casts.append(self._cast(self._groups[0], *ways, facet[at], distance[at]))
                for group in self._groups[1:]:
                    self._nearer(group, *ways, facet[at], distance[at])

        parallel_for(n, some, _MANY)
        # A ray and its two companions count as one, however many groups it is cast at.
        self._count(sum(casts))
        return facet, distance

    def _nearer(
        self, group: Group, origin: Floats, direction: Floats, skip: Ints, begin: Floats, facet: Ints, distance: Floats
    ) -> None:
        """Write what rays meet of another group, where that is nearer."""
        rows = near_ball(origin, direction, distance, group.centre, group.radius)
        found, t = np.full(len(rows), _MISS, np.int32), np.full(len(rows), np.inf)
        self._cast(group, origin[rows], direction[rows], skip[rows], begin[rows], found, t)
        # Of two in the same place the first counts, whichever group it is of.
        tie = (t == distance[rows]) & (found < facet[rows]) & (group.behind == 0.0)
        closer = (found >= 0) & ((t + group.behind < distance[rows]) | tie)
        facet[rows[closer]], distance[rows[closer]] = found[closer], t[closer]

    def _cast(
        self, group: Group, origin: Floats, direction: Floats, skip: Ints, begin: Floats, facet: Ints, distance: Floats
    ) -> int:
        """Write the facets and distances of a chunk of rays; return how many were cast."""
        # Rays leave a little ahead, in float32 terms; the float64 origin stays the true one.
        ball = group.centre, group.radius
        ahead, pace = set_out(origin, direction, skip, begin, *ball, _SLACK, self._size)
        near = group.own(origin, direction)
        todo, count = np.arange(len(origin)), 0
        shape = self.facets.vertices, self.first, self.normal
        for turn in range(8):
            hit = group.run(*companions(todo, *near, ahead, pace, group.mesh.centre, turn % 2 == 1))
            count += len(todo)
            ways = origin, direction, skip, begin, ahead, pace, _EDGE, self._nearest
            todo = land(todo, hit, *ways, *shape, facet, distance)
            if len(todo) == 0:
                break
        return count

    def walk(
        self,
        origin: Floats,
        direction: Floats,
        limit: Floats,
        slack: Floats,
        skip: Ints,
        target: Ints,
        layers: int,
        inside: Ints | None = None,
    ) -> tuple[NDArray[np.bool_], Ints, Ints]:
        """Tell which rays reach `limit` [m] and through which thin layers.

        Args: slack (n,) [m] how far before the limit a hit still counts as the target's own surface;
        skip (n,) facet left; target (n,) facet aimed at (hits on it never block);
        layers: how many may be passed; inside (n,) body that the target stands in, which never blocks.
        Returns: reached (n,) bool, passed (n, layers) facet ids in order (-1 unused), blocker (n,) the opaque facet in
        the way (-1: none).
        """
        n = len(origin)
        reached, blocker = np.zeros(n, bool), np.full(n, _MISS, np.int32)
        passed = np.full((n, layers), _MISS, np.int32)
        todo, start = np.arange(n), np.zeros(n)
        if self.hides_nothing:
            # What looks towards the ray's start is then seen from it; each such point still counts as a ray.
            towards = np.einsum("ij,ij->i", direction, self.normal[target]) < 0.0
            reached = towards & (target >= 0) & (skip < 0)
            todo = np.flatnonzero(~reached)
            self._count(n - len(todo))
        shape = self.plane, self.smooth, self.facets.vertices, self.normal, _EDGE * _SLACK * self._size
        ways = limit, slack, target, self.touch, *shape
        bodies = (self.facets.body, np.zeros(0, np.int64) if inside is None else inside.astype(np.int64))
        layer = self.is_layer if self._any_layer else np.zeros(0, bool)
        while len(todo):
            rays: Any = origin, direction, skip, start
            if len(todo) < n:
                rays = tuple(x[todo] for x in rays)
            facet, t = self.cast(*rays)
            more = arrive(*(todo, facet, t, *rays[:2], *ways, *bodies, layer, reached, passed, blocker))
            todo = todo[more]
            start[todo] = t[more] + self._nearest
        return reached, passed, blocker


def _extents(facets: Facets, still: StaticGeometry | None) -> Floats:
    """Return the lowest and highest corner (b, 2, 3) [m] of each body."""
    count = len(facets.role)
    shared = still if still is not None and still.shares else None
    found: Floats = lasting(shared, "extents", lambda: extents(facets.vertices, facets.body, count))
    if shared is not None:
        moved = extents(facets.vertices[shared.rows], facets.body[shared.rows], count)
        found = found.copy()
        found[shared.moving] = moved[shared.moving]
    return found
