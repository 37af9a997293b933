"""Shadows: where the outlines of bodies, as an end of the link sees them, cross the tubes behind them."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numba import njit
from numpy.typing import NDArray

from raychan.channel.edges import above, cross_into, dot, inside, starts_again
from raychan.channel.legs import Leg
from raychan.channel.surface import Surface
from raychan.kernels.rows import in_two

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MANY = 2000  # tubes from which on a second thread pays
_CELLS = 128  # along the longest side of the grid of directions


class Shadows:
    """The silhouette edges of all bodies as seen over one leg, in a grid of directions from the leg's last image."""

    def __init__(self, surface: Surface, leg: Leg) -> None:
        self.edges, self._smooth = _silhouette(surface, leg)
        if len(self.edges):
            a, b = (_directions(self.edges[:, i], leg) for i in range(2))
            low, high = np.minimum(a, b).min(axis=0), np.maximum(a, b).max(axis=0)
            cell = max(float((high - low).max()) / _CELLS, 1e-9)
            low -= 2.0 * cell
            shape = np.ceil((high - low) / cell).astype(np.int64) + 3
            self._grid = *_fill(self.edges, leg.image, leg.far, low, cell, shape), low, cell, shape
        self._from = leg.image, leg.far, surface.touch

    def across(self, points: Floats, normal: Floats, smooth: Ints, wanted: NDArray[np.bool_], slack: Floats) -> Floats:
        """Return signed distances (n, 3) [m] of tubes' corners from the longest shadow edge on each; zeros: none.

        Args: points (n, 4, 3) [m] corners and centres; normal (n, 3) of the planes they lie on; smooth (n,) the smooth
        patches they are of; wanted (n,) which tubes to look at; slack (n,) [m] in front of the plane that still belongs
        to its own patch.
        """
        if not len(self.edges):
            return np.zeros((len(points), 3))
        side = np.zeros((len(points), 3))

        def some(rows: slice) -> None:
            tubes = points[rows], normal[rows], smooth[rows], wanted[rows], slack[rows]
            shadows = *self._from, self.edges, self._smooth, *self._grid
            _across(*(*tubes, *shadows, side[rows]))

        in_two(len(points), some, _MANY)
        return side


def shadows_of(surface: Surface, leg: Leg) -> Shadows:
    """Return the shadows of a leg, made once for a surface."""
    known: WeakKeyDictionary[Leg, Shadows] = surface.shadows
    if leg not in known:
        known[leg] = Shadows(surface, leg)
    return known[leg]


def _silhouette(surface: Surface, leg: Leg) -> tuple[Floats, Ints]:
    """Return the edges (m, 2, 3) [m] at which a body turns away, and the rims of open sheets, in front of the last
    mirror; and the smooth patches (m, 2) that meet there."""
    half, pair = surface.turning(leg.image, leg.far)
    edges, smooth = surface.ends(half), surface.smooth[np.where(pair < 0, pair[:, ::-1], pair)]
    if leg.mirrors:
        m = leg.mirrors[-1]
        ahead = ((edges - m.point) @ m.normal > 0.0).any(axis=1)
        edges, smooth = edges[ahead], smooth[ahead]
    return np.ascontiguousarray(edges), np.ascontiguousarray(smooth)


def _directions(points: Floats, leg: Leg) -> Floats:
    """Return places (n, 3) on the unit sphere about the leg's image, or on the plane across a direction."""
    if leg.far:
        return points - np.outer(points @ leg.image, leg.image)
    return leg.rays(points)[0]


@njit(cache=True, inline="always")
def _place(p, image, far, out):  # type: ignore[no-untyped-def]
    if far:
        along = dot(p, image)
        for c in range(3):
            out[c] = p[c] - along * image[c]
    else:
        size = np.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)
        for c in range(3):
            out[c] = (p[c] - image[c]) / max(size, 1e-12)


