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
from raychan.vectors import cross, dot, less, row

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

    def packed(self) -> tuple[Net, NDArray[np.int64], NDArray[np.int64]]:
        """Return the net without what went, and which facets and vertices of this one it has."""
        live, stays = np.flatnonzero(self.faces[:, 0] >= 0), np.flatnonzero(~self.gone)
        facet, vertex = np.full(len(self.faces), -1, np.int32), np.zeros(len(self.v), np.int32)
        facet[live], vertex[stays] = np.arange(len(live)), np.arange(len(stays))
        mate, half = self.mate.reshape(-1, 3)[live].ravel(), self.half[stays]
        net = Net(
            v=self.v[stays],
            n=self.n,
            faces=vertex[self.faces[live]],
            corner=self.corner[live],
            mate=np.where(mate < 0, np.int32(-1), 3 * facet[mate // 3] + mate % 3),
            half=3 * facet[half // 3] + half % 3,
            heir=np.arange(len(live), dtype=np.int32),
            locked=self.locked[stays],
            gone=np.zeros(len(stays), bool),
            reach=self.reach[stays],
            touched=self.touched[stays],
            tried=self.tried[stays],
        )
        return net, live, stays


@njit(cache=True, nogil=True)
def by_first_use(v, faces):  # type: ignore[no-untyped-def]
    """Return numbers (k,) of vertices v (k, 3) [m] in the order in which faces (m, 3) use them, all of them, and
    vertices and faces so numbered: neighbours then lie near each other in memory."""
    number, there, own, count = np.full(len(v), -1, np.int32), np.empty_like(v), np.empty_like(faces), 0
    for f in range(len(faces)):
        for k in range(3):
            a = faces[f, k]
            if number[a] < 0:
                number[a] = count
                there[count, 0], there[count, 1], there[count, 2] = row(v, a)
                count += 1
            own[f, k] = number[a]
    return number, there, own


@njit(cache=True, nogil=True)
def leaving(faces, count):  # type: ignore[no-untyped-def]
    """Return the half edges (3 m,) of faces (m, 3) by the vertex that they leave, ascending, where those of each vertex
    begin (count + 1,), and the vertex (3 m,) at which each ends."""
    m = len(faces)
    first = np.zeros(count + 1, np.int64)
    for f in range(m):
        for k in range(3):
            first[faces[f, k] + 1] += 1
    for a in range(count):
        first[a + 1] += first[a]
    fill, half, end = first[:-1].copy(), np.empty(3 * m, np.int32), np.empty(3 * m, np.int32)
    for f in range(m):
        for k in range(3):
            at = fill[faces[f, k]]
            half[at], end[at] = 3 * f + k, faces[f, (k + 1) % 3]
            fill[faces[f, k]] += 1
    return half, first, end


@njit(cache=True, nogil=True)
def followed(heir):  # type: ignore[no-untyped-def]
    """Return for each facet the last of its heirs."""
    out = heir.copy()
    for f in range(len(out)):
        while out[out[f]] != out[f]:
            out[f] = out[out[f]]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def pair_up(v, faces, n, part, fixed, left, begin, stop, mate):  # type: ignore[no-untyped-def]
    """Write the other side of each half edge of some facets into mate (3 m,), where both are of one smooth patch;
    return how far these facets rise over the planes of their neighbours at most [m], inf where the mesh is open.

    Args: v (k, 3) [m]; faces (m, 3); n (3 m, 3) corner normals; part (m,); fixed (m,) facets that stay as they are;
    left as `leaving` returns it; begin, stop: which facets.
    """
    half, first, end = left
    height = -np.inf
    for f in range(begin, stop):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            alike, found = 0, -1
            for i in range(first[b], first[b + 1]):
                if end[i] == a:
                    alike, found = alike + 1, i
            # The lower vertex's half edge sees to both; the other one only has to have it.
            if a < b:
                for i in range(first[a], first[a + 1]):
                    alike += end[i] == b
            if found < 0 or (a < b and alike != 2):
                height = np.inf
            elif a < b:
                h, g, c = 3 * f + k, half[found] // 3, half[found] % 3
                d, e = faces[f, (k + 2) % 3], faces[g, (c + 2) % 3]
                height = max(height, _height(v, faces, f, e), _height(v, faces, g, d))
                one = dot(row(n, h), row(n, 3 * g + (c + 1) % 3))
                two = dot(row(n, 3 * f + (k + 1) % 3), row(n, half[found]))
                if min(one, two) > _SOFT and part[f] == part[g] and not fixed[f] and not fixed[g]:
                    mate[h], mate[half[found]] = half[found], h
    return height


@njit(cache=True, forceinline=True)
def _height(v, faces, f, d):  # type: ignore[no-untyped-def]
    """Return how far a vertex lies over the plane of a facet [m]."""
    p = row(v, faces[f, 0])
    up = cross(less(row(v, faces[f, 1]), p), less(row(v, faces[f, 2]), p))
    return dot(less(row(v, d), p), up) / max(math.sqrt(dot(up, up)), 1e-300)


@njit(cache=True, nogil=True)
def lock(faces, mate, half, first, begin, stop, locked):  # type: ignore[no-untyped-def]
    """Write into locked (k,) about which of some vertices facets make no single closed fan.

    Args: half (k,) a half edge from each vertex; first (k + 1,) as `leaving` returns it; begin, stop: which vertices.
    """
    fan, ring = np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    for a in range(begin, stop):
        size = fan_of(faces, mate, half[a], fan, ring)
        locked[a] = size == 0 or size != first[a + 1] - first[a]


@njit(cache=True, forceinline=True)
def before(h):  # type: ignore[no-untyped-def]
    """Return the half edge before this one in its facet."""
    return h + 2 if h % 3 == 0 else h - 1


@njit(cache=True, forceinline=True)
def fan_of(faces, mate, start, out, ring):  # type: ignore[no-untyped-def]
    """Write the half edges that leave a vertex, in order from `start` on, into out, and where they end into ring;
    return how many, 0 where they close no fan."""
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
