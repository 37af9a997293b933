"""Silhouette edges: which edges turn away from a point or a direction (numba kernels).

Everywhere: faces (e, 2) facets on both sides of edges, -1 beyond a boundary edge.
"""

from __future__ import annotations

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import copy_to


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
def silhouette_edges(faces, point, normal, image, far):  # type: ignore[no-untyped-def]
    """Return the edges (n,) in order of which one facet faces the image and the other does not, or is none.

    Args: faces (e, 2); point, normal (f, 3) of facets; image (3,) [m], or the direction to it when far.
    """
    out, count = np.empty(1 << 10, np.int64), 0
    for e in range(len(faces)):
        if not _is_silhouette(faces[e, 0], faces[e, 1], point, normal, image, far):
            continue
        if count == len(out):
            before, out = out, np.empty(2 * count, np.int64)
            copy_to(out[:count], before)
        out[count] = e
        count += 1
    return out[:count].copy()
