"""Half-edge collapses on smooth patches of a triangle mesh: vertices are removed, those that stay keep place and normal
(numba kernels).

Everywhere: half edge 3 f + k runs from corner k of facet f to the next. Source: Hoppe et al., Mesh optimization, Proc.
SIGGRAPH 1993 (edge collapse and when it keeps the topology).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.half_edges import MOST, before, end_of, fan_of
from raychan.geometry.patch_offsets import beyond, patch_offset

UPRIGHT = 0.9  # least cosine of a facet's plane normal to its corner normals: 26 deg; not measured
SHAPE = 0.25  # least quality of new facets, 1 for equilateral ones, unless the old are worse; not measured
# Of the limits, what a vertex that goes may be off its new facet: elsewhere on the facet the surface is off by more. It
# trades facets that fail their check for facets left: at 0.25 an ellipsoid keeps 1.7 times as many (command not noted).
_OWN = 0.5


class Limits(NamedTuple):
    """How far a simplified surface may be off: deviation [m], normal [rad] of its curved facets; sag [m] of flat facets
    under them; turn [rad] of edges."""

    deviation: float
    normal: float
    sag: float
    turn: float


@njit(cache=True, nogil=True)
def remove_vertices(net, limits, touched, turn, rows, slab):  # type: ignore[no-untyped-def]
    """Remove some vertices no two of which are neighbours, each to one of its three nearest; return how many.

    Args: touched (k,) the last round in which each was beside one removed; turn the number of this round; rows (r,) the
    vertices to try; slab (k,): only those go all of whose neighbours are in the same one, so that threads, each with a
    slab of its own, never meet and their number does not change the result.
    """
    fan, order, own, count = np.empty(MOST, np.int32), np.empty(MOST), np.empty((2, 1, 3, 3)), 0
    for a in rows:
        if net.gone[a] or touched[a] == turn or net.reach[a] == 0.0:
            continue
        m = fan_of(net, a, fan)
        for i in range(m):
            b = end_of(net, fan[i])
            order[i] = _squared(net.v[a], net.v[b])
            if slab[b] != slab[a]:
                m = 0
                break
        for _ in range(min(m, 3)):
            i = int(np.argmin(order[:m]))
            order[i] = np.inf
            if _allowed(net, a, fan, m, i, limits, own):
                for j in range(m):
                    touched[end_of(net, fan[j])] = turn
                _collapse(net, a, fan, m, i)
                count += 1
                break
    return count


@njit(cache=True, forceinline=True)
def _squared(p, q):  # type: ignore[no-untyped-def]
    """Return the squared distance of two points."""
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@njit(cache=True, nogil=True)
def _joined(net, a, b):  # type: ignore[no-untyped-def]
    """Tell whether two vertices share an edge; where both are locked that is not known, and taken so."""
    if net.locked[a]:
        a, b = b, a
    if net.locked[a]:
        return True
    start = net.half[a]
    h = start
    while True:
        if end_of(net, h) == b:
            return True
        h = net.mate[before(h)]
        if h < 0 or h == start:
            return h < 0


@njit(cache=True, forceinline=True)
def form(p, q, r, np_, nq, nr):  # type: ignore[no-untyped-def]
    """Return the quality of a triangle, area over squared edges, 1 where equilateral, and the least cosine of its
    normal to normals at its corners."""
    x0, y0, z0 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    x1, y1, z1 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    x, y, z = y0 * z1 - z0 * y1, z0 * x1 - x0 * z1, x0 * y1 - y0 * x1
    size = max(math.sqrt(x * x + y * y + z * z), 1e-300)
    least = min(
        x * np_[0] + y * np_[1] + z * np_[2], x * nq[0] + y * nq[1] + z * nq[2], x * nr[0] + y * nr[1] + z * nr[2]
    )
    return 2.0 * math.sqrt(3.0) * size / max(_squared(p, q) + _squared(q, r) + _squared(r, p), 1e-300), least / size


@njit(cache=True, nogil=True)
def edge_allowed(net, a, b, na, nb, reach, limits):  # type: ignore[no-untyped-def]
    """Tell whether an edge between two vertices with normals na, nb may come."""
    p, q = net.v[a], net.v[b]
    rise, turn = 0.0, 0.0
    for c in range(3):
        rise += (q[c] - p[c]) * (nb[c] - na[c])
        turn += (nb[c] - na[c]) ** 2
    long = _squared(p, q) > min(net.reach[a], net.reach[b], reach) ** 2 or turn > limits.turn**2
    return not (long or abs(rise) > 8.0 * limits.sag) and not _joined(net, a, b)


@njit(cache=True, nogil=True)
def _allowed(net, a, fan, m, i, limits, own):  # type: ignore[no-untyped-def]
    """Tell whether vertex a, with m facets about it, may go to the end of its half edge i; own (2, 1, 3, 3) is
    written."""
    v, n = own[0], own[1]
    b = end_of(net, fan[i])
    nb = net.n[net.corner[fan[i] // 3, (fan[i] % 3 + 1) % 3]]
    na = net.n[net.corner[fan[i] // 3, fan[i] % 3]]
    least, found = 1.0, False
    for step in range(1, m - 1):
        h = fan[(i + step) % m]
        f, k = h // 3, h % 3
        c, d = net.faces[f, (k + 1) % 3], net.faces[f, (k + 2) % 3]
        nc, nd = net.n[net.corner[f, (k + 1) % 3]], net.n[net.corner[f, (k + 2) % 3]]
        if step > 1 and not edge_allowed(net, b, c, nb, nc, net.reach[a], limits):
            return False
        quality, cosine = form(net.v[b], net.v[c], net.v[d], nb, nc, nd)
        if cosine < UPRIGHT:
            return False
        least = min(least, quality)
        if not found:
            for x in range(3):
                v[0, 0, x], v[0, 1, x], v[0, 2, x] = net.v[b, x], net.v[c, x], net.v[d, x]
                n[0, 0, x], n[0, 1, x], n[0, 2, x] = nb[x], nc[x], nd[x]
            found = beyond(net.v[a], na, v[0])[0] < 0
    if not found or (least < SHAPE and least < _worst(net, fan, m)):
        return False
    off, turned = patch_offset(net.v[a], na, v, n)
    return off <= _OWN * limits.deviation and turned <= _OWN * limits.normal


@njit(cache=True, nogil=True)
def _worst(net, fan, m):  # type: ignore[no-untyped-def]
    """Return the least quality of the facets of a fan."""
    worst = 1.0
    for j in range(m):
        f = net.faces[fan[j] // 3]
        up = net.n[net.corner[fan[j] // 3, 0]]
        worst = min(worst, form(net.v[f[0]], net.v[f[1]], net.v[f[2]], up, up, up)[0])
    return worst


@njit(cache=True, nogil=True)
def _collapse(net, a, fan, m, i):  # type: ignore[no-untyped-def]
    """Move vertex a, with m facets about it, to the end of its half edge i: the two facets on that edge go."""
    b, corner = end_of(net, fan[i]), net.corner[fan[i] // 3, (fan[i] % 3 + 1) % 3]
    for step in range(1, m - 1):
        h = fan[(i + step) % m]
        net.faces[h // 3, h % 3], net.corner[h // 3, h % 3] = b, corner
    for left in (fan[i], fan[(i - 1) % m]):
        f = left // 3
        # Of a facet that goes the half edge to b, or from it, stays paired with that of its neighbour.
        outer = 3 * f + (left % 3 + 1) % 3
        other = before(left) if left == fan[i] else left
        one, two = net.mate[outer], net.mate[other]
        if one >= 0:
            net.mate[one] = two
        net.mate[two] = one
        net.heir[f] = two // 3
        for k in range(3):
            net.faces[f, k], net.corner[f, k], net.mate[3 * f + k] = -1, -1, -1
    for step in range(1, m - 1):
        h = fan[(i + step) % m]
        for k in range(3):
            net.half[net.faces[h // 3, k]] = 3 * (h // 3) + k
    net.gone[a] = True
