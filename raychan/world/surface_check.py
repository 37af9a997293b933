"""Whether a simplified surface is near the curved facets of the whole mesh, at points of these, in place and normal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.collapses import Limits
from raychan.geometry.half_edges import Net, corners_at
from raychan.geometry.patch_offsets import centres, offsets
from raychan.geometry.triangles import edge_curvatures
from raychan.parallel import parallel_for

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]

_SHRINK = 0.4, 0.85  # least and largest factor on edges where a check failed
_ORDER = 3.0  # power of the edge with which curved facets deviate, at least (Nagata 2005)
# Largest deviation anywhere on a facet over that of the points checked: 1.53 at most on spheres and tori of 20,000 to
# 100,000 facets at 0.05 to 1 dB, against their closed forms (command not noted).
_BETWEEN = 1.6


class Check:
    """Points of the whole mesh's curved surface, vertices that may go and the centres of facets, with its normals
    there; facet (s,) of the simplified mesh on which each lies, vertex (p,) and rows (q,) of the whole mesh."""

    def __init__(self, whole: Net, facet: Ints, every: int = 1) -> None:
        """Take the points of a whole mesh, or every so manieth; facet (n,) on which the centre of each facet lies."""
        self.vertex = np.flatnonzero(~whole.locked)[::every]
        a, b, c = whole.faces.T
        self.rows = np.flatnonzero(~(whole.locked[a] & whole.locked[b] & whole.locked[c]))[::every]
        corner, begin = corners_at(whole.faces, len(whole.v))[self.vertex], len(self.vertex)
        self.facet = facet[np.concatenate([corner // 3, self.rows])]
        self._place, self._normal = np.empty((len(self.facet), 3)), np.empty((len(self.facet), 3))
        self._place[:begin], self._normal[:begin] = whole.v[self.vertex], whole.n[corner]
        place, normal = self._place[begin:], self._normal[begin:]

        def some(r: slice) -> None:
            centres(whole.v, whole.faces, whole.n, self.rows[r], place[r], normal[r])

        parallel_for(len(self.rows), some)

    def __call__(self, net: Net, heir: Ints, limits: Limits) -> tuple[Ints, Floats, Floats]:
        """Return the facet of each point, how far points about it may be off [m], and how far off they are in place or
        normal over the limit; heir (m,) the last heir of each facet of the net."""
        live = np.flatnonzero(net.faces[:, 0] >= 0)
        number = np.zeros(len(net.faces), np.int32)
        number[live] = np.arange(len(live))
        v, n = net.v[net.faces[live]], net.n[net.corner[live]]
        patches = v, n, edge_curvatures(v, n)[0]
        facet = heir[self.facet]
        off, turned = np.empty(len(facet)), np.empty(len(facet))

        def some(r: slice) -> None:
            offsets(self._place[r], self._normal[r], facet[r], patches, net.mate, number, off[r], turned[r])

        parallel_for(len(facet), some)
        off *= _BETWEEN
        return facet, off, np.maximum(off / limits.deviation, turned / limits.normal)

    def shorten(self, net: Net, failed: Net, vertex: Ints, found: tuple[Ints, Floats], some: bool) -> None:
        """Shorten the edges that may come on a net where facets of what became of it failed.

        Args: vertex (k,) numbers in the whole mesh of the net's vertices, ascending; found the facet and the excess
        (s,) of each point on the failed net; some: whether any may come at all.
        """
        facet, excess = found
        worst = np.zeros(len(net.faces))
        np.maximum.at(worst, facet, excess)
        rows = np.flatnonzero(worst > 1.0)
        corners = failed.faces[rows]
        reach = np.zeros(len(rows))
        if some:
            v = net.v[corners]
            longest = np.linalg.norm(np.roll(v, -1, axis=1) - v, axis=2).max(axis=1)
            factor = np.clip(_SHRINK[1] * worst[rows] ** (-1.0 / _ORDER), *_SHRINK)
            reach = factor * np.minimum(longest, net.reach[corners].max(axis=1))
        allowed = np.full(len(worst), np.inf)
        allowed[rows] = reach
        for k in range(3):
            np.minimum.at(net.reach, corners[:, k], reach)
        _, at, own = np.intersect1d(vertex, self.vertex, assume_unique=True, return_indices=True)
        net.reach[at] = np.minimum(net.reach[at], allowed[facet[own]])
