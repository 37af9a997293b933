"""Replay: the chains of vertices that tubes went over, from their history and their way out (numba loops)."""

from __future__ import annotations

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import copy_to
from raychan.geometry.intersect import plane_distance

REFLECT, TRANSMIT, SCATTER = 1, 2, 3


@njit(cache=True, nogil=True)
def way_back(last, slots, history, first, corners, passed):  # type: ignore[no-untyped-def]
    """Write the mirror points (n, m, 3) at the start of each history, and the layers (n, l) right behind them, -1 for
    none.

    Args: last row of each history and how many it has (n,); history place, normal (h, 3), facet, kind, before (h,);
    first, how many mirrors there are.
    """
    place, _, facet, kind, before = history
    layers = passed.shape[1]
    for i in range(len(last)):
        at = last[i]
        for c in range(layers):
            passed[i, c] = -1
        for s in range(slots[i] - 1, -1, -1):
            if s < first:
                copy_to(corners[i, s], place[at])
            elif s < first + layers and kind[at] == TRANSMIT:
                passed[i, s - first] = facet[at]
            at = before[at]


@njit(cache=True, nogil=True)
def chains(  # type: ignore[no-untyped-def]
    tubes, history, retrace, planes, corners, mirrors, passed, image, far, end, out
):
    """Write the chains of tubes that scatter on their present footprint and leave over mirrors.

    Args: tubes: points, k, normals (n, 4, 3), facet, last, slots, flat (n,), last and slots as for `way_back`; retrace
    whether vertices move to where the centre ray, after cuts, meets the plane mirrors; planes first, normal (f, 3) and
    body (f,) of facets; corners (n, m, 3), mirrors' normals (m, 3) and facets (m,), end's side first; passed (n, l)
    layers on the last stretch; image (3,) of the end, or the direction to it when far; end (3,) fills unused slots;
    out vertices, normals (n, d, 3), facet, body, kind (n, d).
    """
    points, k, lit, standing, last, slots, flat = tubes
    place, normal_of, facet_of, kind_of, before = history
    first, normal, body_of = planes
    mirror_normal, mirror_facet = mirrors
    vertices, normals, facet, body, kind = out
    d = kind.shape[1]
    for i in range(len(standing)):
        used, at = slots[i], last[i]
        px, py, pz = points[i, 3, 0], points[i, 3, 1], points[i, 3, 2]
        kx, ky, kz = k[i, 3, 0], k[i, 3, 1], k[i, 3, 2]
        for s in range(used - 1, -1, -1):
            f = facet_of[at]
            facet[i, s], kind[i, s] = f, kind_of[at]
            for c in range(3):
                vertices[i, s, c], normals[i, s, c] = place[at, c], normal_of[at, c]
            if retrace and flat[i]:
                t = plane_distance(normal[f], first[f], (px, py, pz), 0.0, (-kx, -ky, -kz))
                if abs(t) < 1e300:
                    px, py, pz = px - t * kx, py - t * ky, pz - t * kz
                vertices[i, s, 0], vertices[i, s, 1], vertices[i, s, 2] = px, py, pz
                if kind_of[at] == REFLECT:
                    x, y, z = normal_of[at]
                    turn = 2.0 * (kx * x + ky * y + kz * z)
                    kx, ky, kz = kx - turn * x, ky - turn * y, kz - turn * z
            at = before[at]
        here = points[i, 3]
        for c in range(3):
            vertices[i, used, c], normals[i, used, c] = here[c], lit[i, 3, c]
        facet[i, used], kind[i, used] = standing[i], SCATTER
        used += 1
        if passed.shape[1] > 0:
            wx, wy, wz = -image[0], -image[1], -image[2]
            if not far:
                wx, wy, wz = here[0] - image[0], here[1] - image[1], here[2] - image[2]
                size = (wx * wx + wy * wy + wz * wz) ** 0.5
                wx, wy, wz = wx / size, wy / size, wz / size
            for j in range(passed.shape[1] - 1, -1, -1):
                f = passed[i, j]
                if f < 0:
                    continue
                t = plane_distance(normal[f], first[f], here, 0.0, (-wx, -wy, -wz))
                vertices[i, used, 0] = here[0] - t * wx
                vertices[i, used, 1] = here[1] - t * wy
                vertices[i, used, 2] = here[2] - t * wz
                for c in range(3):
                    normals[i, used, c] = normal[f, c]
                facet[i, used], kind[i, used] = f, TRANSMIT
                used += 1
        for j in range(len(mirror_facet) - 1, -1, -1):
            for c in range(3):
                vertices[i, used, c], normals[i, used, c] = corners[i, j, c], mirror_normal[j, c]
            facet[i, used], kind[i, used] = mirror_facet[j], REFLECT
            used += 1
        for s in range(used):
            body[i, s] = body_of[facet[i, s]] if facet[i, s] >= 0 else -1
        for s in range(used, d):
            facet[i, s], body[i, s], kind[i, s] = -1, -1, 0
            for c in range(3):
                vertices[i, s, c], normals[i, s, c] = end[c], 0.0
