"""How far points of a surface lie off the curved patches of a coarser mesh of it (numba kernels).

Everywhere: a point p (3,) [m] and the surface's normal there (3,); v, n, b the three corners, corner normals and edge
curvatures of a patch (see geometry.curved_patches), each as three vectors of three numbers: arrays would count
references.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.triangles import edge_curvature, facet_edge
from raychan.vectors import cross, dot, less, row

_OUTSIDE = -1e-9  # barycentric coordinate from which a point lies beyond an edge: rounding
# Of the search for a foot point. A third one changes how far points lie off by at most 2e-4 of what is allowed, where
# all are within that: a sphere, a torus, a capsule, an ellipsoid of 80,000 to 180,000 facets at 0.05 and 0.5 dB.
_STEPS = 2
_WALK = 400  # facets passed in search of a point's own; beyond, it is lost
# Largest deviation anywhere on a facet over that of the points checked: 1.53 at most on spheres and tori of 20,000 to
# 100,000 facets at 0.05 to 1 dB, against their closed forms (command not noted).
BETWEEN = 1.6


@njit(cache=True, forceinline=True)
def _gradients(normal, v):  # type: ignore[no-untyped-def]
    """Return the gradients of two barycentric coordinates across a normal, times some number, and its inverse: inf if
    it is 0."""
    one, two = less(v[1], v[0]), less(v[2], v[0])
    g, h = cross(two, normal), cross(normal, one)
    whole = dot(one, g)
    return g, h, 1.0 / whole if whole != 0.0 else np.inf


@njit(cache=True, forceinline=True)
def beyond(p, normal, v):  # type: ignore[no-untyped-def]
    """Return -1 where the line through p along the normal meets a triangle v, else the corner opposite to the edge
    beyond which it passes farthest, and two of its barycentric coordinates."""
    g, h, inverse = _gradients(normal, v)
    if inverse == np.inf:
        return 0, 0.0, 0.0
    d = less(p, v[0])
    s, t = dot(d, g) * inverse, dot(d, h) * inverse
    r = 1.0 - s - t
    if min(r, s, t) >= _OUTSIDE:
        return -1, s, t
    return (0 if r <= min(s, t) else 1 if s <= t else 2), s, t


@njit(cache=True, forceinline=True)
def _offset(p, normal, v, n, b, s, t):  # type: ignore[no-untyped-def]
    """Return how far a point lies off a patch along the normal [m], and how far the patch's normal there is off [rad];
    s, t are the coordinates of the point on the flat facet."""
    g, h, inverse = _gradients(normal, v)
    if inverse == np.inf:
        return np.inf, np.inf
    off = 0.0
    for _ in range(_STEPS):
        r = 1.0 - s - t
        rs, st, tr = r * s, s * t, t * r
        d = (
            p[0] - (r * v[0][0] + s * v[1][0] + t * v[2][0] - rs * b[0][0] - st * b[1][0] - tr * b[2][0]),
            p[1] - (r * v[0][1] + s * v[1][1] + t * v[2][1] - rs * b[0][1] - st * b[1][1] - tr * b[2][1]),
            p[2] - (r * v[0][2] + s * v[1][2] + t * v[2][2] - rs * b[0][2] - st * b[1][2] - tr * b[2][2]),
        )
        off = dot(d, normal)
        # Move the foot point as if the patch were flat.
        s += dot(d, g) * inverse
        t += dot(d, h) * inverse
    r = 1.0 - s - t
    x = r * n[0][0] + s * n[1][0] + t * n[2][0]
    y = r * n[0][1] + s * n[1][1] + t * n[2][1]
    z = r * n[0][2] + s * n[1][2] + t * n[2][2]
    one = 1.0 / math.sqrt(x * x + y * y + z * z)
    # Chord of the angle; 1 - cosine would lose digits.
    turned = math.sqrt((x * one - normal[0]) ** 2 + (y * one - normal[1]) ** 2 + (z * one - normal[2]) ** 2)
    return abs(off), turned if x * normal[0] + y * normal[1] + z * normal[2] > 0.0 else np.inf


@njit(cache=True, forceinline=True)
def patch_offset(p, normal, v, n):  # type: ignore[no-untyped-def]
    """Return how far a point lies off a single patch along the normal [m], and how far the patch's normal there is off
    [rad]."""
    _, s, t = beyond(p, normal, v)
    b = (
        edge_curvature(v[0], v[1], n[0], n[1]),
        edge_curvature(v[1], v[2], n[1], n[2]),
        edge_curvature(v[2], v[0], n[2], n[0]),
    )
    return _offset(p, normal, v, n, b, s, t)


@njit(cache=True, forceinline=True)
def _corners(v, f):  # type: ignore[no-untyped-def]
    """Return what facet f of v (m, 3, 3) has at its corners."""
    return (
        (v[f, 0, 0], v[f, 0, 1], v[f, 0, 2]),
        (v[f, 1, 0], v[f, 1, 1], v[f, 1, 2]),
        (v[f, 2, 0], v[f, 2, 1], v[f, 2, 2]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def patches(net, rows, v, n, b):  # type: ignore[no-untyped-def]
    """Write the corners, corner normals and edge curvatures (r, 3, 3) of the patches of some facets (r,) of a net, its
    vertices (k, 3) [m], normals (c, 3), faces (m, 3) and corners (m, 3) there."""
    place, normal, faces, corner = net
    for i in range(len(rows)):
        f = rows[i]
        for k in range(3):
            a, c = faces[f, k], corner[f, k]
            for x in range(3):
                v[i, k, x], n[i, k, x] = place[a, x], normal[c, x]
        for k in range(3):
            p, q = facet_edge(v, i, k)
            b[i, k, 0], b[i, k, 1], b[i, k, 2] = edge_curvature(p, q, *facet_edge(n, i, k))


@njit(cache=True, nogil=True, error_model="numpy")
def offsets(place, normal, begin, net, most, found, off, excess):  # type: ignore[no-untyped-def]
    """Find the patch above or below each point, and how far the point is off it; return the largest off [m] and excess.

    Args: place, normal (s, 3); begin (s,) the facet at which each search begins, by its heir; net: heir (f,) of facets,
    patches v, n, b (m, 3, 3) of those there are, mate (3 f,) the half edge on the other side, number (f,) of each
    facet's patch, same (f,) whether it is as it was when the points were last found; most: deviation [m], normal [rad]
    allowed; found (s,) facets, off (s,) [m] and excess (s,), over what is allowed, are written, inf for a point that
    has no patch. They hold what was found last: a point on a facet that is the same stays.
    """
    heir, (v, n, b), mate, number, same = net
    farthest, worst = 0.0, 0.0
    for i in range(len(place)):
        if not same[found[i]]:
            p, up = row(place, i), row(normal, i)
            f, steps, s, t = heir[begin[i]], 0, 0.0, 0.0
            while steps < _WALK:
                k, s, t = beyond(p, up, _corners(v, number[f]))
                if k < 0:
                    break
                # The edge opposite to corner k is the half edge from the corner after it.
                other = mate[3 * f + (k + 1) % 3]
                if other < 0:
                    break
                f, steps = other // 3, steps + 1
            found[i] = f
            if steps == _WALK:
                off[i], excess[i] = np.inf, np.inf
            else:
                m = number[f]
                far, turned = _offset(p, up, _corners(v, m), _corners(n, m), _corners(b, m), s, t)
                off[i] = BETWEEN * far
                excess[i] = max(off[i] / most[0], turned / most[1])
        farthest, worst = max(farthest, off[i]), max(worst, excess[i])
    return farthest, worst


@njit(cache=True, nogil=True, error_model="numpy")
def vertices(v, n, half, facet, rows, place, normal, begin):  # type: ignore[no-untyped-def]
    """Write some vertices (r,) into place (r, 3) [m], normals there into normal (r, 3), and of a facet at each its
    `facet` (m,) into begin (r,).

    Args: v (k, 3) [m]; n (3 m, 3) corner normals; half (k,) a half edge from each vertex.
    """
    for i in range(len(rows)):
        a, h = rows[i], half[rows[i]]
        begin[i] = facet[h // 3]
        for x in range(3):
            place[i, x], normal[i, x] = v[a, x], n[h, x]


@njit(cache=True, nogil=True, error_model="numpy")
def centres(v, faces, n, facet, rows, place, normal, begin):  # type: ignore[no-untyped-def]
    """Write the centres of the curved patches of some facets (r,) into place (r, 3) [m], their normals there into
    normal (r, 3), and their `facet` (m,) into begin (r,).

    Args: v (k, 3) [m]; faces (m, 3); n (3 m, 3) corner normals.
    """
    for i in range(len(rows)):
        f = rows[i]
        begin[i] = facet[f]
        p, q, r = row(v, faces[f, 0]), row(v, faces[f, 1]), row(v, faces[f, 2])
        a, b, c = row(n, 3 * f), row(n, 3 * f + 1), row(n, 3 * f + 2)
        e, g, h = edge_curvature(p, q, a, b), edge_curvature(q, r, b, c), edge_curvature(r, p, c, a)
        up = a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]
        size = math.sqrt(up[0] ** 2 + up[2] ** 2 + up[1] ** 2)
        for x in range(3):
            place[i, x] = (p[x] + q[x] + r[x]) / 3.0 - (e[x] + g[x] + h[x]) / 9.0
            normal[i, x] = up[x] / size
