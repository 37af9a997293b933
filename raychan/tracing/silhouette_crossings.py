"""Silhouette edges between a tube's mirror and the surface where it lands: where they cross the tube, it is clipped.

After a mirror each tube has a source of its own, so silhouettes cannot be found once for all. All edges that can be a
silhouette lie in a grid of cubes; each tube passes through the cells between its mirror and its landing, layer by layer
across the axis along which it runs most, and tests the edges that it finds there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

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
from raychan.records import MIRROR
from raychan.tracing.cache import cache_of
from raychan.tracing.edge_crossings import FacetPlanes, above, apart, pyramid, scale_at, size_of, within
from raychan.vectors import copy_to, dot
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_MOST_CELLS = 2_000_000  # of a grid: trades memory for edges a cell; not measured
_LEAST_CELL = 0.02  # m; not measured
_WIDEST_LAYER = 150  # cells in a layer beyond which a tube is bisected before it is searched; not measured
# Cells of width beyond which a fan with rays along the layers is not searched. Were fans cut short bisected as wide
# layers are, no level of three scenes at 0.5 dB, nor of 60 pairs of plates, would move by more than its error, for
# 0.1 %, -3 % and 7 % more rays (command not kept).
_WIDEST_FAN = 10
_TOUCHING = 1e-5  # m: what lies nearer to a surface belongs to it


class Outlines(NamedTuple):
    """All edges of a geometry that can be a silhouette, in a grid; extent [m] reach of rays that hit nothing; planes of
    the facets; centre (b, 3), radius (b,) [m] of spheres about bodies, outside of which there is no edge."""

    extent: float
    planes: FacetPlanes
    grid: EdgeGrid
    centre: Floats
    radius: Floats


def outlines_of(geometry: Geometry) -> Outlines:
    """Return the grid of a geometry's edges, built once."""
    return cache_of(geometry).single("outlines", lambda: _outlines(geometry))


def _outlines(geometry: Geometry) -> Outlines:
    planes = FacetPlanes(geometry.plane, geometry.first, geometry.normal)
    centre, radius, empty = geometry.body_spheres
    solid = ~empty & (geometry.facets.role != MIRROR)
    return Outlines(geometry.extent, planes, _grid_of(geometry), centre[solid], radius[solid])


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


