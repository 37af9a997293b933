"""First facets that rays meet, one ray after another in plain Python around embreex: the slow form of the ray caster.

A ray goes with two companions a few float32 spacings aside. embreex names triangles; distances are those to their
planes in double precision.
"""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

_TRIES, _FAR, _OFFSET, _EDGE = 8, 32.0, 2e-6, 0.15


class SlowCaster:
    """Facets (f, 3, 3) [m] as one group."""

    def __init__(self, corners):
        self.corners = np.asarray(corners, float)
        low, high = self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))
        self.centre, self.extent = 0.5 * (low + high), np.linalg.norm(high - low)
        self.size = min(self.extent, 1.0)
        self.radius = 0.5001 * self.extent
        self.nearest = 1e-6 * self.size + 8.0 * np.spacing(np.maximum(-low, high).max())
        normal = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        self.normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        self.scene = EmbreeScene(robust=True)
        TriangleMesh(self.scene, np.ascontiguousarray(self.corners - self.centre, np.float32))

    def cast(self, origin, direction, skip, start):
        """Return the first facet of each ray, -1 for none, and its distance [m]."""
        rows = [self._one(*row) for row in zip(origin, direction, skip, start, strict=True)]
        return np.array([h for h, _ in rows], np.int32), np.array([t for _, t in rows])

    def _one(self, x, d, skip, start):
        ahead, offset = self._ahead(x, d, skip, start)
        for attempt in range(_TRIES):
            h, *others = self._named(x, d, ahead, offset, attempt % 2 == 1)
            if h >= 0 and not self._on_facet(h, x, d, self._plane(h, x, d), offset):
                h = self._not_grazed(h, others, x, d, ahead, offset)
                if h is None:
                    offset *= 2.0
                    continue
            for other in others:
                if other >= 0 and other != h:
                    old = np.inf if h < 0 else self._plane(h, x + ahead * d, d)
                    new = self._plane(other, x + ahead * d, d)
                    if 0.0 < new < old - offset and self._holds(other, x, d, ahead + new, offset):
                        h = other
            if h < 0:
                return -1, np.inf
            t = self._plane(h, x, d)
            if h != skip and t > start + self.nearest:
                return h, t
            ahead, offset = max(t, ahead) + 2.0 * offset, 2.0 * offset
        return -1, np.inf

    def _ahead(self, x, d, skip, start):
        """Return how far ahead of its origin a ray is cast, and its offset [m]."""
        along = (self.centre - x) @ d
        aside = ((x + along * d - self.centre) ** 2).sum()
        at = along - np.sqrt(max(self.radius**2 - aside, 0.0))
        at = at if at > max(start, _FAR * self.radius) else start
        offset = _OFFSET * (self.size + np.abs(x + at * d - self.centre).max())
        return at + (offset if at == start and (skip >= 0 or start > 0.0) else 0.0), offset

    def _named(self, x, d, ahead, offset, turn):
        """Return what embreex says that the ray and its companions meet."""
        side = np.array(
            [
                d[1] * (d[1] - 0.7) - d[2] * (d[0] + 0.3),
                d[2] * d[2] - d[0] * (d[1] - 0.7),
                d[0] * (d[0] + 0.3) - d[1] * d[2],
            ]
        )
        if turn:
            side = np.cross(d, side)
        at, aside = x + ahead * d, offset * side
        origin = np.array([at - self.centre, at + aside - self.centre, at - aside - self.centre], np.float32)
        return [int(h) for h in self.scene.run(origin, np.tile(d, (3, 1)).astype(np.float32))]

    def _plane(self, h, x, d):
        slope = self.normal[h] @ d
        return self.normal[h] @ (self.corners[h, 0] - x) / slope if slope else np.inf

    def _on_facet(self, h, x, d, t, offset):
        if abs(self.normal[h] @ d) <= 1e-9 or not np.isfinite(t):
            return False
        along = (self.corners[h] - x) @ d
        room = 1e-3 * np.ptp(along) + 64.0 * offset
        return along.min() - room < t < along.max() + room

    def _holds(self, h, x, d, t, offset):
        if not self._on_facet(h, x, d, t, offset):
            return False
        for a, b in zip(self.corners[h], np.roll(self.corners[h], -1, axis=0), strict=True):
            inward = np.cross(self.normal[h], b - a)
            if (x + t * d - a) @ inward <= -_EDGE * offset * np.linalg.norm(b - a):
                return False
        return True

    def _not_grazed(self, h, others, x, d, ahead, offset):
        """Return what the companions of a ray that runs along facet h meet first, -1 for nothing; None if they run
        along one too."""
        found, least = -1, np.inf
        for other in others:
            if other >= 0:
                t = self._plane(other, x, d)
                if other == h or not self._on_facet(other, x, d, t, offset):
                    return None
                if ahead < t < least:
                    found, least = other, t
        return found
