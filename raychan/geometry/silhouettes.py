"""Silhouette edges: which edges of clustered facets turn away from a point or a direction (numba kernels).

Clusters whose normal cones face the point altogether, or turn away from it, with all their neighbours, hold none and
are skipped.

Everywhere: faces (e, 2) facets on both sides of edges, -1 beyond a boundary edge; k clusters of facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit

_ROUNDING = 1e-6  # rad by which a cluster must clearly face the point, or turn away


@njit(cache=True, nogil=True)
def edges_by_cluster(faces, order, start):  # type: ignore[no-untyped-def]
    """Return edges by the cluster of their first facet, as (edges (e,), first (k + 1,)); the other clusters beside
    each, as (beside (b,), begin (k + 1,)), itself among them where it has a boundary edge; and the cluster of each
    facet (f,).

    Args: facets order[start[i] : start[i + 1]] make cluster i.
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


@njit(cache=True, forceinline=True)
def _cluster_sides(centre, radius, axis, half_angle, image, far):  # type: ignore[no-untyped-def]
    """Return of clusters (k,) 1 where all facets face the image, -1 where all turn away, 0 where that is not sure."""
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
        room = 0.5 * math.pi - half_angle[i] - _ROUNDING - (0.0 if far else math.asin(radius[i] / there))
        off = math.acos(min(max(along / there, -1.0), 1.0))
        if off < room:
            side[i] = 1
        elif math.pi - off < room:
            side[i] = -1
    return side


@njit(cache=True, forceinline=True)
def _is_silhouette(f, g, point, normal, image, far):  # type: ignore[no-untyped-def]
    """Tell whether of the facets f and g beside an edge one faces the image and the other does not, or is none."""
    if g < 0:
        return True
    front = 0
    for h in (f, g):
        towards = 0.0
        for c in range(3):
            towards += normal[h, c] * (image[c] if far else image[c] - point[h, c])
        front += 1 if towards > 0.0 else 0
    return front == 1


@njit(cache=True, nogil=True)
def silhouette_edges(edges_of, clusters, point, normal, image, far):  # type: ignore[no-untyped-def]
    """Return the edges (n,) of which one facet faces the image and the other does not, or is none; in no order.

    Args: edges_of: faces and what `edges_by_cluster` returns; clusters: centre (k, 3), radius (k,) [m] of bounding
    spheres, axis (k, 3), half angle (k,) [rad] of normal cones; point, normal (f, 3) of facets; image (3,) [m], or the
    direction to it when far.
    """
    faces, edges, first, beside, begin, cluster = edges_of
    centre, radius, axis, half_angle = clusters
    side = _cluster_sides(centre, radius, axis, half_angle, image, far)
    out, count = np.empty(1 << 10, np.int64), 0
    for i in range(len(radius)):
        same = side[i] != 0
        for at in range(begin[i], begin[i + 1]):
            same &= beside[at] != i and side[beside[at]] == side[i]
        if same:
            continue
        for at in range(first[i], first[i + 1]):
            e = edges[at]
            f, g = faces[e, 0], faces[e, 1]
            if side[i] != 0 and g >= 0 and side[cluster[g]] == side[i]:
                continue
            if not _is_silhouette(f, g, point, normal, image, far):
                continue
            if count == len(out):
                out = np.append(out, np.empty_like(out))
            out[count] = e
            count += 1
    return out[:count].copy()
