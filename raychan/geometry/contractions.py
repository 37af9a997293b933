"""Contractions of a net that is being simplified: cells of vertices go to their middle ones at once, where facets are
far finer than asked for (numba kernels).

Everywhere: half edge 3 f + k runs from corner k of facet f to the next; cell (k,) is the vertex to which each goes,
itself for one that stays. Facets whose corners lie in three cells stay. Source: Okabe et al., Spatial Tessellations,
2000, section 2.2 (the dual of cells that are discs is a triangulation).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.collapses import UPRIGHT, Limits, edge_allowed, form
from raychan.geometry.half_edges import MOST, Net, fan_of
from raychan.parallel import parallel_for
from raychan.vectors import dot, less, row

Ints = NDArray[np.signedinteger[Any]]

# Edges between middles are about so many times as long as those from a middle to the rim of its cell.
_ACROSS = 2.0
_WALK = 1000  # facets along the border of two cells; more than there are where cells are discs


@njit(cache=True, nogil=True, error_model="numpy")
def grow_cells(net, limits, most, rows, slab, cell, away, far):  # type: ignore[no-untyped-def]
    """Write into cell (k,) to which vertex each goes: one at most so many edges away, by edges that may come.

    Every vertex in no cell yet begins one; a vertex within reach of several goes where it is fewer edges away, or
    nearer.

    Args: rows (r,) the vertices of a slab, none locked; slab (k,): no cell leaves its own, so that threads never meet;
    cell (k,) holds -1 for these, themselves for others; away, far (k,) [edges], [m^2] from the middle, are written.
    """
    v, n, faces, corner, mate, half, _, locked, _, reach, _, _ = net
    fan, ring = np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    queue = np.empty(MOST * MOST, np.int64)
    for a in rows:
        if cell[a] >= 0:
            continue
        cell[a], away[a], queue[0], begin, end = a, 0, a, 0, 1
        p, na = row(v, a), row(n, corner[half[a] // 3, half[a] % 3])
        while begin < end:
            u = queue[begin]
            begin += 1
            step = away[u] + 1
            for i in range(fan_of(faces, mate, half[u], fan, ring)):
                w = ring[i]
                q = row(v, w)
                size = dot(less(q, p), less(q, p))
                # Those about the middle stay, since the rim hangs on them.
                taken = cell[w] >= 0 and (away[w] < step or (away[w] == step and (step < most or far[w] <= size)))
                if taken or locked[w] or cell[w] == a or slab[w] != slab[a]:
                    continue
                nw = row(n, corner[half[w] // 3, half[w] % 3])
                if not edge_allowed(p, q, na, nw, min(reach[a], reach[w]) / _ACROSS, limits):
                    continue
                cell[w], away[w], far[w] = a, step, size
                if step < most and end < len(queue):
                    queue[end] = w
                    end += 1


@njit(cache=True, nogil=True, error_model="numpy")
def misshapen(net, limits, cell, moved, begin, stop, bad):  # type: ignore[no-untyped-def]
    """Mark in bad (k,) the cells of facets that turn over or have edges that may not come; return how many facets do.

    Args: moved (k,) vertices that have another cell than before: of facets without any nothing is asked; begin, stop:
    of which facets.
    """
    v, n, faces, corner, _, half, _, _, _, reach, _, _ = net
    count = 0
    for f in range(begin, stop):
        if faces[f, 0] < 0 or not (moved[faces[f, 0]] or moved[faces[f, 1]] or moved[faces[f, 2]]):
            continue
        a, b, c = cell[faces[f, 0]], cell[faces[f, 1]], cell[faces[f, 2]]
        if a == b or b == c or c == a or (a == faces[f, 0] and b == faces[f, 1] and c == faces[f, 2]):
            continue
        p, q, r = row(v, a), row(v, b), row(v, c)
        na = row(n, _corner(faces, corner, half, f, 0, a))
        nb = row(n, _corner(faces, corner, half, f, 1, b))
        nc = row(n, _corner(faces, corner, half, f, 2, c))
        most = min(reach[a], reach[b], reach[c])
        fits = form(p, q, r, na, nb, nc)[1] >= UPRIGHT and edge_allowed(p, q, na, nb, most, limits)
        fits = fits and edge_allowed(q, r, nb, nc, most, limits) and edge_allowed(r, p, nc, na, most, limits)
        if not fits:
            bad[a], bad[b], bad[c] = True, True, True
            count += 1
    return count


@njit(cache=True, nogil=True)
def dissolve(bad, begin, stop, cell, moved):  # type: ignore[no-untyped-def]
    """Let some vertices of bad cells (k,) stay, in cell (k,), and tell in moved (k,) which of them went before."""
    for a in range(begin, stop):
        moved[a] = cell[a] != a and bad[cell[a]]
        if moved[a]:
            cell[a] = a


@njit(cache=True, forceinline=True)
def _corner(faces, corner, half, f, k, a):  # type: ignore[no-untyped-def]
    """Return the corner whose normal facet f has at a vertex in place of its corner k."""
    return corner[f, k] if faces[f, k] == a else corner[half[a] // 3, half[a] % 3]


@njit(cache=True, nogil=True)
def beyond_cells(faces, mate, cell, begin, stop, out):  # type: ignore[no-untyped-def]
    """Write into out (3 m,) the other side of each half edge of some facets that stay, -1 where the smooth patch ends;
    return whether all are found."""
    for f in range(begin, stop):
        if faces[f, 0] < 0:
            continue
        a, b, c = cell[faces[f, 0]], cell[faces[f, 1]], cell[faces[f, 2]]
        if a == b or b == c or c == a:
            continue
        for k in range(3):
            one, two = cell[faces[f, k]], cell[faces[f, (k + 1) % 3]]
            h, found = np.int64(mate[3 * f + k]), False
            for _ in range(_WALK):
                # h runs from cell two to cell one.
                if h < 0:
                    found = True
                    break
                g, i = h // 3, h % 3
                other = cell[faces[g, (i + 2) % 3]]
                if other != one and other != two:
                    found = True
                    break
                h = np.int64(mate[3 * g + (i + 2) % 3] if other == one else mate[3 * g + (i + 1) % 3])
            if not found:
                return False
            out[3 * f + k] = h
    return True


@njit(cache=True, nogil=True)
def corners_of_cells(faces, cell, own):  # type: ignore[no-untyped-def]
    """Write a half edge that leaves each vertex that stays into own (k,), -1 where no facet stays; return how many
    facets go."""
    went = 0
    own[:] = -1
    for f in range(len(faces)):
        if faces[f, 0] < 0:
            continue
        a, b, c = cell[faces[f, 0]], cell[faces[f, 1]], cell[faces[f, 2]]
        if a == b or b == c or c == a:
            went += 1
        else:
            own[a], own[b], own[c] = 3 * f, 3 * f + 1, 3 * f + 2
    return went


@njit(cache=True, nogil=True)
def corners_before(net, cell, own, begin, stop, seen):  # type: ignore[no-untyped-def]
    """Write into seen (k,) the corner at each of some vertices; return how many of them go, -1 where one that stays is
    of no facet that stays.

    Args: own as `corners_of_cells` writes it; begin, stop: which vertices.
    """
    _, _, _, corner, _, half, _, _, gone, _, _, _ = net
    went = 0
    for a in range(begin, stop):
        seen[a] = corner[half[a] // 3, half[a] % 3]
        if not gone[a]:
            if cell[a] == a and own[a] < 0:
                return -1
            went += cell[a] != a
    return went


@njit(cache=True, nogil=True)
def leave_vertices(net, cell, own, turn, begin, stop):  # type: ignore[no-untyped-def]
    """Let some vertices go to the middles of their cells; those that stay are touched in round `turn`; else as for
    `corners_before`."""
    _, _, _, _, _, half, _, _, gone, _, touched, _ = net
    for a in range(begin, stop):
        if cell[a] != a:
            gone[a] = True
        elif not gone[a]:
            half[a], touched[a] = own[a], turn


@njit(cache=True, nogil=True)
def merge_cells(net, cell, own, seen, beyond, begin, stop):  # type: ignore[no-untyped-def]
    """Move the vertices of some facets to the middles of their cells: facets within two cells go.

    Args: own as `corners_of_cells` writes it; seen (k,) the corner at each vertex before; beyond as `beyond_cells`
    writes it; begin, stop: which facets.
    """
    _, _, faces, corner, mate, _, heir, _, _, _, _, _ = net
    for f in range(begin, stop):
        if faces[f, 0] < 0:
            continue
        a, b, c = cell[faces[f, 0]], cell[faces[f, 1]], cell[faces[f, 2]]
        inside = a == b or b == c or c == a
        if inside:
            # A vertex of a cell of several, which is of one smooth patch.
            heir[f] = own[a if a in (b, c) else b] // 3
        for k in range(3):
            x = cell[faces[f, k]]
            if inside:
                faces[f, k], corner[f, k], mate[3 * f + k] = -1, -1, -1
            else:
                corner[f, k] = corner[f, k] if faces[f, k] == x else seen[x]
                faces[f, k], mate[3 * f + k] = x, beyond[3 * f + k]


def contract(net: Net, limits: Limits, most: int, turn: int, slabs: tuple[NDArray[np.int8], Ints, Ints]) -> int:
    """Contract the cells of a net, in place; return how many vertices go, none where some cell is no disc.

    Args: limits that edges between vertices that stay keep; most edges from the middle of a cell to its rim; turn the
    number of this round; slabs: the slab (k,) of each vertex, the vertices that may go by slab, and where each begins.
    """
    cell = _cells(net, limits, most, slabs)
    n, moved = len(net.faces), np.ones(len(cell), bool)
    while True:
        bad, count = np.zeros(len(cell), bool), list[int]()

        def marked(r: slice, bad: NDArray[np.bool_] = bad, count: list[int] = count) -> None:
            count.append(misshapen(net, limits, cell, moved, r.start, r.stop, bad))

        def stay(r: slice, bad: NDArray[np.bool_] = bad) -> None:
            dissolve(bad, r.start, r.stop, cell, moved)

        parallel_for(n, marked)
        if not any(count):
            break
        parallel_for(len(cell), stay)
    own, seen = np.empty(len(cell), np.int32), np.empty(len(cell), np.int32)
    beyond, whole, went = np.empty(3 * n, np.int32), list[bool](), list[int]()
    facets = corners_of_cells(net.faces, cell, own)
    parallel_for(n, lambda r: whole.append(beyond_cells(net.faces, net.mate, cell, r.start, r.stop, beyond)))
    parallel_for(len(cell), lambda r: went.append(corners_before(net, cell, own, r.start, r.stop, seen)))
    # Of cells that are discs two facets go with each vertex (Euler).
    if not all(whole) or min(went) < 0 or facets != 2 * sum(went):
        return 0
    parallel_for(n, lambda r: merge_cells(net, cell, own, seen, beyond, r.start, r.stop))
    parallel_for(len(cell), lambda r: leave_vertices(net, cell, own, turn, r.start, r.stop))
    return sum(went)


def _cells(net: Net, limits: Limits, most: int, slabs: tuple[NDArray[np.int8], Ints, Ints]) -> NDArray[np.int32]:
    """Return the vertex (k,) to which each goes."""
    slab, rows, first = slabs
    cell = np.where(net.locked | net.gone, np.arange(len(net.v), dtype=np.int32), np.int32(-1))
    away, far = np.empty(len(cell), np.int8), np.empty(len(cell))
    # An edge across two cells is twice as long and turns twice as far.
    half = limits._replace(
        deviation=limits.deviation / _ACROSS**4, sag=limits.sag / _ACROSS**2, turn=limits.turn / _ACROSS
    )

    def some(r: slice) -> None:
        for i in range(r.start, r.stop):
            grow_cells(net, half, most, rows[first[i] : first[i + 1]], slab, cell, away, far)

    parallel_for(len(first) - 1, some, 2)
    return cell
