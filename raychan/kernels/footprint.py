"""How a tube's footprint weighs from corner to corner: obliquity, spreading, and the area of the true surface."""

from __future__ import annotations

import math

import numpy as np

from raychan.kernels.jit import njit


@njit(cache=True, inline="always")
def _element(v, b, w, out):  # type: ignore[no-untyped-def]
    """Write the vector [m^2] normal to the true surface at w (3,): its area for a unit of the last two coordinates."""
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        along_d = v[1, d] - v[0, d] - (w[0] - w[1]) * b[0, d] - w[2] * (b[1, d] - b[2, d])
        along_e = v[1, e] - v[0, e] - (w[0] - w[1]) * b[0, e] - w[2] * (b[1, e] - b[2, e])
        aside_d = v[2, d] - v[0, d] + w[1] * (b[0, d] - b[1, d]) - (w[0] - w[2]) * b[2, d]
        aside_e = v[2, e] - v[0, e] + w[1] * (b[0, e] - b[1, e]) - (w[0] - w[2]) * b[2, e]
        out[c] = along_d * aside_e - along_e * aside_d


@njit(cache=True, nogil=True)
def elements(facet, bary, v, b):  # type: ignore[no-untyped-def]
    """Return vectors (n, m, 3) [m^2] normal to the true surface at barycentric coordinates (n, m, 3) of facets (n,):
    its area for a unit of the last two of these.

    Args: v (f, 3, 3) [m] corners, b (f, 3, 3) [m] bulges of the edges (Nagata 2005, eq. 10).
    """
    out = np.empty(bary.shape)
    for i in range(len(facet)):
        for q in range(bary.shape[1]):
            _element(v[facet[i]], b[facet[i]], bary[i, q], out[i, q])
    return out


@njit(cache=True, inline="always")
def _mean_cosine(normal, k, back):  # type: ignore[no-untyped-def]
    total = 0.0
    for c in range(3):
        total -= 0.5 * normal[c] * (k[c] + back[c])
    return total


@njit(cache=True, nogil=True)
def tapers(  # type: ignore[no-untyped-def]
    points, k, length, normals, back_k, back, far, facet, bary, bent, facing, v, b
):
    """Return the mean obliquity times spreading at corners over that at the centre (n, 3), for areas of the flat
    footprints; zero beyond the terminator.

    Args: of tubes (n, 4, ...) points, directions and lengths in and back, normals on the lit side; bent (n,) on a
    curved facet still, whose plane has the normal `facing` (n, 3); bary, v, b as for `elements`.
    """
    n = len(facet)
    out = np.empty((n, 3))
    flat, element = np.empty(3), np.empty(3)
    for i in range(n):
        p, q, r = points[i, 0], points[i, 1], points[i, 2]
        size = 0.0
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            flat[c] = 0.5 * ((q[d] - p[d]) * (r[e] - p[e]) - (q[e] - p[e]) * (r[d] - p[d]))
            size += flat[c] * flat[c]
        area = max(math.sqrt(size), 1e-300)
        w, side = bary[i], 0.0
        share = w[0, 0] * (w[1, 1] * w[2, 2] - w[1, 2] * w[2, 1])
        share -= w[0, 1] * (w[1, 0] * w[2, 2] - w[1, 2] * w[2, 0])
        share += w[0, 2] * (w[1, 0] * w[2, 1] - w[1, 1] * w[2, 0])
        for c in range(3):
            side += facing[i, c] * normals[i, 3, c]
        centre = max(_mean_cosine(normals[i, 3], k[i, 3], back_k[i, 3]), 0.0)
        if not far:
            centre /= length[i, 3] * back[i, 3]
        for j in range(3):
            if bent[i]:
                _element(v[facet[i]], b[facet[i]], w[j], element)
                strength = _mean_cosine(element, k[i, j], back_k[i, j]) * (0.5 * abs(share) / area)
                if side < 0.0:
                    strength = -strength
            else:
                # Where the true surface turns away from the flat one there is more of it.
                turned = 0.0
                for c in range(3):
                    turned += normals[i, j, c] * flat[c] / area
                strength = _mean_cosine(normals[i, j], k[i, j], back_k[i, j]) / max(abs(turned), 0.5)
            strength = max(strength, 0.0)
            if not far:
                strength /= length[i, j] * back[i, j]
            out[i, j] = min(strength / centre, 4.0) if centre > 0.0 else 0.0
    return out
