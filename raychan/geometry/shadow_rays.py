"""Rays from surface to surface, and shadow rays: whether a ray that is aimed at a point of a surface reaches it, and
through which layers (numba kernels)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.intersect import contains, first_hit
from raychan.vectors import dot

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class ShadowTargets(NamedTuple):
    """What shadow rays are aimed at: limit (n,; empty: nothing) [m] distance of the target; slack (n,) [m] by which its
    own smooth surface may lie before it; its facet (n,), -1 for none; the body `inside` of which it lies (n,; empty:
    none)."""

    limit: Floats
    slack: Floats
    facet: Ints
    inside: NDArray[np.int64]


class ShadowSurfaces(NamedTuple):
    """Facets that may block: vertices (f, 3, 3) [m], normal (f, 3); plane, smooth patch and body (f,) of each; is_layer
    (f,; empty: none is); touch [m] within which surfaces lie on each other; margin [m] of rounding at edges."""

    vertices: Floats
    normal: Floats
    plane: Ints
    smooth: Ints
    body: Ints
    is_layer: NDArray[np.bool_]
    touch: float
    margin: float


class MetFacets(NamedTuple):
    """What rays met, written ray by ray. Of rays aimed at nothing: facet (n,), -1 for none, and its distance (n,) [m].
    Of shadow rays, the others empty: reached (n,), which those that are need no cast; passed (n, layers) facets in
    order, -1 unused; blocker (n,) the facet in the way, -1 for none."""

    facet: Ints
    distance: Floats
    reached: NDArray[np.bool_]
    passed: Ints
    blocker: Ints


@njit(cache=True, forceinline=True, uncounted=True)
def is_clear(a, t, x, d, b, limit, slack, surfaces):  # type: ignore[no-untyped-def]
    """Tell whether a ray aimed at facet b (-1: none) that met facet a at t [m] reached its `limit` [m].

    Only the target's own smooth surface may lie before it by `slack` [m], others by the surfaces' touch [m]. Where
    another surface lies in the plane of the target, at the same place, that counts and the target does not: what is
    drawn twice scatters once. Facets of one plane overlap where the point lies within both.
    """
    if a < 0 or a == b:
        return True
    own = b >= 0 and surfaces.smooth[a] == surfaces.smooth[b]
    close = min(slack, surfaces.touch)
    free = t >= limit - (slack if own else close)
    if b < 0 or abs(t - limit) >= close:
        return free
    if abs(dot(surfaces.normal[a], surfaces.normal[b])) <= 1.0 - 1e-9:
        return free
    if surfaces.plane[a] != surfaces.plane[b] and not own:
        return False
    return free and not (_inside(a, x, t, d, surfaces) and _inside(b, x, t, d, surfaces))


@njit(cache=True, forceinline=True, uncounted=True)
def _inside(a, x, t, d, surfaces):  # type: ignore[no-untyped-def]
    """Tell whether a ray meets facet a farther from its edges than rounding."""
    return contains(surfaces.vertices[a], surfaces.normal[a], x, t, d, -surfaces.margin)


@njit(cache=True, forceinline=True, uncounted=True)
def unused(passed):  # type: ignore[no-untyped-def]
    """Return the first place in `passed` (layers,) that holds no facet yet, -1 if all do."""
    for q in range(len(passed)):
        if passed[q] < 0:
            return q
    return -1


@njit(cache=True, nogil=True, uncounted=True)
def follow_rays(rays, targets, groups, shapes, surfaces, packet, met):  # type: ignore[no-untyped-def]
    """Write into `met` what rays meet first, or, where they are aimed at targets, what they reached through layers.

    Args: rays as `CastRays`, targets as `ShadowTargets`, groups as `FacetGroups`, shapes as `FacetShapes`, surfaces as
    `ShadowSurfaces`, packet as `embree_packet.own_packet` returns it, met as `MetFacets`.
    Returns: how many rays were cast; a ray and its companions count as one.
    """
    floats, words = packet
    origin, direction, skip, starts = rays
    facet, distance, reached, passed, blocker = met
    aimed, casts = len(targets.limit) > 0, 0
    for i in range(len(origin)):
        if aimed and reached[i]:
            continue
        x = origin[i, 0], origin[i, 1], origin[i, 2]
        d = direction[i, 0], direction[i, 1], direction[i, 2]
        start = starts[i] if len(starts) else 0.0
        while True:
            a, t, tries = first_hit(x, d, skip[i], start, groups, shapes, floats, words)
            casts += tries
            if not aimed:
                facet[i], distance[i] = a, t
                break
            free = is_clear(a, t, x, d, targets.facet[i], targets.limit[i], targets.slack[i], surfaces)
            if not free and len(targets.inside):
                free = surfaces.body[a] == targets.inside[i]
            reached[i], blocker[i] = free, -1 if free else a
            layer = -1 if free or not len(surfaces.is_layer) or not surfaces.is_layer[a] else unused(passed[i])
            if layer < 0:
                break
            # Behind a thin layer the ray goes on.
            passed[i, layer] = a
            start = t + shapes.nearest
    return casts