@njit(cache=True, nogil=True)
def _fill(edges, image, far, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return the edges in each cell of the grid as (first, index): edges are walked in steps under half a cell."""
    total = shape[0] * shape[1] * shape[2]
    first = np.zeros(total + 1, np.int64)
    index = np.zeros(0, np.int32)
    p, x = np.empty(3), np.empty(3)
    for fill in range(2):
        last = np.full(total, -1, np.int32)
        for e in range(len(edges)):
            a, b = edges[e, 0], edges[e, 1]
            s, step = 0.0, 1.0
            while True:
                for c in range(3):
                    p[c] = a[c] + s * (b[c] - a[c])
                _place(p, image, far, x)
                i, j, k = int((x[0] - low[0]) / cell), int((x[1] - low[1]) / cell), int((x[2] - low[2]) / cell)
                at = (i * shape[1] + j) * shape[2] + k
                if 0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2] and last[at] != e:
                    last[at] = e
                    if fill == 0:
                        first[at + 1] += 1
                    else:
                        index[first[at]] = e
                        first[at] += 1
                if s >= 1.0:
                    break
                # A step turns by no more than its length over the distance.
                reach = 1.0
                if not far:
                    reach = np.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)
                size = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
                step = max(0.5 * cell * reach / max(size, 1e-12), 1e-4)
                s = min(1.0, s + step)
        if fill == 0:
            first = np.cumsum(first)
            index = np.empty(first[-1], np.int32)
    starts_again(first)
    return first, index


@njit(cache=True, nogil=True)
def _across(  # type: ignore[no-untyped-def]
    points, normal, smooth, wanted, slack, image, far, touch, edges, edge_smooth, first, index, low, cell, shape, out
):
    n = len(points)
    tried = np.full(len(edges), -1, np.int64)
    side, m, work, k = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    x, least, most = np.empty(3), np.empty(3), np.empty(3)
    for i in range(n):
        if not wanted[i]:
            continue
        centre = points[i, 3]
        for c in range(3):
            least[c], most[c] = np.inf, -np.inf
        for q in range(4):
            _place(points[i, q], image, far, x)
            for c in range(3):
                least[c], most[c] = min(least[c], x[c]), max(most[c], x[c])
        # The ray's direction at the centre, and the height of the plane towards the source.
        for c in range(3):
            k[c] = -image[c] if far else centre[c] - image[c]
        size = np.sqrt(dot(k, k))
        for c in range(3):
            k[c] /= size
        sign = -1.0 if dot(k, normal[i]) > 0.0 else 1.0
        bulge = 0.0 if far else 0.125 * np.sum((most - least) ** 2)
        margin = 0.5 * cell + bulge
        i0, i1 = _cells(least[0] - margin, most[0] + margin, low[0], cell, shape[0])
        j0, j1 = _cells(least[1] - margin, most[1] + margin, low[1], cell, shape[1])
        k0, k1 = _cells(least[2] - margin, most[2] + margin, low[2], cell, shape[2])
        best = 0.0
        for ci in range(i0, i1):
            for cj in range(j0, j1):
                start = (ci * shape[1] + cj) * shape[2]
                for at in range(first[start + k0], first[start + max(k1, k0)]):
                    e = index[at]
                    if tried[e] == i:
                        continue
                    tried[e] = i
                    a, b = edges[e, 0], edges[e, 1]
                    ha, hb = 0.0, 0.0
                    for c in range(3):
                        ha += sign * (a[c] - centre[c]) * normal[i, c]
                        hb += sign * (b[c] - centre[c]) * normal[i, c]
                    # Only what lies in front of the tube's plane throws a shadow on it.
                    own = edge_smooth[e, 0] == smooth[i] or edge_smooth[e, 1] == smooth[i]
                    near = slack[i] if own else min(slack[i], touch)
                    begin, end = above(ha - near, hb - near)
                    if begin == end:
                        continue
                    begin, end = inside(a, b, points[i], centre, image, k, far, begin, end, work)
                    length = (end - begin) * np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
                    if length <= best:
                        continue
                    if far:
                        cross_into(b - a, k, m)
                    else:
                        cross_into(b - a, image - a, m)
                    size = np.sqrt(dot(m, m))
                    if size == 0.0:
                        continue
                    lowest, highest = np.inf, -np.inf
                    for q in range(3):
                        f = 0.0
                        for c in range(3):
                            f += (points[i, q, c] - a[c]) * m[c]
                        side[q] = f / size
                        lowest, highest = min(lowest, side[q]), max(highest, side[q])
                    if lowest < 0.0 < highest:
                        best = length
                        out[i] = side


@njit(cache=True, inline="always")
def _cells(low_end, high_end, low, cell, count):  # type: ignore[no-untyped-def]
    return max(int((low_end - low) / cell), 0), min(int((high_end - low) / cell) + 1, count)
