"""Edge flips on smooth patches that are being simplified: flat facets shall bend the way the surface does (numba
kernels).

Removals leave facets that meet in a groove on a convex surface; such an edge would be missing from its outline. Source:
Joe, Computer Aided Geometric Design 8(2), 1991 (flips towards the convex hull).
"""

from __future__ import annotations

from raychan.compile.jit import njit
from raychan.geometry.collapses import SHAPE, UPRIGHT, edge_allowed, form, joined
from raychan.vectors import cross, dot, less, row


@njit(cache=True, nogil=True, error_model="numpy")
def flip_edges(net, limits, turn, rows, slab, mine):  # type: ignore[no-untyped-def]
    """Flip edges over which facets bend against the surface; return how many.

    Args: turn the number of the last round of removals; rows (r,) the facets to try; slab (k,) part of the mesh of each
    vertex, as for `remove_vertices`; mine the part whose edges are flipped.
    """
    v, n, faces, corner, mate, half, _, locked, _, reach, touched, _ = net
    count = 0
    for f in rows:
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if slab[a] != mine or slab[b] != mine or slab[c] != mine:
            continue
        facet = row(v, a), row(v, b), row(v, c)
        for k in range(3):
            other = mate[3 * f + k]
            if other < 3 * f:
                continue
            k1, k2, g, i = (k + 1) % 3, (k + 2) % 3, other // 3, other % 3
            i2 = (i + 2) % 3
            a, b, c, d = faces[f, k], faces[f, k1], faces[f, k2], faces[g, i2]
            if slab[d] != mine or locked[c] or locked[d]:
                continue
            places = row(v, a), row(v, b), row(v, c), row(v, d)
            normals = row(n, corner[f, k]), row(n, corner[f, k1]), row(n, corner[f, k2]), row(n, corner[g, i2])
            if not _bends_wrongly(facet, places, normals):
                continue
            most = min(reach[c], reach[d], min(reach[a], reach[b]))
            if _may_flip(places, normals, most, limits) and not joined(faces, mate, half, locked, c, d):
                _flip(faces, corner, mate, half, f, k, g, i)
                touched[a], touched[b], touched[c], touched[d] = turn, turn, turn, turn
                count += 1
                break
    return count


@njit(cache=True, forceinline=True)
def _rise(places, normals, i, j):  # type: ignore[no-untyped-def]
    """Return eight times how far the surface lies over the chord between two of four points [m]."""
    return dot(less(places[j], places[i]), less(normals[j], normals[i]))


@njit(cache=True, forceinline=True)
def _bends_wrongly(facet, places, normals):  # type: ignore[no-untyped-def]
    """Tell whether facets (a, b, c) and (b, a, d), given by the first's corners, their four points and the normals
    there, bend inward where the surface bends outward along both diagonals, or the reverse."""
    own, other = _rise(places, normals, 0, 1), _rise(places, normals, 2, 3)
    if own * other <= 0.0:
        return False
    p, q, r = facet
    return dot(less(places[3], p), cross(less(q, p), less(r, p))) * own > 0.0


@njit(cache=True, forceinline=True)
def _may_flip(places, normals, reach, limits):  # type: ignore[no-untyped-def]
    """Tell whether the other diagonal of facets (a, b, c) and (b, a, d) may be an edge."""
    a, b, c, d = places
    na, nb, nc, nd = normals
    one, other = form(a, d, c, na, nd, nc), form(d, b, c, nd, nb, nc)
    if min(one[1], other[1]) < UPRIGHT:
        return False
    now = min(form(a, b, c, na, nb, nc)[0], form(b, a, d, nb, na, nd)[0])
    if min(one[0], other[0]) < min(SHAPE, now):
        return False
    return edge_allowed(c, d, nc, nd, reach, limits)


@njit(cache=True, forceinline=True)
def _flip(faces, corner, mate, half, f, k, g, i):  # type: ignore[no-untyped-def]
    """Make of facets (a, b, c) and (b, a, d) facets (a, d, c) and (d, b, c)."""
    k1, k2, i1, i2 = (k + 1) % 3, (k + 2) % 3, (i + 1) % 3, (i + 2) % 3
    a, b, c, d = faces[f, k], faces[f, k1], faces[f, k2], faces[g, i2]
    at_a, at_b, at_c, at_d = corner[f, k], corner[f, k1], corner[f, k2], corner[g, i2]
    bc, ca, ad, db = mate[3 * f + k1], mate[3 * f + k2], mate[3 * g + i1], mate[3 * g + i2]
    faces[f, 0], faces[f, 1], faces[f, 2] = a, d, c
    corner[f, 0], corner[f, 1], corner[f, 2] = at_a, at_d, at_c
    faces[g, 0], faces[g, 1], faces[g, 2] = d, b, c
    corner[g, 0], corner[g, 1], corner[g, 2] = at_d, at_b, at_c
    _pair(mate, 3 * f, ad)
    _pair(mate, 3 * f + 1, 3 * g + 2)
    _pair(mate, 3 * f + 2, ca)
    _pair(mate, 3 * g, db)
    _pair(mate, 3 * g + 1, bc)
    half[a], half[d], half[c], half[b] = 3 * f, 3 * f + 1, 3 * f + 2, 3 * g + 1


@njit(cache=True, forceinline=True)
def _pair(mate, h, other):  # type: ignore[no-untyped-def]
    """Make two half edges sides of one edge; other -1 for a boundary."""
    mate[h] = other
    if other >= 0:
        mate[other] = h
