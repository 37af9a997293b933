"""The net of half edges of a mesh that is being simplified: which facet lies beyond each edge, and which vertices lie
inside a smooth patch (numba kernels).

Everywhere: half edge 3 f + k runs from corner k of facet f to the next.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.vectors import dot

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

MOST = 16
"""Facets around a vertex that may go: more are rare and slow (not measured)."""
_SOFT = 1.0 - 1e-6  # cosine of corner normals across an edge from which it is smooth, as for `edge_folds`


class Net(NamedTuple):
    """A mesh that is being simplified: vertices v (k, 3) [m], normals n (3 m, 3) by corner of the original facets, and
    by facet its vertices and corners (m, 3), -1 where it went; mate (3 m,) the half edge on the other side, -1 where
    the smooth patch ends; half (k,) a half edge from each vertex; heir (m,) the facet in whose place one that went is
    looked for; locked, gone (k,); reach (k,) [m] the longest edge that may come at each vertex; the last round, from 1
    on, in which facets changed that each vertex touched (k,), and in which it was tried (k,) and could not go."""

    v: Floats
    n: Floats
    faces: Ints
    corner: Ints
    mate: Ints
    half: Ints
    heir: Ints
    locked: Bools
    gone: Bools
    reach: Floats
    touched: Ints
    tried: Ints

    def copied(self) -> Net:
        """Return a net that can be changed by itself."""
        return Net(self.v, self.n, *(x.copy() for x in self[2:]))  # type: ignore[arg-type]


@njit(cache=True, nogil=True)
def mates(v, faces, n, part, fixed):  # type: ignore[no-untyped-def]
    """Return the half edge (3 m,) on the other side of each, -1 where a smooth patch ends, which vertices (k,) lie
    inside one, and how far facets rise over the planes of their neighbours at most [m], inf where the mesh is open.

    Args: v (k, 3) [m]; faces (m, 3); n (m, 3, 3) corner normals; part (m,); fixed (m,) facets that stay as they are.
    """
    m, count, height = len(faces), len(v), -np.inf
    first = np.zeros(count + 1, np.int64)
    for f in range(m):
        for k in range(3):
            first[faces[f, k] + 1] += 1
    for a in range(count):
        first[a + 1] += first[a]
    fill, leaving = first[:-1].copy(), np.empty(3 * m, np.int32)
    for h in range(3 * m):
        a = faces[h // 3, h % 3]
        leaving[fill[a]] = h
        fill[a] += 1
    mate, inside = np.full(3 * m, -1, np.int32), np.ones(count, np.bool_)
    for h in range(3 * m):
        f, k = h // 3, h % 3
        a, b = faces[f, k], faces[f, (k + 1) % 3]
        alike, found = 0, -1
        for i in range(first[a], first[a + 1]):
            g = leaving[i]
            alike += faces[g // 3, (g % 3 + 1) % 3] == b
        for i in range(first[b], first[b + 1]):
            g = leaving[i]
            if faces[g // 3, (g % 3 + 1) % 3] == a:
                alike, found = alike + 1, g
        if alike == 2 and found >= 0:
            g, c = found // 3, found % 3
            height = max(height, _height(v, faces, f, faces[g, (c + 2) % 3]))
            soft = dot(n[f, k], n[g, (c + 1) % 3]) > _SOFT and dot(n[f, (k + 1) % 3], n[g, c]) > _SOFT
            if soft and part[f] == part[g] and not fixed[f] and not fixed[g]:
                mate[h] = found
        else:
            height = np.inf
        if mate[h] < 0:
            inside[a], inside[b] = False, False
    return mate, inside, height


@njit(cache=True, forceinline=True)
def _height(v, faces, f, d):  # type: ignore[no-untyped-def]
    """Return how far a vertex lies over the plane of a facet [m]."""
    p, q, r = v[faces[f, 0]], v[faces[f, 1]], v[faces[f, 2]]
    x0, y0, z0 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    x1, y1, z1 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    x, y, z = y0 * z1 - z0 * y1, z0 * x1 - x0 * z1, x0 * y1 - y0 * x1
    up = (v[d, 0] - p[0]) * x + (v[d, 1] - p[1]) * y + (v[d, 2] - p[2]) * z
    return up / max(math.sqrt(x * x + y * y + z * z), 1e-300)


@njit(cache=True, nogil=True)
def lock_pinched(net):  # type: ignore[no-untyped-def]
    """Lock the vertices about which facets make no single closed fan; give each vertex a half edge."""
    faces, mate, half, locked = net.faces, net.mate, net.half, net.locked
    count = np.zeros(len(half), np.int32)
    for f in range(len(faces)):
        for k in range(3):
            half[faces[f, k]] = 3 * f + k
            count[faces[f, k]] += 1
    fan, ring = np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    for a in range(len(half)):
        if not locked[a]:
            size = fan_of(faces, mate, half[a], fan, ring)
            locked[a] = size == 0 or size != count[a]


@njit(cache=True, forceinline=True)
def before(h):  # type: ignore[no-untyped-def]
    """Return the half edge before this one in its facet."""
    return h + 2 if h % 3 == 0 else h - 1


@njit(cache=True, forceinline=True)
def fan_of(faces, mate, start, out, ring):  # type: ignore[no-untyped-def]
    """Write the half edges that leave a vertex, in order from `start` on, into out, and where they end into ring; return
    how many, 0 where they close no fan."""
    h, m = np.int64(start), 0
    while m < len(out):
        f, k = h // 3, h % 3
        out[m], ring[m] = h, faces[f, (k + 1) % 3]
        m += 1
        h = np.int64(mate[3 * f + (k + 2) % 3])
        if h < 0:
            return 0
        if h == start:
            return m
    return 0
