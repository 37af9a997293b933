"""Whether a simplified surface is near the curved facets of the whole mesh, at points of these, in place and normal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.collapses import Limits
from raychan.geometry.half_edges import Net
from raychan.geometry.patch_offsets import centres, offsets, patches, vertices
from raychan.parallel import parallel_for

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]

_SHRINK = 0.4, 0.85  # least and largest factor on edges where a check failed
_ORDER = 3.0  # power of the edge with which curved facets deviate, at least (Nagata 2005)


class Check:
    """Points of the whole mesh's curved surface, vertices that may go and the centres of facets, with its normals
    there; facet (s,) of the simplified mesh on which each lies, vertex (p,) and rows (q,) of the whole mesh."""

    def __init__(self, whole: Net, facet: Ints, vertex: Ints, rows: Ints) -> None:
        """Take vertices (p,) and centres of facets, rows (q,), of a whole mesh; facet (n,) where the search for the
        centre of each of its facets begins."""
        self.vertex, self.rows, begin = vertex, rows, len(vertex)
        count = begin + len(self.rows)
        self._place, self._normal, self._facet = np.empty((count, 3)), np.empty((count, 3)), np.empty(count, np.int32)
        self._found, self._off, self._excess = np.zeros(count, np.int32), np.empty(count), np.empty(count)
        self._last: Net | None = None
        points = self._place, self._normal, self._facet
        first, rest = [x[:begin] for x in points], [x[begin:] for x in points]

        def corners(r: slice) -> None:
            vertices(whole.v, whole.n, whole.half, facet, self.vertex[r], *(x[r] for x in first))

        def middles(r: slice) -> None:
            centres(whole.v, whole.faces, whole.n, facet, self.rows[r], *(x[r] for x in rest))

        parallel_for(begin, corners)
        parallel_for(len(self.rows), middles)

    def __call__(self, net: Net, heir: Ints, limits: Limits) -> tuple[float, float]:
        """Return how far points of the surface may be off [m], and how far off points are in place or normal over the
        limit, at most; heir (m,) the last heir of each facet of the net."""
        live = np.flatnonzero(net.faces[:, 0] >= 0)
        number = np.zeros(len(net.faces), np.int32)
        number[live] = np.arange(len(live))
        drawn, own = np.empty((3, len(live), 3, 3)), (net.v, net.n, net.faces, net.corner)
        parallel_for(len(live), lambda r: patches(own, live[r], *drawn[:, r]))
        shape = heir, tuple(drawn), net.mate, number, self._same(net)
        most = limits.deviation, limits.normal
        ends = list[tuple[float, float]]()

        def some(r: slice) -> None:
            points = self._place[r], self._normal[r], self._facet[r]
            ends.append(offsets(*points, shape, most, self._found[r], self._off[r], self._excess[r]))

        parallel_for(len(self._facet), some)
        self._last = net
        return max((off for off, _ in ends), default=0.0), max((excess for _, excess in ends), default=0.0)

    def _same(self, net: Net) -> NDArray[np.bool_]:
        """Return which facets (m,) of a net are those of the net before, if both come of one."""
        if self._last is None:
            return np.zeros(len(net.faces), bool)
        faces, corner = net.faces == self._last.faces, net.corner == self._last.corner
        return np.asarray((faces & corner).all(axis=1))

    def taken(self, then: Ints, found: Ints | None = None) -> None:
        """Go on from another net, whose facets then (m,) are those in whose places the facets of this one are looked
        for; found (m,) the same of the net that was checked last, if it was by these points."""
        self._facet = then[self._facet] if found is None else found[self._found]
        # Numbers of facets of that net mean nothing in this one.
        self._found[:], self._last = 0, None

    @property
    def found(self) -> Ints:
        """The facet (s,) of the net checked last on which each point lies."""
        return self._found

    @property
    def failed(self) -> float:
        """The share of points that were off over the limits in the last check."""
        return float(np.mean(self._excess > 1.0))

    def shorten(self, net: Net, failed: Net, vertex: Ints, some: bool) -> None:
        """Shorten the edges that may come on a net where facets of what became of it failed, which was checked last.

        Args: vertex (k,) numbers in the whole mesh of the net's vertices, ascending; some: whether any may come at all.
        """
        bad = np.flatnonzero(self._excess > 1.0)
        worst = np.zeros(len(net.faces))
        np.maximum.at(worst, self._found[bad], self._excess[bad])
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
        # The vertices that lie on these facets, those among them that the net still has.
        on = np.flatnonzero(worst[self._found[: len(self.vertex)]] > 1.0)
        at = np.minimum(np.searchsorted(vertex, self.vertex[on]), len(vertex) - 1)
        here = vertex[at] == self.vertex[on]
        at, own = at[here], on[here]
        net.reach[at] = np.minimum(net.reach[at], allowed[self._found[own]])
