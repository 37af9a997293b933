"""Outlines: which edges of clustered facets are outlines as seen from somewhere (numba loops).

Everywhere: faces (e, 2) facets on both sides of edges, -1 beyond a rim; k clusters of facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

_WIDE = 1e-6  # rad: rounding must not tell a cluster's side where a facet grazes


@njit(cache=True, nogil=True)
def by_cluster(faces, order, start):  # type: ignore[no-untyped-def]
    """Return edges by the cluster of their first facet, as (edges (e,), first (k + 1,)), and the other clusters beside
    each, as (beside (b,), begin (k + 1,)): itself where it has a rim; and the cluster of each facet (f,).

    Args: facets order[start[i] : start[i + 1]] make a cluster.
    """
    k = len(start) - 1
    cluster = np.empty(len(order), np.int32)
    for i in range(k):
        for at in range(start[i], start[i + 1]):
            cluster[order[at]] = i
    first = np.zeros(k + 1, np.int64)
    for e in range(len(faces)):
        first[cluster[faces[e, 0]] + 1] += 1
    for i in range(k):
        first[i + 1] += first[i]
    fill, edges = first.copy(), np.empty(len(faces), np.int32)
    for e in range(len(faces)):
        i = cluster[faces[e, 0]]
        edges[fill[i]] = e
        fill[i] += 1
    begin, beside, count = np.zeros(k + 1, np.int64), np.empty(1 << 10, np.int32), 0
    last = np.full(k, -1, np.int32)
    for i in range(k):
        for at in range(first[i], first[i + 1]):
            other = faces[edges[at], 1]
            j = i if other < 0 else cluster[other]
            if last[j] == i or (j == i and other >= 0):
                continue
            last[j] = i
            if count == len(beside):
                beside = np.append(beside, np.empty_like(beside))
            beside[count] = j
            count += 1
        begin[i + 1] = count
    return edges, first, beside[:count].copy(), begin, cluster


@njit(cache=True, nogil=True)
def turning(faces, edges, first, beside, begin, cluster, centre, radius, axis, spread, point, normal, image, far):  # type: ignore[no-untyped-def]
    """Return the edges (n,) of which one facet faces the image and the other does not, or is none; in no order.

    Args: edges to cluster as `by_cluster` gives them; centre (k, 3), radius (k,) [m], axis (k, 3), spread (k,) [rad] of
    clusters' balls and cones; point, normal (f, 3) of facets; image (3,) [m], or the direction to it when far.
    """
    k = len(radius)
    side = np.zeros(k, np.int8)
    d = np.empty(3)
    for i in range(k):
        there, along = 0.0, 0.0
        for c in range(3):
            d[c] = image[c] if far else image[c] - centre[i, c]
            there += d[c] * d[c]
            along += d[c] * axis[i, c]
        there = math.sqrt(there)
        if not far and not there > radius[i]:
            continue
        room = 0.5 * math.pi - spread[i] - _WIDE - (0.0 if far else math.asin(radius[i] / there))
        off = math.acos(min(max(along / there, -1.0), 1.0))
        if off < room:
            side[i] = 1
        elif math.pi - off < room:
            side[i] = -1
    out, count = np.empty(1 << 10, np.int64), 0
    for i in range(k):
        same = side[i] != 0
        for at in range(begin[i], begin[i + 1]):
            same &= beside[at] != i and side[beside[at]] == side[i]
        if same:
            continue
        for at in range(first[i], first[i + 1]):
            e = edges[at]
            if side[i] != 0 and faces[e, 1] >= 0 and side[cluster[faces[e, 1]]] == side[i]:
                continue
            front = 0
            for q in range(2):
                f = faces[e, q]
                towards = 0.0
                if f >= 0:
                    for c in range(3):
                        towards += normal[f, c] * (image[c] if far else image[c] - point[f, c])
                front += 1 if towards > 0.0 else 0
            if faces[e, 1] >= 0 and front != 1:
                continue
            if count == len(out):
                out = np.append(out, np.empty_like(out))
            out[count] = e
            count += 1
    return out[:count].copy()
