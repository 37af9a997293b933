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
from raychan.geometry.curved_patches import copy_to
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
from raychan.tracing.edge_crossings import (
    FacetPlanes,
    TubeRays,
    above,
    apart,
    dot,
    pyramid,
    scale_at,
    size_of,
    within,
)
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


class _Tube(NamedTuple):
    """One tube in the search: its rays (4, 3), source (3,), whether there is one (flat) and whether rays count as
    parallel; whether its centre ray lands, on the plane through `point` of this `normal`, times `sign` towards the
    mirror; how far ahead [m] of the source it stands."""

    points: Floats
    directions: Floats
    source: Floats
    flat: bool
    parallel: bool
    lands: bool
    point: Floats
    normal: Floats
    sign: float
    ahead: float


class _Work(NamedTuple):
    """Arrays for work: the last tube that tested each edge (e,); normals of a tube's sides (3, 3), its section (4, 3),
    and distances of its corners (3,)."""

    tested: Ints
    sides: Floats
    section: Floats
    side: Floats


@njit(cache=True, forceinline=True)
def _steepest(k):  # type: ignore[no-untyped-def]
    """Return the axis along which a ray runs most."""
    axis = 0
    for c in range(1, 3):
        axis = c if abs(k[c]) > abs(k[axis]) else axis
    return axis


@njit(cache=True, forceinline=True)
def _part_between(a, b, tube):  # type: ignore[no-untyped-def]
    """Return from where to where (0 to 1) segment ab lies beyond a tube's mirror and before the plane of landing."""
    da, db, ha, hb = -_TOUCHING, -_TOUCHING, -_TOUCHING, -_TOUCHING
    centre, k = tube.points[3], tube.directions[3]
    for c in range(3):
        da += (a[c] - centre[c]) * k[c]
        db += (b[c] - centre[c]) * k[c]
        ha += tube.sign * (a[c] - tube.point[c]) * tube.normal[c]
        hb += tube.sign * (b[c] - tube.point[c]) * tube.normal[c]
    begin, end = above(da, db)
    low_end, high_end = above(ha, hb) if tube.lands else (0.0, 1.0)
    return max(begin, low_end), min(end, high_end)


@njit(cache=True, forceinline=True)
def _section_at(a, b, middle, tube, work):  # type: ignore[no-untyped-def]
    """Write the section of a tube off a curved mirror at a place of segment ab, with its sides: rays count as parallel,
    in the section that they have there."""
    depth = 0.0
    for c in range(3):
        depth += (a[c] + middle * (b[c] - a[c]) - tube.points[3, c]) * tube.directions[3, c]
    for q in range(3):
        for c in range(3):
            work.section[q, c] = tube.points[q, c] + depth * (tube.directions[q, c] - tube.directions[3, c])
    pyramid(work.section, tube.source, tube.directions[3], True, work.sides)


@njit(cache=True, forceinline=True)
def _length_inside(a, b, best, tube, work):  # type: ignore[no-untyped-def]
    """Return how long a part of segment ab [m] lies inside a tube, with the corners' distances in work.side; 0 if no
    longer than `best` [m] or if it does not part the corners."""
    begin, end = _part_between(a, b, tube)
    size = size_of(a, b)
    if (end - begin) * size <= best:
        return 0.0
    k = tube.directions[3]
    if not tube.flat:
        _section_at(a, b, 0.5 * (begin + end), tube, work)
    scale = scale_at(a, b, tube.source, k, tube.parallel, tube.ahead)
    begin, end = within(a, b, work.section, work.sides, scale, begin, end)
    part = (end - begin) * size
    if part > best and apart(a, b, work.section, tube.source, k, tube.parallel, work.side):
        return part
    return 0.0


