"""Short rays: which facet lies within a distance of points of other facets (numba kernels).

Four rays are cast at once, without companions: a ray that leaks between two facets meets those beside it elsewhere.
Embree looks no farther than they reach.
"""

from __future__ import annotations

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.embree_packet import FAR, LANES, PRIMITIVE, VALID, first_triangles, put_ray
from raychan.geometry.intersect import OFFSET
from raychan.vectors import plane_distance, row

_TRIES = 8  # casts of a ray that meets the facet which it leaves
_DONE = -1.0  # the reach of a ray that is cast no more: before its origin


@njit(cache=True, nogil=True)
def first_within(origin, direction, own, reach, group, shapes, packet, facet):  # type: ignore[no-untyped-def]
    """Write into facet (n,) the first facet that each ray meets within its reach; of the others nothing is written.

    Args: origin (n, 3) [m], direction (n, 3) unit; own (n,) facet that each leaves and cannot meet; reach [m]; group
    the first of `FacetGroups`, the only one; shapes as `FacetShapes`; packet as `embree_packet.own_packet` returns it.
    """
    floats, words = packet
    normal, first = shapes.normal, shapes.first
    intersect, scene, number, middle = group.intersect, group.scene[0], group.facet, row(group.middle, 0)
    offset, ahead = OFFSET * (shapes.size + group.radius[0]), np.empty(LANES)
    for lane in range(LANES):
        words[VALID + lane] = -1
    for i in range(0, len(origin), LANES):
        for lane in range(LANES):
            # Lanes beyond the last ray cast it, but not far.
            ahead[lane] = offset if i + lane < len(origin) else reach
        for _ in range(_TRIES):
            left = 0
            for lane in range(LANES):
                q = min(i + lane, len(origin) - 1)
                left += _put(floats, words, lane, row(origin, q), row(direction, q), ahead[lane], reach, middle)
            if left == 0:
                break
            first_triangles(intersect, scene, words)
            for lane in range(LANES):
                q, h = min(i + lane, len(origin) - 1), words[PRIMITIVE + lane]
                h = number[h] if h >= 0 else -1
                t = np.inf if h < 0 else plane_distance(normal[h], first[h], row(origin, q), 0.0, row(direction, q))
                again = t < reach and (h == own[q] or t <= shapes.nearest)
                if t < reach and not again and ahead[lane] < reach:
                    facet[q] = h
                ahead[lane] = 2.0 * max(t, ahead[lane]) if again else reach


@njit(cache=True, forceinline=True, uncounted=True)
def _put(floats, words, lane, p, d, ahead, reach, middle):  # type: ignore[no-untyped-def]
    """Write a ray from p along d into the packet, from `ahead` to its reach [m]; return whether there is any of it."""
    x, y, z = p[0] + ahead * d[0], p[1] + ahead * d[1], p[2] + ahead * d[2]
    put_ray(floats, words, lane, x - middle[0], y - middle[1], z - middle[2], d)
    floats[FAR + lane] = reach - ahead if ahead < reach else _DONE
    return ahead < reach
