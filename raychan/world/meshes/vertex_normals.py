"""Corner normals of the smooth surface that a mesh stands for, estimated from the facets around each vertex.

Everywhere: vertices (v, 3) [m]; faces (f, 3); pair (e, 2) half edges of both sides of an edge, half edge 3 f + k runs
from corner k of facet f to the next.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from raychan.geometry.normal_fits import corrected, fold_angles, turns, weighted_normals
from raychan.geometry.triangles import planes_of
from raychan.parallel import parallel_for
from raychan.world.meshes.pieces import pieces

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]
Bools = NDArray[np.bool_]

NEAR = 4.0
"""Weights of neighbours in a fit fall with this power of their distance (other powers not measured)."""
_ENOUGH = 9
"""Neighbours that a fit needs: coefficients of the cubic surface. With fewer the quadratic one, where it takes 5, is
1.6 times as far off on convex hulls of points about spheres (geometric mean of 9), with 9 1.1 times (of 6)."""
_LEAST_PIVOT = 1e-4  # pivot of the equations scaled to a unit diagonal: below, neighbours do not determine the surface
_FITTED = 0.3  # of the neighbours' rms height: largest residual of a fit that is taken
_HUB = 30  # most neighbours whose own neighbours are used too: the pole of a globe has too many, too far away
_CANCELLED = 1e-9  # of the sum of their sizes: weighted normals that cancel leave no direction
_TIP = 2.5
"""Of the largest fold round a vertex: where facets turn off its normal by more, the surface ends in a tip there. 1.0
on balls, 1.6 on subdivided ellipsoids ten times as long as wide, 2.04 on hulls of 3,000 random points about them, at
most; n / 4 at the tip of a pointed cone of n sections, n / 6 of a flat one."""
_PLAIN = 1e-3  # rad: smaller turns are taken as smooth whatever the folds, as of flat fans


def folds(vertices: Floats, faces: Ints, pair: Ints) -> Floats:
    """Return the angle (e,) [rad] by which the facets of each pair turn from each other."""
    angles: Floats = fold_angles(planes_of(vertices[faces])[0], pair.astype(np.int64))
    return angles


def smoothed(vertices: Floats, faces: Ints, pair: Ints, power: float = NEAR) -> Floats:
    """Return corner normals (f, 3, 3), smoothed over the given edges.

    Faces are weighted by the sine of their corner over both edge lengths, which is exact for vertices on a sphere; an
    error of 0.1 degrees is 0.1 rad of two-way phase at 77 GHz over a 2 cm facet. On other bodies uneven facets cause an
    error; where the neighbours determine a cubic surface, or a quadratic one, its gradient corrects it.
    Sources: Max (1999), J. Graphics Tools 4(2); Cazals, Pouget (2005), Computer Aided Geometric Design 22, 121.
    """
    n, faces, pair = len(faces), faces.astype(np.int64), pair.astype(np.int64)
    one, other = pair.T
    # Edge e runs from corner e to e + 1; its neighbour runs the opposite way.
    links = np.concatenate([[one, _next(other)], [_next(one), other]], axis=1)
    group = components(links.T, 3 * n)
    count = int(group.max()) + 1
    total, whole = weighted_normals(vertices, faces, group, count)
    # Where a surface is folded back on itself there is no smooth normal: each facet keeps its own.
    lost = np.linalg.norm(total, axis=1) <= _CANCELLED * whole
    total, own = _unit(total), planes_of(vertices[faces])[0]
    most, turn = turns(own, group, pair, fold_angles(own, pair), total)
    lost |= (turn > _TIP * most) & (turn > _PLAIN)
    place = np.zeros_like(total)
    place[group] = vertices[faces.ravel()]
    shared = np.flatnonzero((np.bincount(group) > 1) & ~lost)
    near = _neighbours(group.reshape(n, 3), count)
    first, beside, limits = total.copy(), (near.indptr, near.indices), (_LEAST_PIVOT, _FITTED, _ENOUGH)
    parallel_for(len(shared), lambda r: corrected(place, first, shared[r], beside, float(power), limits, total))
    out, flat = total[group], np.flatnonzero(lost[group])
    out[flat] = own[flat // 3]
    return np.asarray(out.reshape(n, 3, 3))


def components(links: Ints, n: int) -> NDArray[np.int64]:
    """Return the number (n,) of the connected component of each of n nodes with links (e, 2)."""
    one, other = links.T
    return pieces(one, other, n)


def _neighbours(corners: NDArray[np.int64], n: int) -> csr_matrix:
    """Return which of n vertices are neighbours, over two rings of facets, given the facets' corners (f, 3)."""
    a, b = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    one = coo_matrix((np.ones(2 * len(a), np.int32), (np.append(a, b), np.append(b, a))), shape=(n, n)).tocsr()
    few = np.flatnonzero(np.diff(one.indptr) <= _HUB)
    every = (one + one[:, few] @ one[few]).tocoo()
    kept = every.row != every.col
    return coo_matrix((every.data[kept], (every.row[kept], every.col[kept])), shape=(n, n)).tocsr()


def _next(half: Ints) -> Ints:
    return np.where(half % 3 == 2, half - 2, half + 1)


def _unit(rows: Floats) -> Floats:
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(size > 0.0, size, 1.0)