@njit(cache=True, error_model="numpy")
def _search_cells(i, tube, grid, begin, end, best, work, out):  # type: ignore[no-untyped-def]
    """Return the longest part [m] of a silhouette edge inside tube i, of the edges in the cells from `begin` to `end`
    (3,) and of `best` [m] found before; write the corners' distances from a longer one into out (3,)."""
    k, w = tube.directions[3], 0.0 if tube.parallel else 1.0
    x = -k[0] if tube.parallel else tube.source[0]
    y = -k[1] if tube.parallel else tube.source[1]
    z = -k[2] if tube.parallel else tube.source[2]
    if end[2] <= begin[2]:
        return best
    for ci in range(begin[0], end[0]):
        for cj in range(begin[1], end[1]):
            row = (ci * grid.shape[1] + cj) * grid.shape[2]
            for at in range(grid.first[row + begin[2]], grid.first[row + end[2]]):
                e = grid.entries[at]
                # An edge is a silhouette where its faces look to different sides of the source.
                p, q = grid.planes[e, 0], grid.planes[e, 1]
                one = p[0] * x + p[1] * y + p[2] * z - w * p[3]
                other = q[0] * x + q[1] * y + q[2] * z - w * q[3]
                if (one > 0.0) == (other > 0.0) or work.tested[e] == i:
                    continue
                work.tested[e] = i
                part = _length_inside(grid.edges[e, 0], grid.edges[e, 1], best, tube, work)
                if part > best:
                    best = part
                    copy_to(out, work.side)
    return best


@njit(cache=True, error_model="numpy")
def _follow(i, tube, reach, grid, centre, radius, begin, end, work, out):  # type: ignore[no-untyped-def]
    """Follow tube i through the grid as far as `reach` [m]; write the corners' distances from the longest crossing into
    out (3,).

    Args: centre (b, 3), radius (b,) [m] of spheres about bodies, outside of which there is no edge; begin, end (3,) for
    work.
    """
    points, ks = tube.points, tube.directions
    k = ks[3]
    # Not constants: the compiler would make `layer_cells` anew for each of those.
    single, many = np.int64(1), np.int64(BLOCK)
    wide, spread = widths(points, ks)
    near, far_end = span_through_spheres(points, ks, wide, spread, reach, centre, radius)
    axis = _steepest(k)
    for q in range(3):
        if ks[q, axis] * math.copysign(1.0, k[axis]) <= ALONG:
            far_end = min(far_end, _WIDEST_FAN * grid.cell / spread)
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
            layer_cells(points, ks, axis, block, many, near, far_end, grid, begin, end)
            if not any_occupied(grid.occupied, begin, end):
                clear_until = s + BLOCK
                continue
        room = layer_cells(points, ks, axis, layer, single, near, far_end, grid, begin, end)
        # The outermost layers of a grid that is cut off hold all that lies beyond: no width tells anything there.
        if room > _WIDEST_LAYER and not (grid.cut_off and (layer == 0 or layer == grid.shape[axis] - 1)):
            break
        best = _search_cells(i, tube, grid, begin, end, best, work, out)


@njit(cache=True, nogil=True, error_model="numpy")
def _longest_crossings(rows, rays, far, extent, planes, grid, centre, radius, out):  # type: ignore[no-untyped-def]
    """Write into `rows` of out (n, 3) the corners' distances from the silhouette edge of which the longest part lies
    inside each tube. Args: as for `SilhouetteCrossings.find`; extent [m] reach of rays that hit nothing."""
    tested = np.full(len(grid.edges), -1, np.int32)
    source, work = np.empty(3), _Work(tested, np.empty((3, 3)), np.empty((4, 3)), np.empty(3))
    begin, end = np.empty(3, np.int64), np.empty(3, np.int64)
    for i in rows:
        points, k = rays.points[i], rays.directions[i, 3]
        lands, flat = rays.hit[i, 3] >= 0, rays.flat[i]
        parallel = far or not flat
        for c in range(3):
            source[c] = points[3, c] - rays.length[i, 3] * k[c]
        f = max(rays.hit[i, 3], 0)
        sign = -1.0 if dot(k, planes.normal[f]) > 0.0 else 1.0
        ahead = pyramid(points, source, k, parallel, work.sides)
        for q in range(4):
            copy_to(work.section[q], points[q])
        tube = _Tube(
            points, rays.directions[i], source, flat, parallel, lands, planes.point[f], planes.normal[f], sign, ahead
        )
        reach = rays.reach[i, 3] if lands else extent
        _follow(i, tube, reach, grid, centre, radius, begin, end, work, out[i])
