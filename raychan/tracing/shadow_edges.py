"""Shadows: where the outlines of bodies, as an end of the link sees them, cross the tubes behind them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import copy_to
from raychan.geometry.edge_grid import most_within, starts_again
from raychan.parallel import parallel_for
from raychan.tracing.edge_crossings import above, apart, dot, pyramid, scale_at, size_of, within
from raychan.tracing.legs import Leg
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MANY = 200  # tubes from which on a second thread pays
_KEPT = 64  # legs; each takes a megabyte or two
_CELLS = 512  # along the longest side of the grid of directions


class ShadowEdges:
    """The silhouette edges of all bodies as seen over one leg, in a grid of directions from the leg's last image: of
    these the two coordinates that vary most."""

    def __init__(self, geometry: Geometry, leg: Leg) -> None:
        self.edges, self._smooth = _silhouette(geometry, leg)
        self._from = geometry.normal, geometry.smooth, leg.image, leg.far, geometry.touch
        if len(self.edges):
            low, high = _bounds(self.edges, leg.image, leg.far)
            low, high, _ = most_within(_places(self.edges.mean(axis=1), leg.image, leg.far), low, high)
            axes = np.sort(np.argsort(high - low, kind="stable")[1:])
            low, high = low[axes], high[axes]
            cell = max(float((high - low).max()) / _CELLS, 1e-9)
            low -= 2.0 * cell
            shape = np.ceil((high - low) / cell).astype(np.int64) + 3
            self._grid = *_fill(self.edges, leg.image, leg.far, axes, low, cell, shape), axes, low, cell, shape

    def across(self, points: Floats, facet: Ints, slack: Floats) -> Floats:
        """Return signed distances (n, 3) [m] of tubes' corners from the longest shadow edge on each; zeros: none.

        Args: points (n, 4, 3) [m] corners and centres of tubes on facets (n,); slack (n,) [m] in front of a facet that
        still belongs to its own patch.
        """
        side = np.zeros((len(points), 3))
        if not len(self.edges):
            return side

        def some(rows: slice) -> None:
            shadows = *self._from, self.edges, self._smooth, *self._grid
            _across(*(points[rows], facet[rows], slack[rows], *shadows, side[rows]))

        parallel_for(len(points), some, _MANY)
        return side


def shadow_edges_of(geometry: Geometry, leg: Leg) -> ShadowEdges:
    """Return the shadows of a leg, made once for all legs of the same last image and mirror: a surface keeps the newest
    few."""
    last = (leg.mirrors[-1].facet, leg.mirrors[-1].normal.tobytes()) if leg.mirrors else None
    key = np.asarray(leg.image, float).tobytes(), leg.far, last
    known: dict[Any, ShadowEdges] = geometry.shadows
    with geometry.making:
        if key not in known:
            if len(known) >= _KEPT:
                del known[next(iter(known))]
            known[key] = ShadowEdges(geometry, leg)
        return known[key]


def _silhouette(geometry: Geometry, leg: Leg) -> tuple[Floats, Ints]:
    """Return the edges (m, 2, 3) [m] at which a body turns away, and the rims of open sheets, in front of the last
    mirror; and the smooth patches (m, 2) that meet there."""
    half, pair = geometry.turning(leg.image, leg.far)
    edges, smooth = geometry.ends(half), geometry.smooth[np.where(pair < 0, pair[:, ::-1], pair)]
    if leg.mirrors:
        m = leg.mirrors[-1]
        ahead = ((edges - m.point) @ m.normal > 0.0).any(axis=1)
        edges, smooth = edges[ahead], smooth[ahead]
    return np.ascontiguousarray(edges), np.ascontiguousarray(smooth)


@njit(cache=True, forceinline=True)
def _place(p, image, far, out):  # type: ignore[no-untyped-def]
    """Write the place of p on the unit sphere about the image, or on the plane across a direction; return how far off
    it lies [m]."""
    if far:
        along = dot(p, image)
        for c in range(3):
            out[c] = p[c] - along * image[c]
        return 1.0
    size = math.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)
    for c in range(3):
        out[c] = (p[c] - image[c]) / max(size, 1e-12)
    return size


@njit(cache=True, nogil=True)
def _places(points, image, far):  # type: ignore[no-untyped-def]
    """Return the places (n, 3) of points (n, 3) [m]."""
    out = np.empty_like(points)
    for i in range(len(points)):
        _place(points[i], image, far, out[i])
    return out


@njit(cache=True, nogil=True)
def _bounds(edges, image, far):  # type: ignore[no-untyped-def]
    """Return the least and the most (3,) of the places of all ends."""
    low, high, x = np.full(3, np.inf), np.full(3, -np.inf), np.empty(3)
    for e in range(len(edges)):
        for q in range(2):
            _place(edges[e, q], image, far, x)
            for c in range(3):
                low[c], high[c] = min(low[c], x[c]), max(high[c], x[c])
    return low, high


@njit(cache=True, nogil=True)
def _fill(edges, image, far, axes, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return the edges in each cell of the grid as (first, index): edges are walked in steps under half a cell."""
    first = np.zeros(shape[0] * shape[1] + 1, np.int32)
    cells, owner = np.empty(4 * len(edges), np.int32), np.empty(4 * len(edges), np.int32)
    count = 0
    p, x = np.empty(3), np.empty(3)
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        size = math.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
        s, last = 0.0, -1
        while True:
            for c in range(3):
                p[c] = a[c] + s * (b[c] - a[c])
            reach = _place(p, image, far, x)
            i, j = x[axes[0]] - low[0], x[axes[1]] - low[1]
            # What is beyond the grid belongs to its outermost cells.
            at = int(min(max(i / cell, 0.0), shape[0] - 1.0)) * shape[1] + int(min(max(j / cell, 0.0), shape[1] - 1.0))
            if last != at:
                last = at
                if count == len(cells):
                    cells, owner = np.append(cells, np.empty_like(cells)), np.append(owner, np.empty_like(owner))
                cells[count], owner[count] = at, e
                count += 1
                first[at + 1] += 1
            if s >= 1.0:
                break
            # A step turns by no more than its length over the distance.
            s = min(1.0, s + max(0.5 * cell * reach / max(size, 1e-12), 1e-4))
    for at in range(len(first) - 1):
        first[at + 1] += first[at]
    index = np.empty(count, np.int32)
    for j in range(count):
        index[first[cells[j]]] = owner[j]
        first[cells[j]] += 1
    starts_again(first)
    return first, index


