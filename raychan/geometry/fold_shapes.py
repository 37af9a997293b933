"""What folds of a mesh are like: lengths, outward or inward, and how facets bend over them (numba kernels).

Everywhere: v (k, 3) [m] vertices; faces (m, 3); pair (e, 2) half edges of both sides of an edge, half edge 3 f + k runs
from corner k of facet f to the next.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import cross, dot, less, row


@njit(cache=True, nogil=True, error_model="numpy")
def edge_lengths(v, faces, pair):  # type: ignore[no-untyped-def]
    """Return the lengths (e,) [m] of edges."""
    out = np.empty(len(pair))
    for e in range(len(pair)):
        d = _span(v, faces, pair[e, 0])
        out[e] = math.sqrt(dot(d, d))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def outward(v, faces, normal, pair):  # type: ignore[no-untyped-def]
    """Return 1 (e,) where the facets of a pair, unit normals (m, 3), make a convex fold, -1 where a concave one."""
    out = np.empty(len(pair))
    for e in range(len(pair)):
        f, k = pair[e, 1] // 3, pair[e, 1] % 3
        tip = less(row(v, faces[f, (k + 2) % 3]), row(v, faces[f, k]))
        out[e] = -1.0 if dot(row(normal, pair[e, 0] // 3), tip) > 0.0 else 1.0
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def bends(v, faces, normal, pair, fold):  # type: ignore[no-untyped-def]
    """Return by how much (m,) [m rad] each facet bends most over its edges, and across that: the eigenvalues of the sum
    of fold times length over its edges, as tensors across these; on a singly curved surface the second is zero. Args:
    as for `outward`; fold (e,) [rad].

    Source: Cohen-Steiner, Morvan, Restricted Delaunay triangulations and normal cycle, Proc. SCG 2003.
    """
    tensor = np.zeros((len(faces), 6))
    for e in range(len(pair)):
        d = _span(v, faces, pair[e, 0])
        length = max(math.sqrt(dot(d, d)), 1e-300)
        for side in range(2):
            f = pair[e, side] // 3
            a, by = cross(d, row(normal, f)), fold[e] / length
            tensor[f, 0] += by * a[0] * a[0]
            tensor[f, 1] += by * a[1] * a[1]
            tensor[f, 2] += by * a[2] * a[2]
            tensor[f, 3] += by * a[0] * a[1]
            tensor[f, 4] += by * a[1] * a[2]
            tensor[f, 5] += by * a[2] * a[0]
    most, least = np.empty(len(faces)), np.empty(len(faces))
    for f in range(len(faces)):
        xx, yy, zz, xy, yz, zx = tensor[f]
        # The third eigenvalue, along the normal, is zero.
        whole, product = xx + yy + zz, xx * yy + yy * zz + zz * xx - xy * xy - yz * yz - zx * zx
        most[f] = 0.5 * (whole + math.sqrt(max(whole * whole - 4.0 * product, 0.0)))
        least[f] = max(product, 0.0) / most[f] if most[f] > 0.0 else 0.0
    return most, least


@njit(cache=True, forceinline=True)
def _span(v, faces, half):  # type: ignore[no-untyped-def]
    """Return the vector [m] along a half edge."""
    f, k = half // 3, half % 3
    return less(row(v, faces[f, (k + 1) % 3]), row(v, faces[f, k]))
