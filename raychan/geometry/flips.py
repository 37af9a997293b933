"""Edge flips on smooth patches that are being simplified: flat facets shall bend the way the surface does (numba
kernels).

Removals leave facets that meet in a groove on a convex surface; such an edge would be missing from its outline. Source:
Joe, Computer Aided Geometric Design 8(2), 1991 (flips towards the convex hull).
"""

from __future__ import annotations

from raychan.compile.jit import njit
from raychan.geometry.collapses import SHAPE, UPRIGHT, edge_allowed, form


@njit(cache=True, nogil=True)
def flip_edges(net, limits, slab, mine):  # type: ignore[no-untyped-def]
    """Flip edges over which facets bend against the surface; return how many.

    Args: slab (k,) part of the mesh of each vertex, as for `remove_vertices`; mine the part whose edges are flipped.
    """
    count = 0
    for f in range(len(net.faces)):
        a, b, c = net.faces[f, 0], net.faces[f, 1], net.faces[f, 2]
        if a < 0 or slab[a] != mine or slab[b] != mine or slab[c] != mine:
            continue
        for k in range(3):
            other = net.mate[3 * f + k]
            if other < 3 * f:
                continue
            g, i = other // 3, other % 3
            c, d = net.faces[f, (k + 2) % 3], net.faces[g, (i + 2) % 3]
            if slab[d] != mine or net.locked[c] or net.locked[d]:
                continue
            if _bends_wrongly(net, f, k, g, i) and _may_flip(net, f, k, g, i, limits):
                _flip(net, f, k, g, i)
                count += 1
                break
    return count


@njit(cache=True, forceinline=True)
def _rise(net, f, i, g, j):  # type: ignore[no-untyped-def]
    """Return eight times how far the surface lies over the chord from corner i of facet f to corner j of g [m]."""
    p, q = net.v[net.faces[f, i]], net.v[net.faces[g, j]]
    a, b = net.n[net.corner[f, i]], net.n[net.corner[g, j]]
    return (q[0] - p[0]) * (b[0] - a[0]) + (q[1] - p[1]) * (b[1] - a[1]) + (q[2] - p[2]) * (b[2] - a[2])


@njit(cache=True, nogil=True)
def _bends_wrongly(net, f, k, g, i):  # type: ignore[no-untyped-def]
    """Tell whether facets f and g, at half edges k and i of theirs, bend inward where the surface bends outward along
    both diagonals, or the reverse."""
    own, other = _rise(net, f, k, f, (k + 1) % 3), _rise(net, f, (k + 2) % 3, g, (i + 2) % 3)
    if own * other <= 0.0:
        return False
    p, q, r = net.v[net.faces[f, 0]], net.v[net.faces[f, 1]], net.v[net.faces[f, 2]]
    s = net.v[net.faces[g, (i + 2) % 3]]
    x0, y0, z0 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    x1, y1, z1 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    x2, y2, z2 = s[0] - p[0], s[1] - p[1], s[2] - p[2]
    height = x2 * (y0 * z1 - z0 * y1) + y2 * (z0 * x1 - x0 * z1) + z2 * (x0 * y1 - y0 * x1)
    return height * own > 0.0


@njit(cache=True, nogil=True)
def _may_flip(net, f, k, g, i, limits):  # type: ignore[no-untyped-def]
    """Tell whether the other diagonal of facets f and g may be an edge."""
    a, b, c = net.faces[f, k], net.faces[f, (k + 1) % 3], net.faces[f, (k + 2) % 3]
    d = net.faces[g, (i + 2) % 3]
    na, nb, nc = (
        net.n[net.corner[f, k]],
        net.n[net.corner[f, (k + 1) % 3]],
        net.n[net.corner[f, (k + 2) % 3]],
    )
    nd = net.n[net.corner[g, (i + 2) % 3]]
    one, other = form(net.v[a], net.v[d], net.v[c], na, nd, nc), form(net.v[d], net.v[b], net.v[c], nd, nb, nc)
    if min(one[1], other[1]) < UPRIGHT:
        return False
    now = min(form(net.v[a], net.v[b], net.v[c], na, nb, nc)[0], form(net.v[b], net.v[a], net.v[d], nb, na, nd)[0])
    if min(one[0], other[0]) < min(SHAPE, now):
        return False
    return edge_allowed(net, c, d, nc, nd, min(net.reach[a], net.reach[b]), limits)


@njit(cache=True, nogil=True)
def _flip(net, f, k, g, i):  # type: ignore[no-untyped-def]
    """Make of facets (a, b, c) and (b, a, d) facets (a, d, c) and (d, b, c)."""
    k1, k2, i1, i2 = (k + 1) % 3, (k + 2) % 3, (i + 1) % 3, (i + 2) % 3
    a, b, c, d = net.faces[f, k], net.faces[f, k1], net.faces[f, k2], net.faces[g, i2]
    at_a, at_b, at_c, at_d = net.corner[f, k], net.corner[f, k1], net.corner[f, k2], net.corner[g, i2]
    bc, ca, ad, db = net.mate[3 * f + k1], net.mate[3 * f + k2], net.mate[3 * g + i1], net.mate[3 * g + i2]
    net.faces[f, 0], net.faces[f, 1], net.faces[f, 2] = a, d, c
    net.corner[f, 0], net.corner[f, 1], net.corner[f, 2] = at_a, at_d, at_c
    net.faces[g, 0], net.faces[g, 1], net.faces[g, 2] = d, b, c
    net.corner[g, 0], net.corner[g, 1], net.corner[g, 2] = at_d, at_b, at_c
    _pair(net, 3 * f, ad)
    _pair(net, 3 * f + 1, 3 * g + 2)
    _pair(net, 3 * f + 2, ca)
    _pair(net, 3 * g, db)
    _pair(net, 3 * g + 1, bc)
    net.half[a], net.half[d], net.half[c], net.half[b] = 3 * f, 3 * f + 1, 3 * f + 2, 3 * g + 1


@njit(cache=True, forceinline=True)
def _pair(net, h, other):  # type: ignore[no-untyped-def]
    """Make two half edges sides of one edge; other -1 for a boundary."""
    net.mate[h] = other
    if other >= 0:
        net.mate[other] = h