@njit(cache=True, nogil=True)
def _across(  # type: ignore[no-untyped-def]
    points, facet, slack, normals, smooth, image, far, touch, edges, edge_smooth, first, index, axes, low, cell, shape,
    out,
):  # fmt: skip
    tried = np.full(len(edges), -1, np.int64)
    side, k, planes = np.empty(3), np.empty(3), np.empty((3, 3))
    x, least, most = np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(points)):
        centre, normal, patch = points[i, 3], normals[facet[i]], smooth[facet[i]]
        for c in range(3):
            least[c], most[c] = np.inf, -np.inf
        for q in range(4):
            _place(points[i, q], image, far, x)
            for c in range(3):
                least[c], most[c] = min(least[c], x[c]), max(most[c], x[c])
        # The ray's direction at the centre, and the height of the plane towards the source.
        for c in range(3):
            k[c] = -image[c] if far else centre[c] - image[c]
        size = math.sqrt(dot(k, k))
        for c in range(3):
            k[c] /= size
        sign = -1.0 if dot(k, normal) > 0.0 else 1.0
        level = sign * dot(centre, normal)
        edge_curvature = 0.0 if far else 0.125 * np.sum((most - least) ** 2)
        margin = 0.5 * cell + edge_curvature
        u, v = axes
        i0, i1 = _cells(least[u] - margin, most[u] + margin, low[0], cell, shape[0])
        j0, j1 = _cells(least[v] - margin, most[v] + margin, low[1], cell, shape[1])
        here = pyramid(points[i], image, k, far, planes)
        best = 0.0
        for ci in range(i0, i1):
            start = ci * shape[1]
            for at in range(first[start + j0], first[start + j1]):
                e = index[at]
                if tried[e] == i:
                    continue
                tried[e] = i
                a, b = edges[e, 0], edges[e, 1]
                # Only what lies in front of the tube's plane throws a shadow on it.
                own = edge_smooth[e, 0] == patch or edge_smooth[e, 1] == patch
                near = level + (slack[i] if own else min(slack[i], touch))
                begin, end = above(sign * dot(a, normal) - near, sign * dot(b, normal) - near)
                if begin == end:
                    continue
                begin, end = within(a, b, points[i], planes, scale_at(a, b, image, k, far, here), begin, end)
                if begin == end:
                    continue
                length = (end - begin) * size_of(a, b)
                if length <= best:
                    continue
                if apart(a, b, points[i], image, k, far, side):
                    best = length
                    copy_to(out[i], side)


@njit(cache=True, forceinline=True)
def _cells(low_end, high_end, low, cell, count):  # type: ignore[no-untyped-def]
    begin, end = (low_end - low) / cell, (high_end - low) / cell
    return int(min(max(begin, 0.0), count - 1.0)), int(min(max(end, 0.0), count - 1.0)) + 1
