"""Rays against facets: triangle ids from Embree, everything else in float64 (the only import of embreex).

Embree answers in float32, whose spacing at 200 m is 15 um: 0.05 rad two-way at 77 GHz. So only the triangle's id is
taken; the hit point is the float64 intersection with that triangle's plane. The world is shifted to the centre of the
facets before it is cast to float32, so a scene far from the origin gives the answer of one at the origin.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.tables import LAYER, Facets

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_CHUNK = 1 << 16
_MISS = np.int32(-1)
_SLACK = 2e-6  # of a coordinate: a few float32 spacings
_EDGE = 0.15  # of the pace: what float32 may move a ray aside
_TOUCH = 2e-5  # m: surfaces nearer than this lie on each other
_NEAREST = 1e-6  # m: a hit closer than this is the surface the ray leaves


class Tracer:
    """A scene of facets that answers rays; holds counts of the rays it cast."""

    def __init__(self, facets: Facets) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.facets = facets
        v = facets.vertices
        self.first = v[:, 0]
        cross = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
        norm = np.linalg.norm(cross, axis=1, keepdims=True)
        self.normal = cross / np.where(norm > 0, norm, 1.0)
        self.area = 0.5 * norm[:, 0]
        self.is_layer = facets.materials.kind[facets.material] == LAYER if len(v) else np.zeros(0, bool)
        self.rays = 0
        # Which facets are one surface; each for itself until someone knows better.
        self.plane = self.smooth = np.arange(len(v), dtype=np.int32)
        self._any_layer = bool(self.is_layer.any())
        self._scene: Any = None
        self.extent = 0.0
        if len(v):
            low, high = v.min(axis=(0, 1)), v.max(axis=(0, 1))
            self._centre = 0.5 * (low + high)
            self.extent = float(np.linalg.norm(high - low))
            self._scene = EmbreeScene(robust=True)
            self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(v - self._centre, dtype=np.float32))
            self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def _ids(self, origin: Floats, direction: Floats) -> Ints:
        """Return the first triangle of each float32 ray, over two threads in chunks."""
        o = (origin - self._centre).astype(np.float32)
        d = direction.astype(np.float32)
        if len(o) <= _CHUNK:
            return self._scene.run(o, d)
        starts = range(0, len(o), _CHUNK)
        with ThreadPoolExecutor(2) as pool:
            run = self._scene.run
            parts = pool.map(lambda i: run(o[i : i + _CHUNK], d[i : i + _CHUNK]), starts)
            return np.concatenate(list(parts))

    def _mend(self, hit: Ints, origin: Floats, direction: Floats, pace: Floats) -> None:
        """Cast all rays again, a few float32 spacings to either side: what is nearer then counts.

        Of rays aimed at corners Embree lets one in some hundreds through, of those aimed at edges one in a million, in
        its robust mode too. A ray and its two companions count as one.
        """
        side = np.cross(direction, direction[:, [2, 0, 1]] + np.array([0.0, 0.3, -0.7]))
        for turn in (1.0, -1.0):
            other = self._ids(origin + turn * pace[:, None] * side, direction)
            rows = np.flatnonzero((other != hit) & (other >= 0))
            old, new = hit[rows], other[rows]
            t_old = np.where(old >= 0, self.distance(old, origin[rows], direction[rows]), np.inf)
            t_new = self.distance(new, origin[rows], direction[rows])
            nearer = (t_new > 0.0) & (t_new < t_old - pace[rows])
            rows, new = rows[nearer], new[nearer]
            real = self._holds(new, origin[rows] + t_new[nearer, None] * direction[rows], _EDGE * pace[rows])
            hit[rows[real]] = new[real]

    def _holds(self, facet: Ints, point: Floats, margin: Floats) -> NDArray[np.bool_]:
        """Tell whether points (n, 3) of facets' planes lie on the facets, or within a margin (n,) [m] of them."""
        v, n = self.facets.vertices[facet], self.normal[facet]
        side = np.roll(v, -1, axis=1) - v
        inward = np.cross(n[:, None], side)
        depth = np.einsum("nij,nij->ni", point[:, None] - v, inward)
        return np.asarray((depth > -margin[:, None] * np.linalg.norm(side, axis=2)).all(axis=1))

    def distance(self, facet: Ints, origin: Floats, direction: Floats) -> Floats:
        """Return the float64 distance [m] along each ray to the plane of its facet (inf when parallel)."""
        n = self.normal[facet]
        slope = np.einsum("ij,ij->i", n, direction)
        height = np.einsum("ij,ij->i", n, self.first[facet] - origin)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = height / slope
        return np.where(slope == 0.0, np.inf, t)

    def cast(self, origin: Floats, direction: Floats, skip: Ints, start: Floats | None = None) -> tuple[Ints, Floats]:
        """Return the first facet (-1: none) hit by each ray and its distance [m].

        Args: origin (n, 3) [m], direction (n, 3) unit, skip (n,) facet that the ray leaves and cannot
        hit (-1: none), start (n,) distance [m] from which hits count.
        """
        n = len(origin)
        facet = np.full(n, _MISS, np.int32)
        distance = np.full(n, np.inf)
        if self._scene is None or n == 0:
            return facet, distance
        begin = np.zeros(n) if start is None else np.asarray(start, float)
        # Rays leave a little ahead, in float32 terms; the float64 origin stays the true one.
        pace = _SLACK * (1.0 + np.abs(origin - self._centre).max(axis=1))
        ahead = begin + np.where((skip >= 0) | (begin > 0), pace, 0.0)
        todo = np.arange(n)
        for _ in range(8):
            at, d = origin[todo] + ahead[todo, None] * direction[todo], direction[todo]
            hit = self._ids(at, d)
            self.rays += len(hit)
            self._mend(hit, at, d, pace[todo])
            found = hit >= 0
            rows, ids = todo[found], hit[found]
            t = self.distance(ids, origin[rows], direction[rows])
            again = (ids == skip[rows]) | (t <= begin[rows] + _NEAREST)
            facet[rows[~again]], distance[rows[~again]] = ids[~again], t[~again]
            todo = rows[again]
            if len(todo) == 0:
                break
            ahead[todo] = np.maximum(np.where(np.isfinite(t[again]), t[again], 0.0), ahead[todo]) + pace[todo] * 2.0
            pace[todo] *= 2.0
        return facet, distance

    def _twin(self, facet: Ints, t: Floats, limit: Floats, slack: Floats, target: Ints) -> NDArray[np.bool_]:
        """Tell which rays met another surface lying in the plane of their target at the same place: it counts there,
        the target does not, so that what is drawn twice returns once."""
        a, b = np.maximum(facet, 0), np.maximum(target, 0)
        there = (facet >= 0) & (target >= 0) & (np.abs(t - limit) < np.minimum(slack, _TOUCH))
        apart = (self.plane[a] != self.plane[b]) & (self.smooth[a] != self.smooth[b])
        return there & apart & (np.abs(np.einsum("ij,ij->i", self.normal[a], self.normal[b])) > 1.0 - 1e-9)

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
        reached = np.zeros(n, bool)
        passed = np.full((n, layers), _MISS, np.int32)
        blocker = np.full(n, _MISS, np.int32)
        count = np.zeros(n, np.int64)
        todo, start = np.arange(n), np.zeros(n)
        while len(todo):
            facet, t = self.cast(origin[todo], direction[todo], skip[todo], start[todo])
            # Only the target's own curved surface may lie before it by more than rounding.
            own = self.smooth[facet] == self.smooth[target[todo]]
            near = np.where(own, slack[todo], np.minimum(slack[todo], _TOUCH))
            clear = (facet < 0) | (t >= limit[todo] - near) | (facet == target[todo])
            clear &= ~self._twin(facet, t, limit[todo], slack[todo], target[todo])
            if inside is not None:
                clear |= self.facets.body[np.maximum(facet, 0)] == inside[todo]
            reached[todo[clear]] = True
            blocker[todo] = np.where(clear, _MISS, facet)
            if not self._any_layer or layers == 0:
                break
            more = ~clear & self.is_layer[facet] & (count[todo] < layers)
            todo, facet, t = todo[more], facet[more], t[more]
            passed[todo, count[todo]] = facet
            count[todo] += 1
            start[todo] = t + _NEAREST
        return reached, passed, blocker
