"""The image method: paths from an end over plane mirrors to points (numba kernels).

Everywhere: images (m + 1, 3) [m] of the end, itself first (unit directions when far); at, normal (m, 3) a point and the
normal of each mirror's plane; centre (m, 3) and radius (m,) [m] of the circles about the mirrors; the end's side first.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.radar.beam_kernels import field_towards
from raychan.vectors import copy_to, dot, length_to, less, row

_ROUNDING = 1e-9  # rad, and m
ON_PLANE = 1e-6  # m: corners of tubes so near to a plane lie on it
BEYOND = 1e-4  # m about a mirror, for rounding: a ray too many does no harm


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def mirror_point(x, y, z, image, at, normal):  # type: ignore[no-untyped-def]
    """Return where the line from a point to an image meets the mirror's plane; the point itself if it never does."""
    dx, dy, dz = image[0] - x, image[1] - y, image[2] - z
    over = (at[0] - x) * normal[0] + (at[1] - y) * normal[1] + (at[2] - z) * normal[2]
    t = over / (dx * normal[0] + dy * normal[1] + dz * normal[2])
    if not math.isfinite(t):
        t = 0.0
    return x + t * dx, y + t * dy, z + t * dz


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _may_reach(point, size, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Tell whether a ray may reach a sphere: in front of the last mirror, over the circle about each mirror.

    Rays to a sphere fill a cone about the ray to its centre. A mirror's plane cuts it along an ellipse, which is long
    where the rays graze the mirror.
    """
    m = len(at)
    if m == 0:
        return True
    sine = size / length_to(point, images[m], False)
    if not sine < 1.0:
        return True
    cosine, wide = math.sqrt(1.0 - sine * sine), math.asin(sine)
    spread = size
    x, y, z = point[0], point[1], point[2]
    for i in range(m - 1, -1, -1):
        image, n = images[i + 1], normal[i]
        height = (x - at[i, 0]) * n[0] + (y - at[i, 1]) * n[1] + (z - at[i, 2]) * n[2]
        if not height > -spread:
            return False
        if not (x - image[0]) * n[0] + (y - image[1]) * n[1] + (z - image[2]) * n[2] > 0.0:
            return True
        x, y, z = mirror_point(x, y, z, image, at[i], n)
        ray = x - image[0], y - image[1], z - image[2]
        to = centre[i, 0] - image[0], centre[i, 1] - image[1], centre[i, 2] - image[2]
        length, away = math.sqrt(dot(ray, ray)), math.sqrt(dot(to, to))
        if radius[i] < away:
            apart = math.acos(min(max(dot(ray, to) / (length * away), -1.0), 1.0))
            if not apart < math.asin(radius[i] / away) + wide + _ROUNDING:
                return False
        # From the cone's axis to the far end of the ellipse.
        slope = min(dot(ray, n) / length, 1.0)
        steep = slope * cosine - math.sqrt(1.0 - slope * slope) * sine
        spread = length * sine / steep if steep > 0.0 else np.inf
        off = math.sqrt((x - centre[i, 0]) ** 2 + (y - centre[i, 1]) ** 2 + (z - centre[i, 2]) ** 2)
        if not off < radius[i] + spread + _ROUNDING:
            return False
    return True


@njit(cache=True, nogil=True)
def may_reach(points, size, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Tell which spheres (n,) about points (n, 3) of radius size (n,) [m] rays over the mirrors may reach."""
    ok = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        ok[i] = _may_reach(points[i], size[i], images, at, normal, centre, radius)
    return ok


@njit(cache=True, forceinline=True, uncounted=True)
def _clipped(left, count, toward, least, other):  # type: ignore[no-untyped-def]
    """Write what of a convex polygon `left`, of so many corners, lies where x . toward >= least into `other`; return
    its number of corners."""
    k, last = 0, left[count - 1]
    before = dot(last, toward) - least
    for j in range(count):
        here = left[j]
        ahead = dot(here, toward) - least
        if (ahead < 0.0) != (before < 0.0):
            t = before / (before - ahead)
            for c in range(3):
                other[k, c] = last[c] + t * (here[c] - last[c])
            k += 1
        if ahead >= 0.0:
            copy_to(other[k], here)
            k += 1
        last, before = here, ahead
    return k


@njit(cache=True, forceinline=True, uncounted=True)
def _beyond_one(triangle, normals, offsets):  # type: ignore[no-untyped-def]
    """Tell whether all corners of a triangle lie beyond one of some planes."""
    p, q, r = row(triangle, 0), row(triangle, 1), row(triangle, 2)
    for k in range(len(offsets)):
        n = row(normals, k)
        out = dot(n, p) - offsets[k] < -BEYOND
        if out and dot(n, q) - offsets[k] < -BEYOND and dot(n, r) - offsets[k] < -BEYOND:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def may_leave(corners, rows, images, at, normal, low, high, axes, windows):  # type: ignore[no-untyped-def]
    """Tell of which triangles `rows` (k,) of corners (n, 3 or more, 3) [m] a ray may come to the end over the mirrors:
    of what lies in front of each mirror, and whose rays meet the rectangle about it, something is left.

    Args: low, high (m, 2) [m] ends of the rectangles along their axes (m, 2, 3); windows (w, 3) normals of the planes
    through the image between which all rays run, inward.
    """
    ok, most, w = np.empty(len(rows), np.bool_), 3 + 5 * len(at), len(windows)
    polygons, planes = (np.empty((most, 3)), np.empty((most, 3))), (np.empty((1 + w, 3)), np.empty(1 + w))
    each_may_leave(corners, rows, images, at, normal, low, high, axes, windows, polygons, planes, ok)
    return ok


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def each_may_leave(corners, rows, images, at, normal, low, high, axes, windows, polygons, planes, ok):  # type: ignore[no-untyped-def]
    """Write into ok (k,) what `may_leave` returns; polygons, planes room for work."""
    m, w = len(at), len(windows)
    (left, other), (normals, offsets) = polygons, planes
    for k in range(-1, w):
        copy_to(normals[k + 1], normal[m - 1] if k < 0 else windows[k])
        offsets[k + 1] = dot(normals[k + 1], at[m - 1] if k < 0 else images[m])
    for o in range(len(rows)):
        i = rows[o]
        # Most lie beyond one of the planes.
        ok[o] = not _beyond_one(corners[i], normals, offsets)
        if not ok[o]:
            continue
        count = np.int64(3)  # as a bare 3 it would be a type of its own to compile for
        for q in range(3):
            copy_to(left[q], corners[i, q])
        for j in range(m - 1, -1, -1):
            count = _clipped(left, count, normal[j], dot(at[j], normal[j]), other) if count else count
            for q in range(count):
                p = other[q]
                left[q, 0], left[q, 1], left[q, 2] = mirror_point(p[0], p[1], p[2], images[j + 1], at[j], normal[j])
            for side in range(2):
                along = axes[j, side]
                back = -along[0], -along[1], -along[2]
                count = _clipped(left, count, along, low[j, side] - BEYOND, other) if count else count
                count = _clipped(other, count, back, -high[j, side] - BEYOND, left) if count else count
        ok[o] = count > 0


@njit(cache=True, nogil=True, error_model="numpy")
def bounds_of_light(corners, rows, images, at, normal, low, high, axes, windows, side):  # type: ignore[no-untyped-def]
    """Write into side (n, 3) signed distances [m] of the corners of triangles `rows` (k,) from a line that bounds what
    of them the leg reaches: where they meet the plane of the last mirror, or rays over a side of a mirror's rectangle;
    zeros where none runs through them. Args: as for `may_leave`."""
    ok = may_leave(corners, rows, images, at, normal, low, high, axes, windows)
    m = len(at)
    for o in range(len(rows)):
        p, found = corners[rows[o]], side[rows[o]]
        for k in range(-1, len(windows)):
            n, b = row(normal, m - 1) if k < 0 else row(windows, k), row(at, m - 1) if k < 0 else row(images, m)
            x, y, z = dot(less(row(p, 0), b), n), dot(less(row(p, 1), b), n), dot(less(row(p, 2), b), n)
            across = ok[o] and min(x, y, z) < -ON_PLANE and max(x, y, z) > ON_PLANE
            found[0], found[1], found[2] = (x, y, z) if across else (0.0, 0.0, 0.0)
            if across:
                break


@njit(cache=True, nogil=True, error_model="numpy")
def mirror_points(points, images, at, normal):  # type: ignore[no-untyped-def]
    """Return the mirror points (n, m, 3) [m] on the way to each of the points (n, 3) [m], the end's side first."""
    out = np.empty((len(points), len(at), 3))
    for j in range(len(points)):
        x, y, z = points[j, 0], points[j, 1], points[j, 2]
        for i in range(len(at) - 1, -1, -1):
            x, y, z = mirror_point(x, y, z, images[i + 1], at[i], normal[i])
            out[j, i, 0], out[j, i, 1], out[j, i, 2] = x, y, z
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def rays_from(points, image, far):  # type: ignore[no-untyped-def]
    """Return unit directions (n, 3) at the points (n, 3) [m], travelling from the image, and lengths (n,) [m]."""
    k, length = np.empty((len(points), 3)), np.empty(len(points))
    for i in range(len(points)):
        length[i] = length_to(points[i], image, far)
        for c in range(3):
            k[i, c] = -image[c] if far else (points[i, c] - image[c]) / length[i]
    return k, length


@njit(cache=True, forceinline=True, uncounted=True)
def weight(p, images, far, normal, table, look):  # type: ignore[no-untyped-def]
    """Return the field, relative to the strongest, that the end's antenna sends to p (3,) over the mirrors.

    Args: table of its beam (see radar.beam_kernels), empty: isotropic; look (3,) for work.
    """
    if len(table) == 0:
        return 1.0
    m = len(normal)
    size = 1.0 if far else length_to(p, images[m], False)
    for c in range(3):
        look[c] = -images[m, c] if far else (p[c] - images[m, c]) / size
    for i in range(m - 1, -1, -1):
        twice = 2.0 * (look[0] * normal[i, 0] + look[1] * normal[i, 1] + look[2] * normal[i, 2])
        for c in range(3):
            look[c] -= twice * normal[i, c]
    return field_towards(look, table)


@njit(cache=True, nogil=True, error_model="numpy")
def weights(points, images, far, normal, table):  # type: ignore[no-untyped-def]
    """Return the fields (n,) of `weight` at points (n, 3) [m]."""
    out, look = np.empty(len(points)), np.empty(3)
    for i in range(len(points)):
        out[i] = weight(points[i], images, far, normal, table, look)
    return out
