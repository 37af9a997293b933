"""Shadow edges: where the silhouettes of bodies, as an end of the link sees them, fall on tubes behind them.

Seen from the last image of a leg, all silhouette edges lie in a plane grid of directions; a tube tests the edges in the
cells that it covers, and is clipped along the one of which the longest part falls on it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.edge_grid import grid_bounds, restore_starts
from raychan.tracing.cache import cache_of
from raychan.tracing.edge_crossings import above, apart, pyramid, scale_at, size_of, within
from raychan.tracing.legs import Leg
from raychan.vectors import copy_to, dot
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_LEGS_KEPT = 64  # of which the grids are kept; each takes a megabyte or two
_CELLS = 512  # along the longest side of the grid of directions: trades memory for edges a cell; not measured


class ShadowEdges(NamedTuple):
    """Silhouette edges (e, 2, 3) [m] as seen from an image (3,) [m] (a unit direction when far), the smooth patches
    (e, 2) that meet there, and the grid of directions: edges entries[first[i] : first[i + 1]] pass cell i; `axes` (2,)
    that the grid keeps of a direction's three coordinates, its corner low (2,), cell size and shape (2,)."""

    image: Floats
    far: bool
    edges: Floats
    smooth: Ints
    first: Ints
    entries: Ints
    axes: NDArray[np.int64]
    low: Floats
    cell: float
    shape: NDArray[np.int64]


def _shadows_of(geometry: Geometry, leg: Leg) -> ShadowEdges:
    """Return the silhouette edges of all bodies as seen over one leg, in a grid of directions from the leg's last
    image: of these the two coordinates that vary most."""
    edges, smooth = _silhouette(geometry, leg)
    image = np.asarray(leg.image, float)
    if not len(edges):
        nowhere = np.zeros(2, np.int32), np.zeros(0, np.int32), np.arange(2), np.zeros(2), 1.0, np.ones(2, np.int64)
        return ShadowEdges(image, leg.far, edges, smooth, *nowhere)
    low, high = _bounds(edges, image, leg.far)
    low, high, _ = grid_bounds(_directions_to(edges.mean(axis=1), image, leg.far), low, high)
    axes = np.sort(np.argsort(high - low, kind="stable")[1:])
    low, high = low[axes], high[axes]
    cell = max(float((high - low).max()) / _CELLS, 1e-9)
    low -= 2.0 * cell
    shape = np.ceil((high - low) / cell).astype(np.int64) + 3
    first, entries = _fill(edges, image, leg.far, axes, low, cell, shape)
    return ShadowEdges(image, leg.far, edges, smooth, first, entries, axes, low, cell, shape)


def shadow_edges_of(geometry: Geometry, leg: Leg) -> ShadowEdges:
    """Return the shadow edges of a leg, built once for all legs of the same last image and mirror."""
    last = (leg.mirrors[-1].facet, leg.mirrors[-1].normal.tobytes()) if leg.mirrors else None
    key = np.asarray(leg.image, float).tobytes(), leg.far, last
    return cache_of(geometry).newest("shadow edges", key, _LEGS_KEPT, lambda: _shadows_of(geometry, leg))


def _silhouette(geometry: Geometry, leg: Leg) -> tuple[Floats, Ints]:
    """Return the silhouette edges (m, 2, 3) [m] in front of the last mirror, boundary edges of open sheets among them,
    and the smooth patches (m, 2) that meet there."""
    half, pair = geometry.silhouette_edges(leg.image, leg.far)
    edges, smooth = geometry.ends(half), geometry.smooth[np.where(pair < 0, pair[:, ::-1], pair)]
    if leg.mirrors:
        m = leg.mirrors[-1]
        ahead = ((edges - m.point) @ m.normal > 0.0).any(axis=1)
        edges, smooth = edges[ahead], smooth[ahead]
    return np.ascontiguousarray(edges), np.ascontiguousarray(smooth)


@njit(cache=True, forceinline=True, uncounted=True)
def _direction_to(p, image, far, out):  # type: ignore[no-untyped-def]
    """Write the direction to p from the image, or where p lies in the plane across a direction [m]; return the distance
    [m], 1 when far."""
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
def _directions_to(points, image, far):  # type: ignore[no-untyped-def]
    """Return the directions (n, 3) of `_direction_to` for points (n, 3) [m]."""
    out = np.empty_like(points)
    for i in range(len(points)):
        _direction_to(points[i], image, far, out[i])
    return out


@njit(cache=True, nogil=True)
def _bounds(edges, image, far):  # type: ignore[no-untyped-def]
    """Return the bounds (3,) and (3,) of the directions to all ends of edges."""
    low, high, x = np.full(3, np.inf), np.full(3, -np.inf), np.empty(3)
    for e in range(len(edges)):
        for q in range(2):
            _direction_to(edges[e, q], image, far, x)
            for c in range(3):
                low[c], high[c] = min(low[c], x[c]), max(high[c], x[c])
    return low, high


