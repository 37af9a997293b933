"""Landing: where the rays of tubes go after a mirror, how much hangs on it, and their state where they land (numba).

Everywhere: points, k, normals (n, 4, 3) [m], length (n, 4) [m] of tubes on their mirror (three corners, the centre);
way (n, 4, 3) directions after it; first, normal (f, 3): a point and the normal of each facet.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.em.fresnel import coefficients
from raychan.geometry.curved_patches import length_to

_DRAWN = 0.98  # of a corner's distance from the centre: corners lie on edges that other facets share


@njit(cache=True, forceinline=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, forceinline=True)
def _twice_area(p, k):  # type: ignore[no-untyped-def]
    """Return twice the area of a triangle as seen along k."""
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    return (ay * bz - az * by) * k[0] + (az * bx - ax * bz) * k[1] + (ax * by - ay * bx) * k[2]


@njit(cache=True, forceinline=True)
def _strength(j, materials, cosine, wavenumber):  # type: ignore[no-untyped-def]
    """Return the larger of |R_s|, |R_p| of a material."""
    kind, eps, thickness, roughness = materials
    back_s, back_p, _, _ = coefficients(kind[j], eps[j], thickness[j], roughness[j], cosine, wavenumber)
    return max(abs(back_s), abs(back_p))


@njit(cache=True, nogil=True, error_model="numpy")
def reflected(k, normals, way):  # type: ignore[no-untyped-def]
    """Write the directions after reflection at the true surface."""
    for i in range(len(k)):
        for q in range(4):
            twice = 2.0 * _dot(k[i, q], normals[i, q])
            for c in range(3):
                way[i, q, c] = k[i, q, c] - twice * normals[i, q, c]


@njit(cache=True, nogil=True, error_model="numpy")
def weigh(  # type: ignore[no-untyped-def]
    points, k, length, normals, facet, strength, spread, image, far, wavenumber, dull, material, materials, area, bound,
    whole,
):  # fmt: skip
    """Write what tubes may scatter straight back, were each in phase (`area`) and by how its corners' phases run
    (`bound`) (n,) [1/m], and the two-way length `whole` (n,) [m]: see `phases.phases`."""
    for i in range(len(facet)):
        low, high, total = np.inf, -np.inf, 0.0
        for c in range(3):
            there = length[i, c] + length_to(points[i, c], image, far)
            low, high, total = min(low, there), max(high, there), total + there
        share = wavenumber / (4.0 * math.pi) * abs(_twice_area(points[i], k[i, 3])) * strength[i] * spread[i]
        if not far:
            share /= length_to(points[i, 3], image, far)
        if dull[facet[i]]:
            share *= _strength(material[facet[i]], materials, abs(_dot(normals[i, 3], k[i, 3])), wavenumber)
        area[i], bound[i] = share, share / (1.0 + 0.5 * wavenumber * (high - low))
        whole[i] = total / 3.0


@njit(cache=True, nogil=True, error_model="numpy")
def ahead_of(points, way, length, hit, reach, first, normal, image, far, wavenumber, span, whole):  # type: ignore[no-untyped-def]
    """Write by how much the two-way phase of tubes runs where they land, `span` (n,) [rad], and the `whole` way (n,)
    [m] over there.

    Args: hit (n,) facet that the centre meets after reach (n,) [m], -1 for none: then span is 0 and the way ends here.
    """
    p = np.empty(3)
    for i in range(len(hit)):
        f = hit[i]
        t = reach[i] if f >= 0 else 0.0
        for c in range(3):
            p[c] = points[i, 3, c] + t * way[i, 3, c]
        whole[i] = length[i, 3] + t + length_to(p, image, far)
        low, high = np.inf, -np.inf
        for q in range(3):
            if f < 0:
                low, high = 0.0, 0.0
                break
            height = 0.0
            for c in range(3):
                height += (first[f, c] - points[i, q, c]) * normal[f, c]
            slope = _dot(way[i, q], normal[f])
            if height * slope <= 0.0:
                # Not all of the tube can land there: how much of it does is not known yet.
                low, high = 0.0, 0.0
                break
            t = height / slope
            for c in range(3):
                p[c] = points[i, q, c] + t * way[i, q, c]
            phase = wavenumber * (length[i, q] + t + length_to(p, image, far))
            low, high = min(low, phase), max(high, phase)
        span[i] = high - low


@njit(cache=True, nogil=True)
def corner_rays(rows, points, way, facet, start):  # type: ignore[no-untyped-def]
    """Return origins and directions (3 m, 3), facets left (3 m,) and distances from which hits count (3 m,) of the
    corner rays of the tubes `rows` (m,)."""
    m = len(rows)
    origin, direction = np.empty((3 * m, 3)), np.empty((3 * m, 3))
    own, begin = np.empty(3 * m, facet.dtype), np.empty(3 * m)
    for j in range(m):
        i = rows[j]
        for q in range(3):
            at = 3 * j + q
            own[at], begin[at] = facet[i], start[i, q]
            for c in range(3):
                origin[at, c] = points[i, 3, c] + _DRAWN * (points[i, q, c] - points[i, 3, c])
                direction[at, c] = way[i, q, c]
    return origin, direction, own, begin


@njit(cache=True, nogil=True)
def agreeing(rows, hit, plane, smooth, normal, alike, out):  # type: ignore[no-untyped-def]
    """Write for the tubes `rows` (m,) whether all rays land on one plane, or on one smooth patch on which normals
    differ by no more than a cosine `alike` from the centre's.

    Args: hit (n, 4) facets met, -1 for none; plane, smooth (f,) to which facets belong.
    """
    for j in range(len(rows)):
        h = hit[rows[j]]
        f = h[3]
        one_plane = one_patch = f >= 0
        for q in range(3):
            g = h[q]
            one_plane &= g >= 0 and plane[g] == plane[f]
            one_patch &= g >= 0 and smooth[g] == smooth[f] and _dot(normal[g], normal[f]) > alike
        out[rows[j]] = one_plane or one_patch


@njit(cache=True, nogil=True, error_model="numpy")
def fates(rows, points, way, hit, agree, first, normal):  # type: ignore[no-untyped-def]
    """Return the tubes of `rows` that can be put down, the facet (m, 4) on whose plane each ray is, and after how far
    (m, 4) [m]. Rays that run beside the centre's plane cannot be: such a sliver is dropped."""
    m = len(rows)
    kept, facet, reach = np.empty(m, np.int64), np.empty((m, 4), hit.dtype), np.empty((m, 4))
    count = 0
    for j in range(m):
        i = rows[j]
        sound = True
        for q in range(3, -1, -1):
            f = hit[i, q] if agree[i] else hit[i, 3]
            slope, height = _dot(way[i, q], normal[f]), 0.0
            for c in range(3):
                height += normal[f, c] * (first[f, c] - points[i, q, c])
            t = height / slope if slope != 0.0 else np.inf
            facet[count, q], reach[count, q] = f, t
            sound &= t > -1e-6 and t < 10.0 * reach[count, 3] + 1.0
        if sound:
            kept[count] = i
            count += 1
    return kept[:count], facet[:count], reach[:count]


