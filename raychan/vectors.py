"""Vectors of three numbers: products, lengths and distances (numba kernels)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from raychan.compile.jit import njit

_ALIKE = 1.0 + 1e-9  # ratio of sizes that count as equal, so that rounding does not choose between them

Vec = tuple[Any, Any, Any]


@njit(cache=True, forceinline=True, uncounted=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """Return a . b without conjugation."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, forceinline=True, uncounted=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, forceinline=True, uncounted=True)
def row(a, i):  # type: ignore[no-untyped-def]
    """Return row i of a (n, 3) as three numbers: a view of it would count a reference."""
    return a[i, 0], a[i, 1], a[i, 2]


@njit(cache=True, forceinline=True, uncounted=True)
def less(a, b):  # type: ignore[no-untyped-def]
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True, forceinline=True, uncounted=True)
def copy_to(out, a):  # type: ignore[no-untyped-def]
    """Write a into out, one axis; numba compiles `out[:] = a` into much code, for an error message."""
    for c in range(len(out)):
        out[c] = a[c]


@njit(cache=True, forceinline=True, uncounted=True)
def distance(p, q):  # type: ignore[no-untyped-def]
    """Return the distance between p and q."""
    return math.sqrt((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)


@njit(cache=True, forceinline=True, uncounted=True)
def length_to(p, image, far):  # type: ignore[no-untyped-def]
    """Return the length [m] of the ray between p and a source at `image`; of a plane wave from the direction `image`
    when far, against the plane through 0."""
    if far:
        return -dot(p, image)
    return math.sqrt((p[0] - image[0]) ** 2 + (p[1] - image[1]) ** 2 + (p[2] - image[2]) ** 2)


@njit(cache=True, forceinline=True, uncounted=True)
def largest(a, b, c):  # type: ignore[no-untyped-def]
    """Return which of three sizes is largest: 0, 1 or 2, the first of equal ones."""
    if a * _ALIKE >= b and a * _ALIKE >= c:
        return 0
    return 1 if b * _ALIKE >= c else 2


@njit(cache=True, forceinline=True, uncounted=True)
def plane_distance(n, v, x, along, d):  # type: ignore[no-untyped-def]
    """Return the distance from x + along d to the plane through v of normal n, along d."""
    slope = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
    if slope == 0.0:
        return np.inf
    height = 0.0
    for c in range(3):
        height += n[c] * (v[c] - (x[c] + along * d[c]))
    return height / slope


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def twice_area_across(points, k):  # type: ignore[no-untyped-def]
    """Return twice the area of corners (3, 3) or more as seen along k (3,), times its length, with its sign [m^2]."""
    p, q, r = points[0], points[1], points[2]
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    bx, by, bz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return (ay * bz - az * by) * k[0] + (az * bx - ax * bz) * k[1] + (ax * by - ay * bx) * k[2]


@njit(cache=True, forceinline=True, uncounted=True)
def twice_area(p):  # type: ignore[no-untyped-def]
    """Return twice the area [m^2] of the triangle of corners p (3, 3) or more [m]."""
    x, y, z = _twice_vector_area(p)
    return math.sqrt(x * x + y * y + z * z)


@njit(cache=True, forceinline=True, uncounted=True)
def _twice_vector_area(p):  # type: ignore[no-untyped-def]
    """Return the normal of the triangle of corners p (3, 3) or more [m], as long as twice its area [m^2]."""
    a, b, c = p[0], p[1], p[2]
    return (
        (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]),
        (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]),
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]),
    )


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def distance_to_triangle(p, x):  # type: ignore[no-untyped-def]
    """Return the distance [m] of x (3,) [m] from the nearest point of the triangle of corners p (3, 3) or more [m]."""
    n0, n1, n2 = _twice_vector_area(p)
    least, within = np.inf, True
    for q in range(3):
        a, b = p[q], p[(q + 1) % 3]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        d0, d1, d2 = x[0] - a[0], x[1] - a[1], x[2] - a[2]
        along = (d0 * e0 + d1 * e1 + d2 * e2) / max(e0 * e0 + e1 * e1 + e2 * e2, 1e-300)
        along = min(max(along, 0.0), 1.0)
        least = min(least, (d0 - along * e0) ** 2 + (d1 - along * e1) ** 2 + (d2 - along * e2) ** 2)
        # The edge's line has the third corner and the foot of x on one side.
        within &= (n1 * e2 - n2 * e1) * d0 + (n2 * e0 - n0 * e2) * d1 + (n0 * e1 - n1 * e0) * d2 > 0.0
    if within:
        height = n0 * (x[0] - p[0, 0]) + n1 * (x[1] - p[0, 1]) + n2 * (x[2] - p[0, 2])
        return abs(height) / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    return math.sqrt(least)
