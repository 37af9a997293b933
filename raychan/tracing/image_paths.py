"""The image method: paths from an end over plane mirrors to points (numba kernels).

Everywhere: images (m + 1, 3) [m] of the end, itself first (unit directions when far); at, normal (m, 3) a point and the
normal of each mirror's plane; centre (m, 3) and radius (m,) [m] of the circles about the mirrors; the end's side first.
"""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.radar.beam_kernels import field_towards
from raychan.vectors import length_to


@njit(cache=True, forceinline=True, error_model="numpy")
def _mirror_point(x, y, z, image, at, normal):  # type: ignore[no-untyped-def]
    """Return where the line from a point to an image meets the mirror's plane; the point itself if it never does."""
    dx, dy, dz = image[0] - x, image[1] - y, image[2] - z
    over = (at[0] - x) * normal[0] + (at[1] - y) * normal[1] + (at[2] - z) * normal[2]
    t = over / (dx * normal[0] + dy * normal[1] + dz * normal[2])
    if not math.isfinite(t):
        t = 0.0
    return x + t * dx, y + t * dy, z + t * dz


@njit(cache=True, nogil=True, error_model="numpy")
def _may_reach(point, size, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Tell whether a ray may reach a sphere: in front of the last mirror, over the circle about each mirror."""
    m = len(at)
    if m == 0:
        return True
    height = 0.0
    for c in range(3):
        height += (point[c] - at[m - 1, c]) * normal[m - 1, c]
    if not height > -size:
        return False
    x, y, z = point[0], point[1], point[2]
    for i in range(m - 1, -1, -1):
        x, y, z = _mirror_point(x, y, z, images[i + 1], at[i], normal[i])
        # A ray to any point of the sphere meets a mirror nearer to the ray to its centre than the sphere's radius.
        off = math.sqrt((x - centre[i, 0]) ** 2 + (y - centre[i, 1]) ** 2 + (z - centre[i, 2]) ** 2)
        if not off < radius[i] + size:
            return False
    return True


@njit(cache=True, nogil=True)
def may_reach(points, size, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Tell which spheres (n,) about points (n, 3) of radius size (n,) [m] rays over the mirrors may reach."""
    ok = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        ok[i] = _may_reach(points[i], size[i], images, at, normal, centre, radius)
    return ok


@njit(cache=True, nogil=True)
def may_leave(points, images, at, normal, centre, radius):  # type: ignore[no-untyped-def]
    """Tell of which tubes of corners and centre (n, 4, 3) [m] a ray may come to the end over the mirrors."""
    ok = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        size = 0.0
        for q in range(3):
            size = max(size, length_to(points[i, q], points[i, 3], False))
        ok[i] = _may_reach(points[i, 3], size, images, at, normal, centre, radius)
    return ok


@njit(cache=True, nogil=True, error_model="numpy")
def mirror_points(points, images, at, normal):  # type: ignore[no-untyped-def]
    """Return the mirror points (n, m, 3) [m] on the way to each of the points (n, 3) [m], the end's side first."""
    out = np.empty((len(points), len(at), 3))
    for j in range(len(points)):
        x, y, z = points[j, 0], points[j, 1], points[j, 2]
        for i in range(len(at) - 1, -1, -1):
            x, y, z = _mirror_point(x, y, z, images[i + 1], at[i], normal[i])
            out[j, i, 0], out[j, i, 1], out[j, i, 2] = x, y, z
    return out


@njit(cache=True, nogil=True)
def stretch(i, rows, points, corners, images, at, normal, far, reach):  # type: ignore[no-untyped-def]
    """Return the `rows` whose path may go along stretch i (from mirror i - 1 to mirror i), with its starts (k, 3) [m],
    unit directions (k, 3) and lengths (k,) [m]: both ends of a stretch lie on the lit sides of its mirrors.

    Args: points (n, 3) [m], corners (n, m, 3) [m] mirror points of the legs to them; reach [m] from which rays come
    when far.
    """
    m, k = len(at), 0
    kept, start, d, length = (
        np.empty(len(rows), np.int64),
        np.empty((len(rows), 3)),
        np.empty((len(rows), 3)),
        np.empty(len(rows)),
    )
    for r in rows:
        before, ahead, square = 0.0, 0.0, 0.0
        for c in range(3):
            stop = corners[r, i, c] if i < m else points[r, c]
            if i == 0:
                start[k, c] = stop + reach * images[0, c] if far and m == 0 else images[0, c]
            else:
                start[k, c] = corners[r, i - 1, c]
                before += (stop - at[i - 1, c]) * normal[i - 1, c]
            if i < m:
                ahead += (start[k, c] - at[i, c]) * normal[i, c]
            d[k, c] = stop - start[k, c]
            square += d[k, c] ** 2
        if (i > 0 and before <= 0.0) or (i < m and (ahead <= 0.0 or square == 0.0)):
            continue
        length[k] = math.sqrt(square)
        for c in range(3):
            d[k, c] /= length[k] if square > 0.0 else 1.0
        if far and i == m:
            length[k] = reach
            for c in range(3):
                d[k, c] = -images[m, c]
                start[k, c] = points[r, c] + reach * images[m, c]
        kept[k] = r
        k += 1
    return kept[:k], start[:k], d[:k], length[:k]


@njit(cache=True, nogil=True, error_model="numpy")
def rays_from(points, image, far):  # type: ignore[no-untyped-def]
    """Return unit directions (n, 3) at the points (n, 3) [m], travelling from the image, and lengths (n,) [m]."""
    k, length = np.empty((len(points), 3)), np.empty(len(points))
    for i in range(len(points)):
        length[i] = length_to(points[i], image, far)
        for c in range(3):
            k[i, c] = -image[c] if far else (points[i, c] - image[c]) / length[i]
    return k, length


@njit(cache=True, forceinline=True)
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
