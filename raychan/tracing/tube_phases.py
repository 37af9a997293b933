"""Phases: how the two-way phase runs over tubes, and how much each may scatter (numba loops)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.geometry.curved_patches import distance, length_to, place_on
from raychan.tracing.image_paths import weight


@njit(cache=True, nogil=True, error_model="numpy")
def phases(  # type: ignore[no-untyped-def]
    points, k, length, normals, facet, bary, v, b, image, far, antenna, wavenumber, strength, spread, limits,
    dull, material, materials, six, bend, bound, area, rough, way,
):  # fmt: skip
    """Write the two-way phases of tubes at corners and mid-edges, and what each tube may scatter.

    Args: bary (n, 3, 3): mid-edges lie on the true surface and are reached straight; (n, 0, 3): on the chord, with the
    length by the cubic Hermite rule; antenna of the way out (see `chains.weight`); limits (phase, turn, most_bend) as
    for `edge_to_cut`; dull (m,) facets whose material (m,), a row of `materials` (kind, eps, thickness, roughness),
    reflects in part. Written: six (n, 6) [rad], bend (n, 3) [rad], bound and area (n,) [1/m], rough (n,): above 1 where
    phase or normal bend more than a quadratic follows; way (n,) [m] the two-way length.
    """
    images, out_far, mirrors, table = antenna
    out_image = images[len(mirrors)]
    phase, turn, most_bend = limits
    kind, eps, thickness, roughness = materials
    first = bary.shape[1] == 3
    middle, look = np.empty(3), np.empty(3)
    for i in range(len(facet)):
        f = facet[i]
        low, high = np.inf, -np.inf
        for c in range(3):
            six[i, c] = wavenumber * (length[i, c] + length_to(points[i, c], out_image, out_far))
            low, high = min(low, six[i, c]), max(high, six[i, c])
        span = high - low
        way[i] = (six[i, 0] + six[i, 1] + six[i, 2]) / 3.0 / wavenumber
        for c in range(3):
            d = (c + 1) % 3
            if first:
                w = bary[i]
                x, y, z = 0.5 * (w[c, 0] + w[d, 0]), 0.5 * (w[c, 1] + w[d, 1]), 0.5 * (w[c, 2] + w[d, 2])
                place_on(v[f], b[f], x, y, z, middle)
                there = length_to(middle, image, far)
            else:
                turned = 0.0
                for x in range(3):
                    middle[x] = 0.5 * (points[i, c, x] + points[i, d, x])
                    turned += (k[i, c, x] - k[i, d, x]) * (points[i, d, x] - points[i, c, x])
                there = 0.5 * (length[i, c] + length[i, d]) + 0.125 * turned
            six[i, 3 + c] = wavenumber * (there + length_to(middle, out_image, out_far))
            bend[i, c] = six[i, 3 + c] - 0.5 * (six[i, c] + six[i, d])
            low, high = min(low, six[i, 3 + c]), max(high, six[i, 3 + c])
        back = length_to(points[i, 3], out_image, out_far)
        miss = wavenumber * (length[i, 3] + back) - (six[i, 0] + six[i, 1] + six[i, 2]) / 3.0
        miss -= (bend[i, 0] + bend[i, 1] + bend[i, 2]) * (4.0 / 9.0)
        p, q, r = points[i, 0], points[i, 1], points[i, 2]
        ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
        way_in = k[i, 3]
        across = (ay * bz - az * by) * way_in[0] + (az * bx - ax * bz) * way_in[1] + (ax * by - ay * bx) * way_in[2]
        gain = weight(points[i, 3], images, out_far, mirrors, table, look)
        if dull[f]:
            cosine = 0.0
            for c in range(3):
                cosine += normals[i, 3, c] * way_in[c]
            j = material[f]
            back_s, back_p, _, _ = coefficients(kind[j], eps[j], thickness[j], roughness[j], abs(cosine), wavenumber)
            gain *= max(abs(back_s), abs(back_p))
        share = wavenumber / (4.0 * math.pi) * abs(across) * strength[i] * spread[i] / (1.0 if out_far else back)
        area[i] = gain * share
        bound[i] = gain * (share / (1.0 + 0.5 * span))
        off = max(abs(miss) / phase, max(abs(bend[i, 0]), abs(bend[i, 1]), abs(bend[i, 2])) / most_bend)
        for c in range(3):
            off = max(off, distance(normals[i, c], normals[i, 3]) / turn)
        rough[i] = off / (1.0 + 0.5 * (high - low))
