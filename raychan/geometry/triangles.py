"""Triangles: planes, edges and folds between neighbours, curvature, and bounds of clusters (numba kernels).

Everywhere: v, n (m, 3, 3) corners [m] and corner normals of the facets; normal (m, 3), area (m,) of their planes.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import dot, less

_SHARP = 0.95  # cosine of corner normals across an edge above which it is round, not a wedge; not measured


@njit(cache=True, nogil=True)
def transform(rows, matrix, shift):  # type: ignore[no-untyped-def]
    """Return matrix (3, 3) times each of the rows (n, 3), plus shift (3,)."""
    # NumPy's product of arrays this narrow takes 6 to 12 times as long.
    out = np.empty((len(rows), 3))
    for i in range(len(rows)):
        x, y, z = rows[i, 0], rows[i, 1], rows[i, 2]
        for c in range(3):
            out[i, c] = matrix[c, 0] * x + matrix[c, 1] * y + matrix[c, 2] * z + shift[c]
    return out


@njit(cache=True, nogil=True)
def pose(vertices, faces, normals, matrix, shift, v, n):  # type: ignore[no-untyped-def]
    """Write the corners v (m, 3, 3) [m] and corner normals n (m, 3, 3) of faces (m, 3) of vertices (k, 3) [m], turned
    by a matrix (3, 3) and shifted by (3,) [m]."""
    there = transform(vertices, matrix, shift)
    for f in range(len(faces)):
        for q in range(3):
            x, y, z = normals[f, q, 0], normals[f, q, 1], normals[f, q, 2]
            for c in range(3):
                v[f, q, c] = there[faces[f, q], c]
                n[f, q, c] = matrix[c, 0] * x + matrix[c, 1] * y + matrix[c, 2] * z


@njit(cache=True, nogil=True)
def planes_of(v):  # type: ignore[no-untyped-def]
    """Return unit normals (m, 3), zero where a facet has no area, and areas (m,) [m^2]."""
    m = len(v)
    normal, area = np.empty((m, 3)), np.empty(m)
    e, f = np.empty(3), np.empty(3)
    for i in range(m):
        for c in range(3):
            e[c], f[c] = v[i, 1, c] - v[i, 0, c], v[i, 2, c] - v[i, 0, c]
        x = e[1] * f[2] - e[2] * f[1]
        y = e[2] * f[0] - e[0] * f[2]
        z = e[0] * f[1] - e[1] * f[0]
        size = math.sqrt(x * x + y * y + z * z)
        area[i] = 0.5 * size
        by = size if size > 0.0 else 1.0
        normal[i, 0], normal[i, 1], normal[i, 2] = x / by, y / by, z / by
    return normal, area


@njit(cache=True, forceinline=True)
def edge_curvature(p, q, m, n):  # type: ignore[no-untyped-def]
    """Return the curvature (3,) [m] of the edge from corner p with normal m to corner q with normal n (see
    `edge_curvatures`)."""
    d = less(q, p)
    a = dot(m, n)
    det = 1.0 - a * a
    if not det > 1e-12:
        return 0.0, 0.0, 0.0
    here, there = dot(d, m), -dot(d, n)
    s, t = (here - a * there) / det, (there - a * here) / det
    c = s * m[0] + t * n[0], s * m[1] + t * n[1], s * m[2] + t * n[2]
    # On a circle |c| is half the chord times the turn. Normals that contradict their edge (S-shape), as rounded corners
    # of a fine mesh do, ask for more, along the edge: there it bends as much as both ends do in the mean.
    if not math.sqrt(dot(c, c)) < math.sqrt(max(2.0 * (1.0 - a), 0.0)) * math.sqrt(dot(d, d)):
        s = 0.5 * (here + there) / (1.0 + a) if a > 0.0 else 0.0
        c = s * (m[0] + n[0]), s * (m[1] + n[1]), s * (m[2] + n[2])
    return c


@njit(cache=True, nogil=True, error_model="numpy")
def edge_curvatures(v, n):  # type: ignore[no-untyped-def]
    """Return the edge curvatures c (m, 3, 3) [m] of the quadratic patches x = sum l_i x_i - sum c_ij l_i l_j through
    corners and corner normals, and which facets (m,) are curved.

    Source: Nagata (2005), Computer Aided Geometric Design 22(4), eq. 10.
    """
    m = len(v)
    out, curved = np.empty((m, 3, 3)), np.zeros(m, np.bool_)
    for f in range(m):
        for i in range(3):
            p, q = facet_edge(v, f, i)
            a, b = facet_edge(n, f, i)
            c = edge_curvature(p, q, a, b)
            out[f, i, 0], out[f, i, 1], out[f, i, 2] = c
            curved[f] |= max(abs(c[0]), abs(c[1]), abs(c[2])) > 1e-9
    return out, curved


@njit(cache=True, forceinline=True)
def facet_edge(v, f, i):  # type: ignore[no-untyped-def]
    """Return what facet f of v (m, 3, 3) has at both ends of its edge i, as two vectors."""
    j = (i + 1) % 3
    return (v[f, i, 0], v[f, i, 1], v[f, i, 2]), (v[f, j, 0], v[f, j, 1], v[f, j, 2])


@njit(cache=True, nogil=True)
def extents(v, body, count):  # type: ignore[no-untyped-def]
    """Return the lowest and highest corner (count, 2, 3) [m] of bodies whose facets are numbered body (m,); inf and
    -inf of one that has none."""
    out = np.empty((count, 2, 3))
    out[:, 0], out[:, 1] = np.inf, -np.inf
    for f in range(len(v)):
        b = body[f]
        for q in range(3):
            for c in range(3):
                out[b, 0, c], out[b, 1, c] = min(out[b, 0, c], v[f, q, c]), max(out[b, 1, c], v[f, q, c])
    return out


@njit(cache=True, nogil=True)
def half_edge_ends(v, half):  # type: ignore[no-untyped-def]
    """Return both ends (e, 2, 3) [m] of half edges (e,): 3 f + k runs from corner k of facet f to the next."""
    out = np.empty((len(half), 2, 3))
    for i in range(len(half)):
        f, k = half[i] // 3, half[i] % 3
        for c in range(3):
            out[i, 0, c], out[i, 1, c] = v[f, k, c], v[f, (k + 1) % 3, c]
    return out


@njit(cache=True, nogil=True)
def edge_folds(pair, v, n, normal, area):  # type: ignore[no-untyped-def]
    """Return how two facets meet at their edge, given as half edges (e, 2), 3 f + k from corner k of facet f on.

    Returns: whether they share a plane (flat), share corner normals (soft), meet in a convex edge (convex), in a wedge
    (sharp), and how far the second rises over the first's plane (e,) [m].
    """
    e = len(pair)
    flat, soft, convex = np.empty(e, np.bool_), np.empty(e, np.bool_), np.empty(e, np.bool_)
    sharp, height = np.empty(e, np.bool_), np.empty(e)
    for i in range(e):
        a, b, ka, kb = pair[i, 0] // 3, pair[i, 1] // 3, pair[i, 0] % 3, pair[i, 1] % 3
        cosine, here, there, up = 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            cosine += normal[a, c] * normal[b, c]
            # The two facets run along their edge in opposite directions.
            here += n[a, ka, c] * n[b, (kb + 1) % 3, c]
            there += n[a, (ka + 1) % 3, c] * n[b, kb, c]
            up += (v[b, (kb + 2) % 3, c] - v[a, ka, c]) * normal[a, c]
        flat[i] = abs(cosine) > 1.0 - 1e-10
        soft[i] = here > 1.0 - 1e-6 and there > 1.0 - 1e-6
        convex[i] = up < -1e-9 * math.sqrt(area[b])
        sharp[i] = up < -1e-9 and here < _SHARP
        height[i] = up
    return flat, soft, convex, sharp, height


@njit(cache=True, nogil=True)
def cluster_bounds(order, first, v, edge_curvature):  # type: ignore[no-untyped-def]
    """Return for clusters of facets, order[first[i] : first[i + 1]], bounding spheres of their curved surfaces: centre
    (k, 3) and radius (k,) [m]."""
    k = len(first) - 1
    centre, radius = np.zeros((k, 3)), np.zeros(k)
    low, high = np.empty(3), np.empty(3)
    for i in range(k):
        low[:], high[:] = np.inf, -np.inf
        for at in range(first[i], first[i + 1]):
            f = order[at]
            for q in range(3):
                for c in range(3):
                    low[c], high[c] = min(low[c], v[f, q, c]), max(high[c], v[f, q, c])
        for c in range(3):
            centre[i, c] = 0.5 * (low[c] + high[c])
        most = 0.0
        for at in range(first[i], first[i + 1]):
            f = order[at]
            for q in range(3):
                off, out = 0.0, 0.0
                for c in range(3):
                    off += (v[f, q, c] - centre[i, c]) ** 2
                    out += edge_curvature[f, q, c] ** 2
                radius[i], most = max(radius[i], off), max(most, out)
        # Of a patch's three products l_i l_j the sum is at most 1/3.
        radius[i] = math.sqrt(radius[i]) + math.sqrt(most) / 3.0
    return centre, radius
