"""Between: the silhouettes that stand between a tube's mirror and the surface on which it lands."""

from __future__ import annotations

import math
from weakref import proxy

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import copy_to
from raychan.geometry.edge_grid import fill_grid, most_within, packed
from raychan.geometry.grid_traversal import ALONG, BLOCK, crowded, layer, layers, span, widths
from raychan.parallel import parallel_for
from raychan.records import MIRROR
from raychan.tracing.edge_crossings import above, apart, dot, pyramid, scale_at, size_of, within
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_MOST_CELLS = 2_000_000
_LEAST_CELL = 0.02  # m
_WIDE = 150  # cells in a layer beyond which a tube is halved before anyone asks what stands in it
_ABREAST = 10  # cells beyond which this holds for a fan of rays of which some run along the layers
_MANY = 500  # tubes from which on a second thread pays
_CLEAR = 1e-5  # m: what lies nearer to a surface belongs to it


class SilhouetteCrossings:
    """Every edge that can be an outline, in a grid of cubes; tubes walk through it from mirror to landing."""

    def __init__(self, geometry: Geometry) -> None:
        # The surface holds this: a reference back would keep both until the garbage collector comes by.
        self.geometry = proxy(geometry)
        ends = geometry.edge_ends
        low, high = (ends.min(axis=(0, 1)), ends.max(axis=(0, 1))) if len(ends) else (np.zeros(3), np.ones(3))
        low, high, self.cut_off = most_within(ends.mean(axis=1), low, high)
        volume = float(np.prod(high - low + _LEAST_CELL))
        self.cell = max(_LEAST_CELL, (volume / _MOST_CELLS) ** (1.0 / 3.0))
        self.low = low - self.cell
        self.shape = np.ceil((high - self.low) / self.cell).astype(np.int64) + 2
        self.first, self.index = fill_grid(ends, self.low, self.cell, self.shape)
        self.edges, self.planes = packed(self.index, ends, geometry.edge_faces, geometry.normal)
        held = np.flatnonzero(np.diff(self.first))
        blocks = np.stack(np.unravel_index(held, tuple(self.shape))) // BLOCK
        self.crowd = np.zeros(tuple(self.shape // BLOCK + 1), np.bool_)
        self.crowd[tuple(blocks)] = True
        centre, radius, empty = geometry.balls
        solid = ~empty & (geometry.facets.role != MIRROR)
        self.centre, self.radius = centre[solid], radius[solid]

    def across(
        self,
        rows: NDArray[np.signedinteger],
        points: Floats,
        k: Floats,
        length: Floats,
        far: bool,
        flat: Bools,
        hit: Ints,
        reach: Floats,
        side: Floats,
    ) -> None:
        """Fill in those `rows` of side (n, 3) that are zero: corners' distances [m] from the longest shadow edge on a
        tube.

        Args: points (n, 4, 3) [m] footprints; k (n, 4, 3) directions after reflection, from a source length (n, 4) [m]
        behind where all mirrors were flat (n,); hit (n, 4) facets on which rays land, -1 for none, after reach
        (n, 4) [m].
        """
        s = self.geometry
        rows = rows[~side[rows].any(axis=1)]

        def some(part: slice) -> None:
            _across(
                rows[part], points, k, length, far, flat, hit, reach, s.extent, s.first, s.normal,
                self.edges, self.planes, self.first, self.index, self.low, self.cell, self.shape, self.cut_off,
                self.crowd, self.centre, self.radius, side,
            )  # fmt: skip

        parallel_for(len(rows), some, _MANY)


def between(geometry: Geometry) -> SilhouetteCrossings:
    """Return the grid of a surface's edges, made once."""
    with geometry.making:
        if geometry.between is None:
            geometry.between = SilhouetteCrossings(geometry)
    found: SilhouetteCrossings = geometry.between
    return found


@njit(cache=True, forceinline=True)
def _steepest(k):  # type: ignore[no-untyped-def]
    """Return the axis along which a ray runs most."""
    axis = 0
    for c in range(1, 3):
        axis = c if abs(k[c]) > abs(k[axis]) else axis
    return axis


@njit(cache=True, nogil=True, error_model="numpy")
def _across(  # type: ignore[no-untyped-def]
    rows, points, ks, length, far, flat, hit, reach, extent, first_point, normal, edges, sheets, first, index, low,
    cell, shape, cut_off, crowd, ball, radius, out,
):  # fmt: skip
    tried = np.full(len(edges), -1, np.int32)
    side, source, planes, section = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((4, 3))
    begin_cell, end_cell = np.empty(3, np.int64), np.empty(3, np.int64)
    # Not constants: for each of those the compiler would make `layer` anew.
    single, many = np.int64(1), np.int64(BLOCK)
    for i in rows:
        centre, k = points[i, 3], ks[i, 3]
        lands = hit[i, 3] >= 0
        parallel = far or not flat[i]
        for c in range(3):
            source[c] = centre[c] - length[i, 3] * k[c]
        plane, at_plane = normal[max(hit[i, 3], 0)], first_point[max(hit[i, 3], 0)]
        sign = -1.0 if dot(k, plane) > 0.0 else 1.0
        here = pyramid(points[i], source, k, parallel, planes)
        for q in range(4):
            copy_to(section[q], points[i, q])
        wide, spread = widths(points[i], ks[i])
        far_end = reach[i, 3] if lands else extent
        begin_at, end_at = span(points[i], ks[i], wide, spread, far_end, ball, radius)
        axis = _steepest(k)
        for q in range(3):
            if ks[i, q, axis] * math.copysign(1.0, k[axis]) <= ALONG:
                end_at = min(end_at, _ABREAST * cell / spread)
        (x, y, z), w = (-k, 0.0) if parallel else (source, 1.0)
        best = 0.0
        low_layer, high_layer = layers(points[i], ks[i], axis, begin_at, end_at, low, cell, shape, cut_off)
        count = high_layer - low_layer + 1 if end_at > begin_at else 0
        clear_until = 0
        for s in range(count):
            if s < clear_until:
                continue
            # From the mirror on: what is far off is left out where the tube grows too wide.
            at_layer = low_layer + s if k[axis] > 0.0 else high_layer - s
            if s % BLOCK == 0:
                block = at_layer if k[axis] > 0.0 else at_layer - BLOCK + 1
                layer(
                    points[i], ks[i], axis, block, many, begin_at, end_at, low, cell, shape, cut_off, begin_cell,
                    end_cell,
                )  # fmt: skip
                if not crowded(crowd, begin_cell, end_cell):
                    clear_until = s + BLOCK
                    continue
            room = layer(
                points[i], ks[i], axis, at_layer, single, begin_at, end_at, low, cell, shape, cut_off, begin_cell,
                end_cell,
            )  # fmt: skip
            # The outermost layers of a grid that is cut off hold all that lies beyond: no width tells anything there.
            if room > _WIDE and not (cut_off and (at_layer == 0 or at_layer == shape[axis] - 1)):
                break
            for ci in range(begin_cell[0], end_cell[0]):
                for cj in range(begin_cell[1], end_cell[1]):
                    row = (ci * shape[1] + cj) * shape[2]
                    if end_cell[2] <= begin_cell[2]:
                        continue
                    for at in range(first[row + begin_cell[2]], first[row + end_cell[2]]):
                        e = index[at]
                        # An edge is an outline where its faces look to different sides of the source.
                        one = sheets[e, 0, 0] * x + sheets[e, 0, 1] * y + sheets[e, 0, 2] * z - w * sheets[e, 0, 3]
                        other = sheets[e, 1, 0] * x + sheets[e, 1, 1] * y + sheets[e, 1, 2] * z - w * sheets[e, 1, 3]
                        if (one > 0.0) == (other > 0.0) or tried[e] == i:
                            continue
                        tried[e] = i
                        a, b = edges[e, 0], edges[e, 1]
                        # The part beyond the mirror, and before the plane of landing.
                        da, db, ha, hb = -_CLEAR, -_CLEAR, -_CLEAR, -_CLEAR
                        for c in range(3):
                            da += (a[c] - centre[c]) * k[c]
                            db += (b[c] - centre[c]) * k[c]
                            ha += sign * (a[c] - at_plane[c]) * plane[c]
                            hb += sign * (b[c] - at_plane[c]) * plane[c]
                        begin, end = above(da, db)
                        low_end, high_end = above(ha, hb) if lands else (0.0, 1.0)
                        begin, end = max(begin, low_end), min(end, high_end)
                        size = size_of(a, b)
                        if (end - begin) * size <= best:
                            continue
                        if not flat[i]:
                            # Off a curved mirror the rays count as parallel, in the section that they have here.
                            depth = 0.0
                            for c in range(3):
                                depth += (a[c] + 0.5 * (begin + end) * (b[c] - a[c]) - centre[c]) * k[c]
                            for q in range(3):
                                for c in range(3):
                                    section[q, c] = points[i, q, c] + depth * (ks[i, q, c] - k[c])
                            pyramid(section, source, k, True, planes)
                        scale = scale_at(a, b, source, k, parallel, here)
                        begin, end = within(a, b, section, planes, scale, begin, end)
                        part = (end - begin) * size
                        if part > best and apart(a, b, section, source, k, parallel, side):
                            best = part
                            copy_to(out[i], side)
