"""How far points of a surface lie off the curved patches of a coarser mesh of it (numba kernels).

Everywhere: a point p (3,) [m] and the surface's normal there (3,); v, n, b (m, 3, 3) corners, corner normals and edge
curvatures of the patches (see geometry.curved_patches).
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.triangles import edge_curvatures

_OUTSIDE = -1e-9  # barycentric coordinate from which a point lies beyond an edge: rounding
_STEPS = 3  # of the search for a foot point; each leaves a few hundredths of the last one's error
_WALK = 400  # facets passed in search of a point's own; beyond, it is lost


@njit(cache=True, forceinline=True)
def beyond(p, normal, v):  # type: ignore[no-untyped-def]
    """Return -1 where the line through p along the normal meets a triangle v (3, 3), else the corner opposite to the
    edge beyond which it passes farthest, and two of its barycentric coordinates."""
    x, y, z = normal[0], normal[1], normal[2]
    x0, y0, z0 = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    x1, y1, z1 = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    dx, dy, dz = p[0] - v[0, 0], p[1] - v[0, 1], p[2] - v[0, 2]
    # Gradients of the coordinates across the normal, not yet divided.
    gx, gy, gz = y1 * z - z1 * y, z1 * x - x1 * z, x1 * y - y1 * x
    hx, hy, hz = y * z0 - z * y0, z * x0 - x * z0, x * y0 - y * x0
    whole = x0 * gx + y0 * gy + z0 * gz
    if whole == 0.0:
        return 0, 0.0, 0.0
    s, t = (dx * gx + dy * gy + dz * gz) / whole, (dx * hx + dy * hy + dz * hz) / whole
    r = 1.0 - s - t
    if min(r, s, t) >= _OUTSIDE:
        return -1, s, t
    return (0 if r <= min(s, t) else 1 if s <= t else 2), s, t


@njit(cache=True, nogil=True)
def _offset(p, normal, v, n, b, s, t):  # type: ignore[no-untyped-def]
    """Return how far a point lies off a patch along the normal [m], and how far the patch's normal there is off [rad],
    for v, n, b (3, 3); s, t are the coordinates of the point on the flat facet."""
    x, y, z = normal[0], normal[1], normal[2]
    x0, y0, z0 = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    x1, y1, z1 = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    gx, gy, gz = y1 * z - z1 * y, z1 * x - x1 * z, x1 * y - y1 * x
    hx, hy, hz = y * z0 - z * y0, z * x0 - x * z0, x * y0 - y * x0
    whole = x0 * gx + y0 * gy + z0 * gz
    if whole == 0.0:
        return np.inf, np.inf
    off = 0.0
    for _ in range(_STEPS):
        r = 1.0 - s - t
        rs, st, tr = r * s, s * t, t * r
        dx = p[0] - (r * v[0, 0] + s * v[1, 0] + t * v[2, 0] - rs * b[0, 0] - st * b[1, 0] - tr * b[2, 0])
        dy = p[1] - (r * v[0, 1] + s * v[1, 1] + t * v[2, 1] - rs * b[0, 1] - st * b[1, 1] - tr * b[2, 1])
        dz = p[2] - (r * v[0, 2] + s * v[1, 2] + t * v[2, 2] - rs * b[0, 2] - st * b[1, 2] - tr * b[2, 2])
        off = dx * x + dy * y + dz * z
        # Move the foot point as if the patch were flat.
        s += (dx * gx + dy * gy + dz * gz) / whole
        t += (dx * hx + dy * hy + dz * hz) / whole
    r, size, along = 1.0 - s - t, 0.0, 0.0
    for c in range(3):
        at = r * n[0, c] + s * n[1, c] + t * n[2, c]
        size += at * at
        along += at * normal[c]
    size = math.sqrt(size)
    # Chord of the angle; 1 - cosine would lose digits.
    turned = 0.0
    for c in range(3):
        turned += ((r * n[0, c] + s * n[1, c] + t * n[2, c]) / size - normal[c]) ** 2
    return abs(off), math.sqrt(turned) if along > 0.0 else np.inf


@njit(cache=True, nogil=True)
def patch_offset(p, normal, v, n):  # type: ignore[no-untyped-def]
    """Return how far a point lies off a single patch along the normal [m], and how far the patch's normal there is off
    [rad], for v, n (1, 3, 3)."""
    _, s, t = beyond(p, normal, v[0])
    return _offset(p, normal, v[0], n[0], edge_curvatures(v, n)[0][0], s, t)


@njit(cache=True, nogil=True)
def offsets(place, normal, facet, patches, mate, number, off, turned):  # type: ignore[no-untyped-def]
    """Find the patch above or below each point, and how far the point is off it.

    Args: place, normal (s, 3); facet (s,) at which to begin, the one found is written; patches v, n, b; mate (3 f,) the
    half edge on the other side, by facet; number (f,) of each facet's patch; off (s,) [m] and turned (s,) [rad] are
    written, inf for a point that has no patch.
    """
    v, n, b = patches
    for i in range(len(place)):
        f, steps, s, t = facet[i], 0, 0.0, 0.0
        while steps < _WALK:
            k, s, t = beyond(place[i], normal[i], v[number[f]])
            if k < 0:
                break
            # The edge opposite to corner k is the half edge from the corner after it.
            other = mate[3 * f + (k + 1) % 3]
            if other < 0:
                break
            f, steps = other // 3, steps + 1
        facet[i] = f
        if steps == _WALK:
            off[i], turned[i] = np.inf, np.inf
        else:
            off[i], turned[i] = _offset(place[i], normal[i], v[number[f]], n[number[f]], b[number[f]], s, t)
