"""Silhouette edges between a tube's mirror and the surface where it lands: where they cross the tube, it is clipped.

After a mirror each tube has a source of its own, so silhouettes cannot be found once for all. All edges that can be a
silhouette lie in a grid of cubes; each tube passes through the cells between its mirror and its landing, layer by layer
across the axis along which it runs most, and tests the edges that it finds there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.edge_grid import EdgeGrid, fill_grid, grid_bounds, pack_edges
from raychan.geometry.grid_traversal import (
    ALONG,
    BLOCK,
    any_occupied,
    layer_cells,
    layer_range,
    span_through_spheres,
    widths,
)
from raychan.parallel import parallel_for
from raychan.records import MIRROR
from raychan.tracing.cache import cache_of
from raychan.tracing.edge_crossings import FacetPlanes, TubeRays, above, apart, pyramid, scale_at, size_of, within
from raychan.vectors import copy_to, dot
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MOST_CELLS = 2_000_000  # of a grid: trades memory for edges a cell; not measured
_LEAST_CELL = 0.02  # m; not measured
_WIDEST_LAYER = 150  # cells in a layer beyond which a tube is taken to be bisected before; not measured
_WIDEST_FAN = 10  # cells of width beyond which the same holds for a fan with rays along the layers; not measured
_PARALLEL_FROM = 500  # tubes from which on a second thread pays; not measured
_TOUCHING = 1e-5  # m: what lies nearer to a surface belongs to it


class SilhouetteCrossings:
    """The grid of all edges of a geometry that can be a silhouette, and the search in it."""

    def __init__(self, geometry: Geometry) -> None:
        self._planes = FacetPlanes(geometry.plane, geometry.first, geometry.normal)
        self._extent = geometry.extent
        self._grid = _grid_of(geometry)
        centre, radius, empty = geometry.body_spheres
        solid = ~empty & (geometry.facets.role != MIRROR)
        self._centre, self._radius = centre[solid], radius[solid]

    def find(self, rows: NDArray[np.signedinteger], rays: TubeRays, far: bool, side: Floats) -> None:
        """Fill in those `rows` of side (n, 3) that are zero: distances [m] of a tube's corners from the plane through
        its source and the silhouette edge of which the longest part lies inside it.

        Args: far whether rays come from a direction instead of a point.
        """
        rows = rows[~side[rows].any(axis=1)]

        def some(part: slice) -> None:
            _longest_crossings(
                rows[part], rays, far, self._extent, self._planes, self._grid, self._centre, self._radius, side
            )

        parallel_for(len(rows), some, _PARALLEL_FROM)


def silhouette_crossings_of(geometry: Geometry) -> SilhouetteCrossings:
    """Return the grid of a geometry's edges, built once."""
    return cache_of(geometry).single("silhouette crossings", lambda: SilhouetteCrossings(geometry))