@njit(cache=True, forceinline=True, uncounted=True)
def _steepest(k):  # type: ignore[no-untyped-def]
    """Return the axis along which a ray runs most."""
    axis = 0
    for c in range(1, 3):
        axis = c if abs(k[c]) > abs(k[axis]) else axis
    return axis


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def longest_crossing(i, tag, rays, far, outlines, out, tested, room):  # type: ignore[no-untyped-def]
    """Write into out (3,) the distances [m] of the corners of tube i from the plane through its source and the
    silhouette edge of which the longest part lies inside it; return whether it is too wide to be searched to its end.

    Args: tag a number of this search, tested (e,) that of the last one for each edge; rays as `TubeRays`; far whether
    they come from a direction instead of a point; outlines as `Outlines`; room (9, 3) for work.
    """
    planes, grid = outlines.planes, outlines.grid
    source, sides, section, side = room[0], room[1:4], room[4:8], room[8]
    points, ks, facet = rays.points[i], rays.directions[i], rays.hit[i, 3]
    k, lands, parallel = ks[3], facet >= 0, far or not rays.flat[i]
    for c in range(3):
        source[c] = points[3, c] - rays.length[i, 3] * k[c]
    normal, landing = planes.normal[max(facet, 0)], planes.point[max(facet, 0)]
    sign = -1.0 if dot(k, normal) > 0.0 else 1.0
    ahead = pyramid(points, source, k, parallel, sides)
    for q in range(4):
        copy_to(section[q], points[q])
    x, y, z = (-k[0], -k[1], -k[2]) if parallel else (source[0], source[1], source[2])
    tube = points, ks, rays.flat[i], source, parallel, ahead, sides, section
    floor = lands, landing, normal, sign
    looks = x, y, z, 0.0 if parallel else 1.0
    reach = rays.reach[i, 3] if lands else outlines.extent
    span = _span(points, ks, reach, grid.cell, outlines.centre, outlines.radius)
    return _longest_along(tag, tube, floor, looks, span, grid, tested, side, out)


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _span(points, ks, reach, cell, centre, radius):  # type: ignore[no-untyped-def]
    """Return the axis along which a tube runs most, and from where to where [m], at most `reach`, it is searched."""
    k, (wide, spread) = ks[3], widths(points, ks)
    near, far_end = span_through_spheres(points, ks, wide, spread, reach, centre, radius)
    axis = _steepest(k)
    for q in range(3):
        if ks[q, axis] * math.copysign(1.0, k[axis]) <= ALONG:
            far_end = min(far_end, _WIDEST_FAN * cell / spread)
    return axis, near, far_end


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _longest_along(tag, tube, floor, looks, span, grid, tested, side, out):  # type: ignore[no-untyped-def]
    """Write into out (3,) the corners' distances from the edge of which the longest part lies inside a tube, layer by
    layer from the mirror on; return whether what is far off is left out, as the tube grows too wide."""
    points, ks = tube[0], tube[1]
    axis, near, far_end = span
    # Not constants: the compiler would make `layer_cells` anew for each of those.
    single, many = np.int64(1), np.int64(BLOCK)
    onward = ks[3, axis] > 0.0
    low_layer, high_layer = layer_range(points, ks, axis, near, far_end, grid)
    best, clear_until = 0.0, 0
    for s in range(high_layer - low_layer + 1 if far_end > near else 0):
        if s < clear_until:
            continue
        layer = low_layer + s if onward else high_layer - s
        if s % BLOCK == 0:
            block = layer if onward else layer - BLOCK + 1
            begin, end, _ = layer_cells(points, ks, axis, block, many, near, far_end, grid)
            if not any_occupied(grid.occupied, begin, end):
                clear_until = s + BLOCK
                continue
        begin, end, room = layer_cells(points, ks, axis, layer, single, near, far_end, grid)
        # The outermost layers of a grid that is cut off hold all that lies beyond: no width tells anything there.
        outermost = grid.cut_off and (layer == 0 or layer == grid.shape[axis] - 1)
        if room > _WIDEST_LAYER and not outermost:
            return True
        best = _longest_in_box(tag, tube, floor, looks, begin, end, grid, best, tested, side, out)
    return False


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _longest_in_box(tag, tube, floor, looks, begin, end, grid, best, tested, side, out):  # type: ignore[no-untyped-def]
    """Write into out (3,) the corners' distances from the edge in a box of cells of which a longer part than `best` [m]
    lies inside a tube; return how long.

    Args: floor see `_part_before`; looks (x, y, z, 1) a point from which edges are seen, or (x, y, z, 0) a direction.
    """
    x, y, z, w = looks
    for ci in range(begin[0], end[0]):
        for cj in range(begin[1], end[1] if end[2] > begin[2] else begin[1]):
            row = (ci * grid.shape[1] + cj) * grid.shape[2]
            for at in range(grid.first[row + begin[2]], grid.first[row + end[2]]):
                e = grid.entries[at]
                one, other = grid.planes[e, 0], grid.planes[e, 1]
                # An edge is a silhouette where its faces look to different sides of the source.
                front = one[0] * x + one[1] * y + one[2] * z - w * one[3] > 0.0
                if front != (other[0] * x + other[1] * y + other[2] * z - w * other[3] > 0.0) and tested[e] != tag:
                    tested[e] = tag
                    best = _longer(grid.edges[e, 0], grid.edges[e, 1], tube, floor, best, side, out)
    return best


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _longer(a, b, tube, floor, best, side, out):  # type: ignore[no-untyped-def]
    """Write into out (3,) the corners' distances from edge ab if a longer part of it than `best` [m] lies inside a
    tube; return how long."""
    points, ks, flat, source, parallel, ahead, sides, section = tube
    k, size = ks[3], size_of(a, b)
    begin, end = _part_before(a, b, points[3], k, floor)
    if (end - begin) * size <= best:
        return best
    if not flat:
        # Off a curved mirror rays count as parallel, in the section that the tube has here.
        depth = 0.0
        for c in range(3):
            depth += (a[c] + 0.5 * (begin + end) * (b[c] - a[c]) - points[3, c]) * k[c]
        for q in range(3):
            for c in range(3):
                section[q, c] = points[q, c] + depth * (ks[q, c] - k[c])
        pyramid(section, source, k, True, sides)
    begin, end = within(a, b, section, sides, scale_at(a, b, source, k, parallel, ahead), begin, end)
    part = (end - begin) * size
    if part > best and apart(a, b, section, source, k, parallel, side):
        copy_to(out, side)
        return part
    return best


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _part_before(a, b, middle, k, floor):  # type: ignore[no-untyped-def]
    """Return which part of edge ab, from begin to end (0 to 1), lies beyond the mirror and before the plane of landing:
    floor whether there is one, its point, its normal, and on which side of it the tube lies."""
    lands, landing, normal, sign = floor
    da, db, ha, hb = -_TOUCHING, -_TOUCHING, -_TOUCHING, -_TOUCHING
    for c in range(3):
        da += (a[c] - middle[c]) * k[c]
        db += (b[c] - middle[c]) * k[c]
        ha += sign * (a[c] - landing[c]) * normal[c]
        hb += sign * (b[c] - landing[c]) * normal[c]
    begin, end = above(da, db)
    low_end, high_end = above(ha, hb) if lands else (0.0, 1.0)
    return max(begin, low_end), min(end, high_end)
