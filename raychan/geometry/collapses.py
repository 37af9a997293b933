"""Half-edge collapses on smooth patches of a triangle mesh: vertices are removed, those that stay keep place and normal
(numba kernels).

Everywhere: half edge 3 f + k runs from corner k of facet f to the next; columns are arrays of a `Net`, taken out of it
once, since each access counts a reference; points and normals are three numbers. Source: Hoppe et al., Mesh
optimization, Proc. SIGGRAPH 1993 (edge collapse and when it keeps the topology).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.half_edges import MOST, before, fan_of
from raychan.geometry.patch_offsets import BETWEEN, beyond, patch_offset
from raychan.vectors import cross, dot, less, row

UPRIGHT = 0.9  # least cosine of a facet's plane normal to its corner normals: 26 deg; not measured
SHAPE = 0.25  # least quality of new facets, 1 for equilateral ones, unless the old are worse; not measured
# Of the limits, what a vertex that goes may be off its new facet: elsewhere on the facet the surface is off by more. It
# trades facets that fail their check for facets left: at 0.25 an ellipsoid keeps 1.7 times as many (command not noted).
_OWN = 0.5
# Times the deviation allowed: length times turn cubed of an edge. Over the middle of a chord of a circle a Nagata patch
# is off by length times turn cubed over 128, of which checks count so many times more.
_ALONG = 128.0 / BETWEEN


class Limits(NamedTuple):
    """How far a simplified surface may be off: deviation [m], normal [rad] of its curved facets; sag [m] of flat facets
    under them; turn [rad] of edges."""

    deviation: float
    normal: float
    sag: float
    turn: float


@njit(cache=True, nogil=True, error_model="numpy")
def remove_vertices(net, limits, turn, rows, slab):  # type: ignore[no-untyped-def]
    """Remove some vertices no two of which are neighbours, each to one of its three nearest; return how many.

    A vertex that could not go is tried again once facets about it or about its neighbours have changed.

    Args: turn the number of this round, from 1 on; rows (r,) the vertices to try; slab (k,): only those go all of whose
    neighbours are in the same one, so that threads, each with a slab of its own, never meet and their number does not
    change the result.
    """
    v, n, faces, corner, mate, half, heir, locked, gone, reach, touched, tried = net
    fan, ring, order = np.empty(MOST, np.int64), np.empty(MOST, np.int64), np.empty(MOST)
    place, here, there, count = np.empty((MOST, 3)), np.empty((MOST, 3)), np.empty((MOST, 3)), 0
    for a in rows:
        if gone[a] or touched[a] == turn or reach[a] == 0.0:
            continue
        m = fan_of(faces, mate, half[a], fan, ring)
        last, same, news = tried[a], m > 0, touched[a] >= tried[a]
        for i in range(m):
            same &= slab[ring[i]] == slab[a]
            news |= touched[ring[i]] >= last
        if not (same and news):
            continue
        p = row(v, a)
        for i in range(m):
            f, k = fan[i] // 3, fan[i] % 3
            _put(place, i, row(v, ring[i]))
            _put(here, i, row(n, corner[f, (k + 1) % 3]))
            _put(there, i, row(n, corner[f, (k + 2) % 3]))
            order[i] = _squared(p, row(place, i))
        went = False
        for _ in range(min(m, 3)):
            i = int(np.argmin(order[:m]))
            order[i] = np.inf
            na = row(n, corner[fan[i] // 3, fan[i] % 3])
            went = _edges_allowed(a, ring, place, here, m, i, reach, limits)
            went = went and _near(p, na, place, here, there, m, i, limits)
            went = went and not _joins(faces, mate, half, locked, ring, m, i)
            if went:
                break
        if went:
            for j in range(m):
                touched[ring[j]] = turn
            _collapse(faces, corner, mate, half, heir, fan, ring[i], m, i)
            gone[a] = True
            count += 1
        else:
            tried[a] = turn
    return count


@njit(cache=True, forceinline=True)
def _put(out, i, x):  # type: ignore[no-untyped-def]
    out[i, 0], out[i, 1], out[i, 2] = x


@njit(cache=True, forceinline=True)
def _squared(p, q):  # type: ignore[no-untyped-def]
    """Return the squared distance of two points."""
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@njit(cache=True, nogil=True, error_model="numpy")
def joined(faces, mate, half, locked, a, b):  # type: ignore[no-untyped-def]
    """Tell whether two vertices share an edge; where both are locked that is not known, and taken so."""
    if locked[a]:
        a, b = b, a
    if locked[a]:
        return True
    start = np.int64(half[a])
    h = start
    while True:
        f, k = h // 3, h % 3
        if faces[f, (k + 1) % 3] == b:
            return True
        h = np.int64(mate[before(h)])
        if h < 0 or h == start:
            return h < 0


@njit(cache=True, forceinline=True)
def _joins(faces, mate, half, locked, ring, m, i):  # type: ignore[no-untyped-def]
    """Tell whether vertex i of a ring (m,) shares an edge with another than the two beside it."""
    b = ring[i]
    if locked[b]:
        found = False
        for step in range(2, m - 1):
            found |= joined(faces, mate, half, locked, b, ring[(i + step) % m])
        return found
    start = np.int64(half[b])
    h = start
    while m > 3:
        f, k = h // 3, h % 3
        other = faces[f, (k + 1) % 3]
        for step in range(2, m - 1):
            if ring[(i + step) % m] == other:
                return True
        h = np.int64(mate[before(h)])
        if h < 0 or h == start:
            return h < 0
    return False


@njit(cache=True, forceinline=True)
def form(p, q, r, np_, nq, nr):  # type: ignore[no-untyped-def]
    """Return the quality of a triangle, area over squared edges, 1 where equilateral, and the least cosine of its
    normal to normals at its corners."""
    x = cross(less(q, p), less(r, p))
    size = max(math.sqrt(dot(x, x)), 1e-300)
    least = min(dot(x, np_), dot(x, nq), dot(x, nr))
    return 2.0 * math.sqrt(3.0) * size / max(_squared(p, q) + _squared(q, r) + _squared(r, p), 1e-300), least / size


@njit(cache=True, forceinline=True)
def edge_allowed(p, q, np_, nq, reach, limits):  # type: ignore[no-untyped-def]
    """Tell whether an edge between two points with these normals may come, by its length, turn and sagitta."""
    d, e = less(q, p), less(nq, np_)
    size, turned = _squared(p, q), dot(e, e)
    if size > reach**2 or turned > limits.turn**2 or size * turned**3 > (_ALONG * limits.deviation) ** 2:
        return False
    return not abs(dot(d, e)) > 8.0 * limits.sag


@njit(cache=True, forceinline=True)
def _edges_allowed(a, ring, place, here, m, i, reach, limits):  # type: ignore[no-untyped-def]
    """Tell whether the edges may come that there are if vertex a goes to vertex i of the ring (m,) about it."""
    most, p, normal = min(reach[a], reach[ring[i]]), row(place, i), row(here, i)
    for step in range(2, m - 1):
        j = (i + step) % m
        if not edge_allowed(p, row(place, j), normal, row(here, j), min(most, reach[ring[j]]), limits):
            return False
    return True


@njit(cache=True, forceinline=True)
def _near(p, normal, place, here, there, m, i, limits):  # type: ignore[no-untyped-def]
    """Tell whether the facets that there are if a vertex p goes to vertex i of the ring about it are well shaped and
    near to p and its normal.

    Args: place, here (m, 3) [m] of the ring, with the normals of the facets between p, vertex and next vertex; there
    (m, 3) the normals of these at the next.
    """
    b, nb, least, found = row(place, i), row(here, i), 1.0, -1
    for step in range(1, m - 1):
        j = (i + step) % m
        c, d = row(place, j), row(place, (j + 1) % m)
        quality, cosine = form(b, c, d, nb, row(here, j), row(there, j))
        if cosine < UPRIGHT:
            return False
        least = min(least, quality)
        if found < 0 and beyond(p, normal, (b, c, d))[0] < 0:
            found = j
    if found < 0:
        return False
    if least < SHAPE:
        worst = 1.0
        for j in range(m):
            worst = min(worst, form(p, row(place, j), row(place, (j + 1) % m), normal, normal, normal)[0])
        if least < worst:
            return False
    v = b, row(place, found), row(place, (found + 1) % m)
    off, turned = patch_offset(p, normal, v, (nb, row(here, found), row(there, found)))
    return off <= _OWN * limits.deviation and turned <= _OWN * limits.normal


@njit(cache=True, forceinline=True)
def _collapse(faces, corner, mate, half, heir, fan, b, m, i):  # type: ignore[no-untyped-def]
    """Move a vertex with m facets about it to the end b of its half edge i: the two facets on that edge go."""
    at = corner[fan[i] // 3, (fan[i] % 3 + 1) % 3]
    for step in range(1, m - 1):
        h = fan[(i + step) % m]
        faces[h // 3, h % 3], corner[h // 3, h % 3] = b, at
    for left in (fan[i], fan[(i - 1) % m]):
        f = left // 3
        # Of a facet that goes the half edge to b, or from it, stays paired with that of its neighbour.
        outer = 3 * f + (left % 3 + 1) % 3
        other = before(left) if left == fan[i] else left
        one, two = mate[outer], mate[other]
        if one >= 0:
            mate[one] = two
        mate[two] = one
        heir[f] = two // 3
        for k in range(3):
            faces[f, k], corner[f, k], mate[3 * f + k] = -1, -1, -1
    for step in range(1, m - 1):
        f = fan[(i + step) % m] // 3
        for k in range(3):
            half[faces[f, k]] = 3 * f + k