@njit(cache=True, nogil=True)
def _fill(edges, image, far, axes, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return `first` and `entries` of `ShadowEdges`: edges are sampled in steps under half a cell."""
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
            reach = _direction_to(p, image, far, x)
            i, j = x[axes[0]] - low[0], x[axes[1]] - low[1]
            # What is beyond the grid belongs to its outermost cells.
            at = int(min(max(i / cell, 0.0), shape[0] - 1.0)) * shape[1] + int(min(max(j / cell, 0.0), shape[1] - 1.0))
            if last != at:
                last = at
                if count == len(cells):
                    few, theirs = cells, owner
                    cells, owner = np.empty(2 * count, few.dtype), np.empty(2 * count, theirs.dtype)
                    copy_to(cells[:count], few)
                    copy_to(owner[:count], theirs)
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
    restore_starts(first)
    return first, index


@njit(cache=True, nogil=True)
def longest_shadows(points, facet, slack, normals, smooth, touch, shadows, out):  # type: ignore[no-untyped-def]
    """Write into out (n, 3) the corners' distances from the plane of the edge whose shadow on each tube is longest.

    Zeros stay where there is none. Args: points (n, 4, 3) [m] corners and centres of tubes on facets (n,); slack (n,)
    [m] by which the tube's own smooth patch may lie before its facet; normals (f, 3), smooth (f,) of facets; touch [m]
    within which surfaces lie on each other; shadows as `ShadowEdges`.
    """
    tested, room, cells = np.full(len(shadows.edges), -1, np.int64), np.empty((8, 3)), np.empty((2, 2), np.int64)
    _each_longest_shadow(points, facet, slack, normals, smooth, touch, shadows, out, tested, room, cells)


@njit(cache=True, nogil=True, uncounted=True)
def _each_longest_shadow(points, facet, slack, normals, smooth, touch, shadows, out, tested, room, cells):  # type: ignore[no-untyped-def]
    """Do what `longest_shadows` does.

    Args: tested (e,) which tube was last tested against each edge; room (8, 3), cells (2, 2) for work.
    """
    image, far = shadows.image, shadows.far
    side, k, sides, x, least, most = room[0], room[1], room[2:5], room[5], room[6], room[7]
    for i in range(len(points)):
        centre, normal, patch = points[i, 3], normals[facet[i]], smooth[facet[i]]
        for c in range(3):
            k[c] = -image[c] if far else centre[c] - image[c]
        size = math.sqrt(dot(k, k))
        for c in range(3):
            k[c] /= size
        # Heights over the tube's plane count towards the source.
        sign = -1.0 if dot(k, normal) > 0.0 else 1.0
        level = sign * dot(centre, normal)
        _covered_cells(points[i], shadows, x, least, most, cells)
        here = pyramid(points[i], image, k, far, sides)
        best = 0.0
        for ci in range(cells[0, 0], cells[0, 1]):
            start = ci * shadows.shape[1]
            for at in range(shadows.first[start + cells[1, 0]], shadows.first[start + cells[1, 1]]):
                e = shadows.entries[at]
                if tested[e] == i:
                    continue
                tested[e] = i
                # Only what lies in front of the tube's plane throws a shadow on it.
                own = shadows.smooth[e, 0] == patch or shadows.smooth[e, 1] == patch
                near = level + (slack[i] if own else min(slack[i], touch))
                a, b = shadows.edges[e, 0], shadows.edges[e, 1]
                begin, end = above(sign * dot(a, normal) - near, sign * dot(b, normal) - near)
                if begin == end:
                    continue
                begin, end = within(a, b, points[i], sides, scale_at(a, b, image, k, far, here), begin, end)
                length = (end - begin) * size_of(a, b) if begin != end else 0.0
                if length > best and apart(a, b, points[i], image, k, far, side):
                    best = length
                    copy_to(out[i], side)


@njit(cache=True, forceinline=True, uncounted=True)
def _covered_cells(points, shadows, x, least, most, cells):  # type: ignore[no-untyped-def]
    """Write the cells that a tube (4, 3) covers, from and to on both axes of the grid (2, 2).

    Args: x, least, most (3,) for work.
    """
    for c in range(3):
        least[c], most[c] = np.inf, -np.inf
    for q in range(4):
        _direction_to(points[q], shadows.image, shadows.far, x)
        for c in range(3):
            least[c], most[c] = min(least[c], x[c]), max(most[c], x[c])
    # On the sphere of directions a tube's sides bulge by an eighth of their square.
    square = 0.0
    for c in range(3):
        square += (most[c] - least[c]) ** 2
    margin = 0.5 * shadows.cell + (0.0 if shadows.far else 0.125 * square)
    for j in range(2):
        axis = shadows.axes[j]
        begin = (least[axis] - margin - shadows.low[j]) / shadows.cell
        end = (most[axis] + margin - shadows.low[j]) / shadows.cell
        cells[j, 0] = int(min(max(begin, 0.0), shadows.shape[j] - 1.0))
        cells[j, 1] = int(min(max(end, 0.0), shadows.shape[j] - 1.0)) + 1
