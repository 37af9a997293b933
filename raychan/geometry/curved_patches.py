"""Patches of curved surfaces: Nagata's quadratic triangles through corners and corner normals of facets, and rays to
them (numba kernels). Source: Nagata (2005), Computer Aided Geometric Design 22(4), eq. 10.

Everywhere: v, n, b (m, 3, 3) corners, corner normals and edge curvatures of the facets; image (3,) the source's mirror
image [m], or the unit direction towards it when far; bary (n, 3, 3) corners of patches on their facets.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.vectors import dot

_STEPS, _CLOSE = 12, 1e-9  # most steps from a plane to its patch, and the m by which the last one moves at most
_BESIDE = 0.5  # of a facet's barycentric range: so far beside the facet its patch goes on; not measured


@njit(cache=True, forceinline=True, uncounted=True)
def copy_corners(out, w):  # type: ignore[no-untyped-def]
    """Write the corners w (3, 3) into out."""
    for c in range(3):
        out[c, 0], out[c, 1], out[c, 2] = w[c, 0], w[c, 1], w[c, 2]


@njit(cache=True, forceinline=True, uncounted=True)
def place_on(v, b, x, y, z, p):  # type: ignore[no-untyped-def]
    """Write into p the point of the curved surface at barycentric (x, y, z)."""
    xy, yz, zx = x * y, y * z, z * x
    for c in range(3):
        p[c] = x * v[0, c] + y * v[1, c] + z * v[2, c] - xy * b[0, c] - yz * b[1, c] - zx * b[2, c]


@njit(cache=True, forceinline=True, uncounted=True)
def weights_at(v, x, y, z):  # type: ignore[no-untyped-def]
    """Return the barycentric coordinates of a point (x, y, z) [m] above or below a facet of corners v (3, 3)."""
    ax, ay, az = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    bx, by, bz = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    x, y, z = x - v[0, 0], y - v[0, 1], z - v[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = nx * nx + ny * ny + nz * nz
    one = (x * (by * nz - bz * ny) + y * (bz * nx - bx * nz) + z * (bx * ny - by * nx)) / twice
    two = (x * (ny * az - nz * ay) + y * (nz * ax - nx * az) + z * (nx * ay - ny * ax)) / twice
    return 1.0 - one - two, one, two


@njit(cache=True, forceinline=True, uncounted=True)
def distance_to_patch(v, b, normal, o, k, flat):  # type: ignore[no-untyped-def]
    """Return the distance [m] at which a ray from o along k meets the patch over a facet (v, b: corners, curvatures),
    whose plane it meets after `flat`; that distance where it passes beside the patch, or almost along it."""
    t, slope = flat, dot(k, normal)
    before, missed_before = flat, 0.0
    off = 0.0, 0.0, 0.0
    for step in range(_STEPS):
        # Moved back by the patch's offset there, the ray meets the plane.
        x, y, z = weights_at(
            v, o[0] + t * k[0] - off[0], o[1] + t * k[1] - off[1], o[2] + t * k[2] - off[2]
        )  # fmt: skip
        if min(x, min(y, z)) < -_BESIDE or max(x, max(y, z)) > 1.0 + _BESIDE:
            break
        xy, yz, zx = -x * y, -y * z, -z * x
        off = (
            xy * b[0, 0] + yz * b[1, 0] + zx * b[2, 0],
            xy * b[0, 1] + yz * b[1, 1] + zx * b[2, 1],
            xy * b[0, 2] + yz * b[1, 2] + zx * b[2, 2],
        )
        missed = flat + dot(off, normal) / slope - t
        if abs(missed) < _CLOSE:
            return t
        # By the secant of what the last two steps missed it by.
        bend = missed_before - missed
        last, ahead = t, missed
        if step > 0 and abs(bend) > 1e-3 * abs(missed):
            ahead = missed * (t - before) / bend
        t, before, missed_before = t + ahead, last, missed
    return flat


@njit(cache=True, forceinline=True, uncounted=True)
def rise_off_chord(a, b, at_a, at_b, t, out):  # type: ignore[no-untyped-def]
    """Write how far (3,) [m] a curved surface lies off the chord from a to b (3,) at the share t of it, by the unit
    normals at_a, at_b (3,) at its ends; return whether it does."""
    rise, size = 0.0, 0.0
    for c in range(3):
        rise += 0.5 * t * (1.0 - t) * (at_b[c] - at_a[c]) * (b[c] - a[c])
        size += (at_a[c] + at_b[c]) ** 2
    scale = rise / math.sqrt(size) if size > 0.0 else 0.0
    for c in range(3):
        out[c] = scale * (at_a[c] + at_b[c])
    return scale != 0.0


@njit(cache=True, forceinline=True, uncounted=True)
def middle(w):  # type: ignore[no-untyped-def]
    """Return the barycentric coordinates of a patch's centre."""
    return (
        (w[0, 0] + w[1, 0] + w[2, 0]) / 3.0,
        (w[0, 1] + w[1, 1] + w[2, 1]) / 3.0,
        (w[0, 2] + w[1, 2] + w[2, 2]) / 3.0,
    )


@njit(cache=True, forceinline=True, uncounted=True)
def normal_on(n, x, y, z, out):  # type: ignore[no-untyped-def]
    """Write into out the unit normal of the curved surface at barycentric (x, y, z)."""
    for c in range(3):
        out[c] = x * n[0, c] + y * n[1, c] + z * n[2, c]
    size = math.sqrt(dot(out, out))
    for c in range(3):
        out[c] /= size


@njit(cache=True, forceinline=True, uncounted=True)
def _ray(p, image, far, k):  # type: ignore[no-untyped-def]
    """Write into k the direction in which a ray from the source travels at p; return its length [m]."""
    if far:
        k[0], k[1], k[2] = -image[0], -image[1], -image[2]
        return -dot(p, image)
    k[0], k[1], k[2] = p[0] - image[0], p[1] - image[1], p[2] - image[2]
    length = math.sqrt(dot(k, k))
    k[0] /= length
    k[1] /= length
    k[2] /= length
    return length


@njit(cache=True, nogil=True, error_model="numpy")
def rays_on(facet, bary, v, n, b, is_open, image, far):  # type: ignore[no-untyped-def]
    """Return points (n, 4, 3) [m], directions (n, 4, 3), lengths (n, 4) [m] and normals (n, 4, 3) of the rays from the
    source to corners and centre of each patch; normals of facets lit from both sides (`is_open`) face the source."""
    m = len(facet)
    p, k, length, normal = np.empty((m, 4, 3)), np.empty((m, 4, 3)), np.empty((m, 4)), np.empty((m, 4, 3))
    write_rays_on(facet, bary, v, n, b, is_open, image, far, p, k, length, normal)
    return p, k, length, normal


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def write_rays_on(facet, bary, v, n, b, is_open, image, far, p, k, length, normal):  # type: ignore[no-untyped-def]
    """Write what `rays_on` returns."""
    for i in range(len(facet)):
        f, w = facet[i], bary[i]
        for q in range(4):
            if q == 3:
                x, y, z = middle(w)
            else:
                x, y, z = w[q, 0], w[q, 1], w[q, 2]
            place_on(v[f], b[f], x, y, z, p[i, q])
            normal_on(n[f], x, y, z, normal[i, q])
            length[i, q] = _ray(p[i, q], image, far, k[i, q])
        if is_open[f] and dot(normal[i, 3], k[i, 3]) > 0.0:
            for q in range(4):
                for c in range(3):
                    normal[i, q, c] = -normal[i, q, c]
