"""Rays along legs: whether an end sees points over its mirrors and through layers (numba kernels).

A ray is followed from the end to the first mirror, from mirror to mirror, and to its point. It ends where a stretch of
its way does not lie on the lit sides of its mirrors, or where something but a thin layer comes first; it passes layers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.intersect import first_hit
from raychan.geometry.shadow_rays import is_clear, unused
from raychan.tracing.image_paths import BEYOND, mirror_point
from raychan.vectors import dot

Floats = NDArray[np.float64]


class LegChain(NamedTuple):
    """A leg (see `image_paths`): images (m + 1, 3) [m]; at, normal (m, 3), facet (m,) of each mirror, end's side first;
    low, high (m, 2) [m] ends of the rectangles about them along axes (m, 2, 3); far."""

    images: Floats
    at: Floats
    normal: Floats
    facet: NDArray[np.int64]
    low: Floats
    high: Floats
    axes: Floats
    far: bool


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _over_mirrors(p, leg, corners):  # type: ignore[no-untyped-def]
    """Write the mirror points (m, 3) [m] on the way to p (3,), and tell whether all lie within the rectangle about
    their mirror (see `image_paths.may_leave`)."""
    x, y, z = p[0], p[1], p[2]
    over = True
    for i in range(len(leg.at) - 1, -1, -1):
        x, y, z = mirror_point(x, y, z, leg.images[i + 1], leg.at[i], leg.normal[i])
        corners[i, 0], corners[i, 1], corners[i, 2] = x, y, z
        for side in range(2):
            along = dot(corners[i], leg.axes[i, side])
            over = over and leg.low[i, side] - BEYOND <= along <= leg.high[i, side] + BEYOND
    return over


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _stretch(i, p, corners, leg, reach):  # type: ignore[no-untyped-def]
    """Return whether the way to p (3,) may go along stretch i, from mirror i - 1 to mirror i, both ends on the lit
    sides of its mirrors; and its start (3,) [m], unit direction (3,) and length [m].

    Args: corners (m, 3) [m] mirror points; reach [m] from which rays come when far.
    """
    m, far, first, last = len(leg.at), leg.far, leg.images[0], leg.images[len(leg.at)]
    stop = (corners[i, 0], corners[i, 1], corners[i, 2]) if i < m else (p[0], p[1], p[2])
    before, ahead = 1.0, 1.0
    if i > 0:
        start = corners[i - 1, 0], corners[i - 1, 1], corners[i - 1, 2]
        b, n = leg.at[i - 1], leg.normal[i - 1]
        before = (stop[0] - b[0]) * n[0] + (stop[1] - b[1]) * n[1] + (stop[2] - b[2]) * n[2]
    elif far and m == 0:
        start = stop[0] + reach * first[0], stop[1] + reach * first[1], stop[2] + reach * first[2]
    else:
        start = first[0], first[1], first[2]
    if i < m:
        b, n = leg.at[i], leg.normal[i]
        ahead = (start[0] - b[0]) * n[0] + (start[1] - b[1]) * n[1] + (start[2] - b[2]) * n[2]
    d = stop[0] - start[0], stop[1] - start[1], stop[2] - start[2]
    square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    if before <= 0.0 or (i < m and (ahead <= 0.0 or square == 0.0)):
        return False, start, d, 0.0
    length = math.sqrt(square)
    if far and i == m:
        start = p[0] + reach * last[0], p[1] + reach * last[1], p[2] + reach * last[2]
        return True, start, (-last[0], -last[1], -last[2]), reach
    over = length if square > 0.0 else 1.0
    return True, start, (d[0] / over, d[1] / over, d[2] / over), length


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def follow_leg(p, target, slack, inside, leg, reach, caster, packet, corners, passed):  # type: ignore[no-untyped-def]
    """Write the mirror points (m, 3) [m] on the way to p (3,), and the layers passed (l (m + 1),): l places for each of
    the m + 1 stretches, the end's first, -1 where there is none.

    Args: target facet on which p lies, -1 for none; slack [m] by which its smooth surface may lie before p; inside body
    in which p lies, -1 for none; leg as `LegChain`; reach [m] from which rays come when far; caster as
    `RayCaster.met_by_rays`; packet as `embree_packet.own_packet` returns it.
    Returns: whether the end sees p; the facet in the way, -1 for none; how many rays were cast.
    """
    groups, shapes, surfaces, hides_nothing = caster
    floats, words = packet
    m, casts, skip = len(leg.at), 0, np.int32(-1)
    layers = len(passed) // (m + 1)
    for q in range(len(passed)):
        passed[q] = -1
    if not _over_mirrors(p, leg, corners):
        return False, np.int32(-1), casts
    for i in range(m + 1):
        possible, x, d, length = _stretch(i, p, corners, leg, reach)
        if not possible:
            break
        if hides_nothing and i == m and skip < 0 and target >= 0 and dot(d, surfaces.normal[target]) < 0.0:
            # A facet that faces the ray's start is then seen from there; each such point still counts as a ray.
            return True, np.int32(-1), casts + 1
        start = 0.0
        while True:
            a, t, tries = first_hit(x, d, skip, start, groups, shapes, floats, words)
            casts += tries
            if i < m:
                free = a >= 0 and surfaces.plane[a] == surfaces.plane[leg.facet[i]]
            else:
                free = is_clear(a, t, x, d, target, length, slack, surfaces)
                free = free or (inside >= 0 and surfaces.body[a] == inside)
            layer, own = -1, passed[i * layers : (i + 1) * layers]
            if a >= 0 and not free and len(surfaces.is_layer) and surfaces.is_layer[a]:
                layer = unused(own)
            if layer < 0 and (i == m or not free):
                return free, np.int32(a if i == m and not free else -1), casts
            if layer < 0:
                skip = np.int32(a)
                break
            # Behind a thin layer the ray goes on.
            own[layer] = a
            start = t + shapes.nearest
    return False, np.int32(-1), casts