@njit(cache=True, forceinline=True)
def _normal_at(v, n, p, out):  # type: ignore[no-untyped-def]
    """Write the unit normal of the true surface behind p, a point of the plane of a facet (v, n: corners, normals)."""
    ax, ay, az = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    bx, by, bz = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    x, y, z = p[0] - v[0, 0], p[1] - v[0, 1], p[2] - v[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = nx * nx + ny * ny + nz * nz
    one = (x * (by * nz - bz * ny) + y * (bz * nx - bx * nz) + z * (bx * ny - by * nx)) / twice
    two = (x * (ny * az - nz * ay) + y * (nz * ax - nx * az) + z * (nx * ay - ny * ax)) / twice
    none = min(max(1.0 - one - two, -0.5), 1.5)
    one, two = min(max(one, -0.5), 1.5), min(max(two, -0.5), 1.5)
    for c in range(3):
        out[c] = none * n[0, c] + one * n[1, c] + two * n[2, c]
    size = math.sqrt(_dot(out, out))
    for c in range(3):
        out[c] /= size


@njit(cache=True, nogil=True, error_model="numpy")
def put_down(  # type: ignore[no-untyped-def]
    rows, hit, reach, points, way, length, normals, facet, spread, strength, flat, caustics, vertices, corner_normals,
    curved, far, wavenumber, material, materials, out_points, out_k, out_length, out_normals, out_spread, out_strength,
    out_flat, out_caustics,
):  # fmt: skip
    """Write the state of the tubes `rows` (m,) where they land, each ray on the plane of its facet `hit` (m, 4) after
    reach (m, 4) [m]."""
    for j in range(len(rows)):
        i = rows[j]
        cosine = abs(_dot(normals[i, 3], way[i, 3]))
        out_strength[j] = strength[i] * _strength(material[facet[i]], materials, cosine, wavenumber)
        for q in range(3, -1, -1):
            out_length[j, q] = length[i, q] + reach[j, q]
            for c in range(3):
                out_k[j, q, c] = way[i, q, c]
                out_points[j, q, c] = points[i, q, c] + reach[j, q] * way[i, q, c]
            f = hit[j, q]
            _normal_at(vertices[f], corner_normals[f], out_points[j, q], out_normals[j, q])
        # The centre says which side is lit; a corner beyond the terminator then shows its back and carries nothing.
        if _dot(out_normals[j, 3], way[i, 3]) > 0.0:
            for q in range(4):
                for c in range(3):
                    out_normals[j, q, c] = -out_normals[j, q, c]
        before, after = _twice_area(points[i], way[i, 3]), _twice_area(out_points[j], way[i, 3])
        out_flat[j] = flat[i] and not curved[facet[i]]
        if out_flat[j]:
            out_spread[j] = 1.0 if far else 1.0 / out_length[j, 3]
        else:
            thinned = spread[i] * math.sqrt(abs(before / after))
            out_spread[j] = thinned if math.isfinite(thinned) else 0.0
        out_caustics[j] = caustics[i] + (1 if before * after < 0.0 else 0)
