"""Between: the silhouettes that stand between a tube's mirror and the surface on which it lands."""

from __future__ import annotations

from weakref import proxy

import numpy as np
from numpy.typing import NDArray

from raychan.channel.edges import above, cross_into, dot, inside, starts_again
from raychan.channel.surface import Surface
from raychan.kernels.jit import njit
from raychan.kernels.rows import in_two
from raychan.tables import MIRROR

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_MOST_CELLS = 2_000_000
_LEAST_CELL = 0.02  # m
_BLOCK = 8  # cells a side that are passed over at once where they hold no edge
_WIDE = 1000  # cells abreast beyond which a tube is halved before anyone asks what stands in it
_MANY = 500  # tubes from which on a second thread pays
_CLEAR = 1e-5  # m: what lies nearer to a surface belongs to it


class Between:
    """Every edge that can be an outline, in a grid of cubes; tubes walk through it from mirror to landing."""

    def __init__(self, surface: Surface) -> None:
        # The surface holds this: a reference back would keep both until the garbage collector comes by.
        self.surface = proxy(surface)
        ends = surface.edge_ends
        low, high = (ends.min(axis=(0, 1)), ends.max(axis=(0, 1))) if len(ends) else (np.zeros(3), np.ones(3))
        volume = float(np.prod(high - low + _LEAST_CELL))
        self.cell = max(_LEAST_CELL, (volume / _MOST_CELLS) ** (1.0 / 3.0))
        self.low = low - self.cell
        self.shape = np.ceil((high - self.low) / self.cell).astype(np.int64) + 2
        self.first, self.index = _fill(ends, self.low, self.cell, self.shape)
        held = np.flatnonzero(np.diff(self.first))
        blocks = np.stack(np.unravel_index(held, tuple(self.shape))) // _BLOCK
        self.crowd = np.zeros(tuple(self.shape // _BLOCK + 1), np.bool_)
        self.crowd[tuple(blocks)] = True
        centre, radius, empty = surface.balls
        solid = ~empty & (surface.facets.role != MIRROR)
        self.centre, self.radius = centre[solid], radius[solid]

    def across(
        self,
        points: Floats,
        k: Floats,
        source: Floats,
        far: bool,
        flat: Bools,
        hit: Ints,
        reach: Floats,
        side: Floats,
    ) -> None:
        """Fill in rows of side (n, 3) that are zero: corners' distances [m] from the longest shadow edge on a tube.

        Args: points (n, 4, 3) [m] footprints; k (n, 4, 3) directions after reflection, from a source (n, 3) [m] where
        all mirrors were flat (n,); hit (n,) facet on which the centre lands, -1 for none, after reach (n,) [m].
        """
        s = self.surface

        def some(rows: slice) -> None:
            _across(
                points[rows], k[rows], source[rows], far, flat[rows], hit[rows], reach[rows],
                s.edge_ends, s.edge_faces, s.first, s.normal, self.first, self.index, self.low, self.cell, self.shape,
                self.crowd, self.centre, self.radius, side[rows],
            )  # fmt: skip

        in_two(len(points), some, _MANY)


def between(surface: Surface) -> Between:
    """Return the grid of a surface's edges, made once."""
    with surface.making:
        if surface.between is None:
            surface.between = Between(surface)
    found: Between = surface.between
    return found


@njit(cache=True, nogil=True)
def _fill(ends, low, cell, shape):  # type: ignore[no-untyped-def]
    """Return the edges in each cell as (first, index): edges are walked in steps of half a cell."""
    total = shape[0] * shape[1] * shape[2]
    first = np.zeros(total + 1, np.int64)
    index = np.zeros(0, np.int32)
    for fill in range(2):
        for e in range(len(ends)):
            a, b = ends[e, 0], ends[e, 1]
            size = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
            steps = int(2.0 * size / cell) + 1
            last = -1
            for s in range(steps + 1):
                t = s / steps
                i = int((a[0] + t * (b[0] - a[0]) - low[0]) / cell)
                j = int((a[1] + t * (b[1] - a[1]) - low[1]) / cell)
                k = int((a[2] + t * (b[2] - a[2]) - low[2]) / cell)
                at = (i * shape[1] + j) * shape[2] + k
                if at == last:
                    continue
                last = at
                if fill == 0:
                    first[at + 1] += 1
                else:
                    index[first[at]] = e
                    first[at] += 1
        if fill == 0:
            first = np.cumsum(first)
            index = np.empty(first[-1], np.int32)
    starts_again(first)
    return first, index


@njit(cache=True, inline="always")
def _outline(faces, source, k, far, first, normal):  # type: ignore[no-untyped-def]
    """Tell whether the faces of an edge look to different sides as seen from the source."""
    if faces[1] < 0:
        return True
    front = 0
    for f in range(2):
        look = 0.0
        for c in range(3):
            look += normal[faces[f], c] * (-k[c] if far else source[c] - first[faces[f], c])
        front += 1 if look > 0.0 else 0
    return front == 1


@njit(cache=True, inline="always")
def _span(points, ks, reach, ball, radius):  # type: ignore[no-untyped-def]
    """Return from where to where (to `reach`) a tube passes through the balls about bodies; equal: nowhere."""
    wide, spread = 0.0, 0.0
    for q in range(3):
        a, b = 0.0, 0.0
        for c in range(3):
            a += (points[q, c] - points[3, c]) ** 2
            b += (ks[q, c] - ks[3, c]) ** 2
        wide, spread = max(wide, a), max(spread, b)
    wide, spread = np.sqrt(wide), np.sqrt(spread)
    begin, end = np.inf, 0.0
    for j in range(len(ball)):
        along, apart = 0.0, 0.0
        for c in range(3):
            d = ball[j, c] - points[3, c]
            along += d * ks[3, c]
            apart += d * d
        size = radius[j] + wide + spread * max(along, 0.0)
        room = size * size - (apart - along * along)
        if room <= 0.0:
            continue
        half = np.sqrt(room)
        if along + half <= 0.0:
            continue
        begin, end = min(begin, max(along - half, 0.0)), max(end, along + half)
    end = min(end, reach)
    return (begin, end) if begin < end else (0.0, 0.0)


@njit(cache=True, inline="always")
def _cells(points, ks, near, far_off, low, cell, shape, begin, end):  # type: ignore[no-untyped-def]
    """Write the box of cells that a tube passes from `near` to `far_off` along its rays."""
    for c in range(3):
        least, most = np.inf, -np.inf
        for q in range(4):
            x, y = points[q, c] + near * ks[q, c], points[q, c] + far_off * ks[q, c]
            least, most = min(least, x, y), max(most, x, y)
        begin[c] = max(int((least - 0.25 * cell - low[c]) / cell), 0)
        end[c] = min(int((most + 0.25 * cell - low[c]) / cell) + 1, shape[c])


@njit(cache=True, inline="always")
def _crowded(crowd, begin, end):  # type: ignore[no-untyped-def]
    """Tell whether any block of a box of cells holds an edge."""
    for i in range(begin[0] // _BLOCK, (end[0] + _BLOCK - 1) // _BLOCK):
        for j in range(begin[1] // _BLOCK, (end[1] + _BLOCK - 1) // _BLOCK):
            for k in range(begin[2] // _BLOCK, (end[2] + _BLOCK - 1) // _BLOCK):
                if crowd[i, j, k]:
                    return True
    return False


@njit(cache=True, nogil=True)
def _across(  # type: ignore[no-untyped-def]
    points,
    ks,
    source,
    far,
    flat,
    hit,
    reach,
    ends,
    faces,
    first_point,
    normal,
    first,
    index,
    low,
    cell,
    shape,
    crowd,
    ball,
    radius,
    out,
):
    tried = np.full(len(ends), -1, np.int64)
    side, m, work, k = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    section = np.empty((4, 3))
    begin_cell, end_cell = np.empty(3, np.int64), np.empty(3, np.int64)
    for i in range(len(points)):
        if out[i].any():
            continue
        centre = points[i, 3]
        k[:] = ks[i, 3]
        plane, at_plane = normal[max(hit[i], 0)], first_point[max(hit[i], 0)]
        sign = -1.0 if dot(k, plane) > 0.0 else 1.0
        begin_at, end_at = _span(points[i], ks[i], reach[i], ball, radius)
        steps = int((end_at - begin_at) / cell) + 1 if end_at > begin_at else 0
        best = 0.0
        step = (end_at - begin_at) / max(steps, 1)
        clear_until = 0
        for s in range(steps):
            if s < clear_until:
                continue
            near = begin_at + s * step
            if s % _BLOCK == 0:
                _cells(points[i], ks[i], near, near + _BLOCK * step, low, cell, shape, begin_cell, end_cell)
                if not _crowded(crowd, begin_cell, end_cell):
                    clear_until = s + _BLOCK
                    continue
            _cells(points[i], ks[i], near, near + step, low, cell, shape, begin_cell, end_cell)
            room = 1
            for c in range(3):
                room *= max(end_cell[c] - begin_cell[c], 0)
            if room > _WIDE:
                break
            for ci in range(begin_cell[0], end_cell[0]):
                for cj in range(begin_cell[1], end_cell[1]):
                    row = (ci * shape[1] + cj) * shape[2]
                    if end_cell[2] <= begin_cell[2]:
                        continue
                    for at in range(first[row + begin_cell[2]], first[row + end_cell[2]]):
                        e = index[at]
                        if tried[e] == i:
                            continue
                        tried[e] = i
                        if not _outline(faces[e], source[i], k, far, first_point, normal):
                            continue
                        a, b = ends[e, 0], ends[e, 1]
                        # The part beyond the mirror, and before the plane of landing.
                        da, db, ha, hb = -_CLEAR, -_CLEAR, -_CLEAR, -_CLEAR
                        for c in range(3):
                            da += (a[c] - centre[c]) * k[c]
                            db += (b[c] - centre[c]) * k[c]
                            ha += sign * (a[c] - at_plane[c]) * plane[c]
                            hb += sign * (b[c] - at_plane[c]) * plane[c]
                        begin, end = above(da, db)
                        low_end, high_end = above(ha, hb) if hit[i] >= 0 else (0.0, 1.0)
                        begin, end = max(begin, low_end), min(end, high_end)
                        if begin >= end:
                            continue
                        # Off a curved mirror the rays count as parallel, in the section that they have here.
                        depth = 0.0
                        for c in range(3):
                            depth += (a[c] + 0.5 * (begin + end) * (b[c] - a[c]) - centre[c]) * k[c]
                        for q in range(4):
                            for c in range(3):
                                section[q, c] = points[i, q, c]
                                if not flat[i]:
                                    section[q, c] += depth * (ks[i, q, c] - k[c])
                        begin, end = inside(a, b, section, centre, source[i], k, far, begin, end, work)
                        length = (end - begin) * np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
                        if length <= best:
                            continue
                        if far:
                            cross_into(b - a, k, m)
                        else:
                            cross_into(b - a, source[i] - a, m)
                        size = np.sqrt(dot(m, m))
                        if size == 0.0:
                            continue
                        for q in range(3):
                            side[q] = 0.0
                            for c in range(3):
                                side[q] += (section[q, c] - a[c]) * m[c] / size
                        if side.min() < 0.0 < side.max():
                            best = length
                            out[i] = side
