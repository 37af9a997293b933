"""Corner normals of the smooth surface that a mesh stands for, estimated from the facets around each vertex.

Everywhere: vertices (v, 3) [m]; faces (f, 3); pair (e, 2) half edges of both sides of an edge, half edge 3 f + k runs
from corner k of facet f to the next.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from raychan.geometry.normal_fits import eliminated
from raychan.parallel import parallel_tasks
from raychan.world.meshes.pieces import pieces

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]
Bools = NDArray[np.bool_]

NEAR = 4.0
"""Weights of neighbours in a fit fall with this power of their distance (other powers not measured)."""
_ENOUGH = 9
"""Neighbours that a fit needs: coefficients of the cubic surface. With fewer the quadratic one, where it takes 5, is
1.6 times as far off on convex hulls of points about spheres (geometric mean of 9), with 9 1.1 times (of 6)."""
_QUADRATIC = 5  # coefficients; at the border of a patch two rings of facets determine no cubic surface
_LEAST_PIVOT = 1e-4  # pivot of the equations scaled to a unit diagonal: below, neighbours do not determine the surface
_FITTED = 0.3  # of the neighbours' rms height: largest residual of a fit that is taken
_HUB = 30  # most neighbours whose own neighbours are used too: the pole of a globe has too many, too far away
_CANCELLED = 1e-9  # of the sum of their sizes: weighted normals that cancel leave no direction
_TIP = 2.5
"""Of the largest fold round a vertex: where facets turn off its normal by more, the surface ends in a tip there. 1.0
on balls, 1.6 on subdivided ellipsoids ten times as long as wide, 2.04 on hulls of 3,000 random points about them, at
most; n / 4 at the tip of a pointed cone of n sections, n / 6 of a flat one."""
_PLAIN = 1e-3  # rad: smaller turns are taken as smooth whatever the folds, as of flat fans
_CHUNK = 8192  # vertices fitted at once: bounds memory


def folds(vertices: Floats, faces: Ints, pair: Ints) -> Floats:
    """Return the angle (e,) [rad] by which the facets of each pair turn from each other."""
    unit = _unit(_cross(vertices, faces))
    a, b = unit[pair[:, 0] // 3], unit[pair[:, 1] // 3]
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    return np.arctan2(sine, np.einsum("ij,ij->i", a, b))


def smoothed(vertices: Floats, faces: Ints, pair: Ints, power: float = NEAR) -> Floats:
    """Return corner normals (f, 3, 3), smoothed over the given edges.

    Faces are weighted by the sine of their corner over both edge lengths, which is exact for vertices on a sphere; an
    error of 0.1 degrees is 0.1 rad of two-way phase at 77 GHz over a 2 cm facet. On other bodies uneven facets cause an
    error; where the neighbours determine a cubic surface, or a quadratic one, its gradient corrects it.
    Sources: Max (1999), J. Graphics Tools 4(2); Cazals, Pouget (2005), Computer Aided Geometric Design 22, 121.
    """
    n = len(faces)
    one, other = pair.T
    # Edge e runs from corner e to e + 1; its neighbour runs the opposite way.
    links = np.concatenate([[one, _next(other)], [_next(one), other]], axis=1)
    group = components(links.T, 3 * n)
    c = vertices[faces]
    to_next, to_last = np.roll(c, -1, axis=1) - c, np.roll(c, 1, axis=1) - c
    squares = np.einsum("nij,nij->ni", to_next, to_next) * np.einsum("nij,nij->ni", to_last, to_last)
    weighted = (np.cross(to_next, to_last) / np.maximum(squares, 1e-300)[..., None]).reshape(-1, 3)
    count = int(group.max()) + 1
    total = _sums(group, weighted, count)
    # Where a surface is folded back on itself there is no smooth normal: each facet keeps its own.
    whole = np.bincount(group, np.linalg.norm(weighted, axis=1), count)
    lost = np.linalg.norm(total, axis=1) <= _CANCELLED * whole
    total = _unit(total)
    lost |= _tips(vertices, faces, pair, group.reshape(n, 3), total)
    place = np.zeros_like(total)
    place[group] = c.reshape(-1, 3)
    shared = np.flatnonzero((np.bincount(group) > 1) & ~lost)
    near = _neighbours(group.reshape(n, 3), len(total))
    chunks = np.array_split(shared, len(shared) // _CHUNK + 1)

    def correct(i: int) -> None:
        total[chunks[i]] = _corrected(place, total, chunks[i], near[chunks[i]], power)

    parallel_tasks(len(chunks), correct)
    own = np.repeat(_unit(_cross(vertices, faces)), 3, axis=0)
    return np.asarray(np.where(lost[group][:, None], own, total[group]).reshape(n, 3, 3))


def _tips(vertices: Floats, faces: Ints, pair: Ints, group: Ints, normal: Floats) -> Bools:
    """Return which smooth vertices (g,) are tips, as those of cones: their facets turn off the vertex normal (g, 3) far
    more than neighbours turn from each other, given the vertex (f, 3) of each corner."""
    own = _unit(_cross(vertices, faces))
    cosine = np.einsum("fkj,fj->fk", normal[group], own)
    off = np.arccos(np.clip(cosine, -1.0, 1.0)).ravel()
    fold = folds(vertices, faces, pair)
    around = np.zeros(len(faces))
    for side in pair.T // 3:
        np.maximum.at(around, side, fold)
    most, turn = np.zeros(len(normal)), np.zeros(len(normal))
    np.maximum.at(most, group.ravel(), np.repeat(around, 3))
    np.maximum.at(turn, group.ravel(), off)
    return np.asarray((turn > _TIP * most) & (turn > _PLAIN))


def components(links: Ints, n: int) -> NDArray[np.int64]:
    """Return the number (n,) of the connected component of each of n nodes with links (e, 2)."""
    one, other = links.T
    return pieces(one, other, n)


def _corrected(place: Floats, first: Floats, rows: Ints, near: csr_matrix, power: float) -> Floats:
    """Return the normals of some smooth vertices, corrected by the surface z(x, y) through their neighbours.

    Args: place, first (g, 3) all vertices and their first normals; rows (m,) those wanted; near (m, g) neighbours.
    """
    normal, at = first[rows], np.repeat(np.arange(len(rows)), np.diff(near.indptr))
    d = place[near.indices] - place[rows][at]
    u, w = _frame(normal, d, at)
    x, y, z = (np.einsum("ij,ij->i", d, axis[at]) for axis in (u, w, normal))
    sx, sy = (_rms(c, at, len(rows)) for c in (x, y))
    s, t, zx, zy = x / sx[at], y / sy[at], z / sx[at], z / sy[at]
    # Quadratic terms use the distance in space instead of that in the plane: a sphere is then fitted exactly.
    basis = np.stack([s, t, s * s + zx * zx, s * t, t * t + zy * zy, s**3, s * s * t, s * t * t, t**3], axis=1)
    weight = np.maximum(s * s + t * t, 1e-12) ** (-0.5 * power)
    solved, able = _fit(basis, weight, z, at, len(rows))
    border = np.flatnonzero(~able)
    number = np.full(len(rows), -1)
    number[border] = np.arange(len(border))
    here = number[at] >= 0
    few = np.ascontiguousarray(basis[here, :_QUADRATIC])
    solved[border, :_QUADRATIC], able[border] = _fit(few, weight[here], z[here], number[at[here]], len(border))
    slope = solved[:, :2] / np.stack([sx, sy], axis=1)
    # A correction larger than the turn of the surface over its neighbours is not plausible.
    able &= np.linalg.norm(slope, axis=1) < _rms(z, at, len(rows)) / np.hypot(sx, sy)
    slope[~able] = 0.0
    return _unit(normal - slope[:, :1] * u - slope[:, 1:] * w)


def _fit(basis: Floats, weight: Floats, z: Floats, at: Ints, n: int) -> tuple[Floats, Bools]:
    """Return `_least_squares`, and which of the fits hold: those determined by enough neighbours, to which they come
    near."""
    solved, able = _least_squares(basis, weight, z, at, n)
    left = z - np.einsum("ij,ij->i", basis, solved[at])
    rest, all_ = (np.bincount(at, weight * c * c, n) for c in (left, z))
    return solved, able & (np.bincount(at, minlength=n) >= _ENOUGH) & (rest < _FITTED**2 * all_)


def _least_squares(basis: Floats, weight: Floats, z: Floats, at: Ints, n: int) -> tuple[Floats, Bools]:
    """Return the weighted least-squares fits (n, k) of z (m,) in a basis (m, k), grouped by at (m,), and which of them
    are determined; by elimination."""
    m, y, size, able = eliminated(basis, weight, z, at, n, _LEAST_PIVOT)
    k = basis.shape[1]
    for i in reversed(range(k)):
        y[:, i] = (y[:, i] - np.einsum("nj,nj->n", m[:, i, i + 1 :], y[:, i + 1 :])) / m[:, i, i]
    return y / size, able


def _frame(normal: Floats, d: Floats, at: Ints) -> tuple[Floats, Floats]:
    """Return two axes (n, 3) across each normal, the first in which its neighbours d (m, 3) extend farthest."""
    u = _unit(np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])))
    w = np.cross(normal, u)
    x, y = np.einsum("ij,ij->i", d, u[at]), np.einsum("ij,ij->i", d, w[at])
    xx, xy, yy = _sums(at, np.stack([x * x, x * y, y * y], axis=1), len(normal)).T
    turn = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    return c * u + s * w, c * w - s * u


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


def _sums(group: Ints, values: Floats, n: int) -> Floats:
    return np.stack([np.bincount(group, column, n) for column in values.T], axis=1)


def _rms(values: Floats, group: Ints, n: int) -> Floats:
    count = np.maximum(np.bincount(group, minlength=n), 1)
    return np.sqrt(np.maximum(np.bincount(group, values**2, n) / count, 1e-300))


def _cross(v: Floats, f: Ints) -> Floats:
    return np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])


def _unit(rows: Floats) -> Floats:
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(size > 0.0, size, 1.0)