def _grid_of(geometry: Geometry) -> EdgeGrid:
    """Return the edges of a geometry that can be a silhouette in a grid of cubes."""
    ends = geometry.edge_ends
    low, high = (ends.min(axis=(0, 1)), ends.max(axis=(0, 1))) if len(ends) else (np.zeros(3), np.ones(3))
    low, high, cut_off = grid_bounds(ends.mean(axis=1), low, high)
    volume = float(np.prod(high - low + _LEAST_CELL))
    cell = max(_LEAST_CELL, (volume / _MOST_CELLS) ** (1.0 / 3.0))
    low = low - cell
    shape = np.ceil((high - low) / cell).astype(np.int64) + 2
    first, index = fill_grid(ends, low, cell, shape)
    edges, planes = pack_edges(index, ends, geometry.edge_faces, geometry.normal)
    held = np.flatnonzero(np.diff(first))
    blocks = np.stack(np.unravel_index(held, tuple(shape))) // BLOCK
    occupied = np.zeros(tuple(shape // BLOCK + 1), np.bool_)
    occupied[tuple(blocks)] = True
    return EdgeGrid(edges, planes, first, index, low, cell, shape, bool(cut_off), occupied)


@njit(cache=True, forceinline=True)
def _steepest(k):  # type: ignore[no-untyped-def]
    """Return the axis along which a ray runs most."""
    axis = 0
    for c in range(1, 3):
        axis = c if abs(k[c]) > abs(k[axis]) else axis
    return axis


@njit(cache=True, nogil=True, error_model="numpy")
def _longest_crossings(rows, rays, far, extent, planes, grid, centre, radius, out):  # type: ignore[no-untyped-def]
    """Write into `rows` of out (n, 3) the corners' distances from the silhouette edge of which the longest part lies
    inside each tube. Args: as for `SilhouetteCrossings.find`; extent [m] reach of rays that hit nothing; centre (b, 3),
    radius (b,) [m] of spheres about bodies, outside of which there is no edge."""
    # Arrays are taken out of the tuples once, and the loop is one function: each access, and each call with arrays,
    # counts references, which makes the loop 2.7 times slower.
    all_points, all_directions, length, flat, hit, reach = rays
    _, plane_point, plane_normal = planes
    edges, edge_planes, first, entries, _, cell, shape, cut_off, occupied = grid
    tested = np.full(len(edges), -1, np.int32)
    side, source, sides, section = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((4, 3))
    begin_cell, end_cell = np.empty(3, np.int64), np.empty(3, np.int64)
    # Not constants: the compiler would make `layer_cells` anew for each of those.
    single, many = np.int64(1), np.int64(BLOCK)
    for i in rows:
        points, ks = all_points[i], all_directions[i]
        middle, k = points[3], ks[3]
        lands = hit[i, 3] >= 0
        parallel = far or not flat[i]
        for c in range(3):
            source[c] = middle[c] - length[i, 3] * k[c]
        normal, landing = plane_normal[max(hit[i, 3], 0)], plane_point[max(hit[i, 3], 0)]
        sign = -1.0 if dot(k, normal) > 0.0 else 1.0
        ahead = pyramid(points, source, k, parallel, sides)
        for q in range(4):
            copy_to(section[q], points[q])
        wide, spread = widths(points, ks)
        far_end = reach[i, 3] if lands else extent
        near, far_end = span_through_spheres(points, ks, wide, spread, far_end, centre, radius)
        axis = _steepest(k)
        for q in range(3):
            if ks[q, axis] * math.copysign(1.0, k[axis]) <= ALONG:
                far_end = min(far_end, _WIDEST_FAN * cell / spread)
        (x, y, z), w = (-k, 0.0) if parallel else (source, 1.0)
        best = 0.0
        low_layer, high_layer = layer_range(points, ks, axis, near, far_end, grid)
        count = high_layer - low_layer + 1 if far_end > near else 0
        clear_until = 0
        for s in range(count):
            if s < clear_until:
                continue
            # From the mirror on: what is far off is left out where the tube grows too wide.
            layer = low_layer + s if k[axis] > 0.0 else high_layer - s
            if s % BLOCK == 0:
                block = layer if k[axis] > 0.0 else layer - BLOCK + 1
                layer_cells(points, ks, axis, block, many, near, far_end, grid, begin_cell, end_cell)
                if not any_occupied(occupied, begin_cell, end_cell):
                    clear_until = s + BLOCK
                    continue
            room = layer_cells(points, ks, axis, layer, single, near, far_end, grid, begin_cell, end_cell)
            # The outermost layers of a grid that is cut off hold all that lies beyond: no width tells anything there.
            if room > _WIDEST_LAYER and not (cut_off and (layer == 0 or layer == shape[axis] - 1)):
                break
            for ci in range(begin_cell[0], end_cell[0]):
                for cj in range(begin_cell[1], end_cell[1]):
                    row = (ci * shape[1] + cj) * shape[2]
                    if end_cell[2] <= begin_cell[2]:
                        continue
                    for at in range(first[row + begin_cell[2]], first[row + end_cell[2]]):
                        e = entries[at]
                        # An edge is a silhouette where its faces look to different sides of the source.
                        one = edge_planes[e, 0, 0] * x + edge_planes[e, 0, 1] * y + edge_planes[e, 0, 2] * z
                        other = edge_planes[e, 1, 0] * x + edge_planes[e, 1, 1] * y + edge_planes[e, 1, 2] * z
                        one, other = one - w * edge_planes[e, 0, 3], other - w * edge_planes[e, 1, 3]
                        if (one > 0.0) == (other > 0.0) or tested[e] == i:
                            continue
                        tested[e] = i
                        # As numbers: parts of an array would count references, which several threads wait for.
                        a = edges[e, 0, 0], edges[e, 0, 1], edges[e, 0, 2]
                        b = edges[e, 1, 0], edges[e, 1, 1], edges[e, 1, 2]
                        # The part beyond the mirror, and before the plane of landing.
                        da, db, ha, hb = -_TOUCHING, -_TOUCHING, -_TOUCHING, -_TOUCHING
                        for c in range(3):
                            da += (a[c] - middle[c]) * k[c]
                            db += (b[c] - middle[c]) * k[c]
                            ha += sign * (a[c] - landing[c]) * normal[c]
                            hb += sign * (b[c] - landing[c]) * normal[c]
                        begin, end = above(da, db)
                        low_end, high_end = above(ha, hb) if lands else (0.0, 1.0)
                        begin, end = max(begin, low_end), min(end, high_end)
                        size = size_of(a, b)
                        if (end - begin) * size <= best:
                            continue
                        if not flat[i]:
                            # Off a curved mirror rays count as parallel, in the section that the tube has here.
                            depth = 0.0
                            for c in range(3):
                                depth += (a[c] + 0.5 * (begin + end) * (b[c] - a[c]) - middle[c]) * k[c]
                            for q in range(3):
                                for c in range(3):
                                    section[q, c] = points[q, c] + depth * (ks[q, c] - k[c])
                            pyramid(section, source, k, True, sides)
                        scale = scale_at(a, b, source, k, parallel, ahead)
                        begin, end = within(a, b, section, sides, scale, begin, end)
                        part = (end - begin) * size
                        if part > best and apart(a, b, section, source, k, parallel, side):
                            best = part
                            copy_to(out[i], side)
