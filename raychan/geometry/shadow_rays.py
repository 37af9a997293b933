"""Shadow rays: whether a ray that is aimed at a point of a surface reaches it, and through which layers (numba
kernels)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.intersect import contains

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class ShadowTargets(NamedTuple):
    """What shadow rays are aimed at: limit (n,) [m] distance of the target; slack (n,) [m] by which its own smooth
    surface may lie before it; its facet (n,), -1 for none; the body `inside` of which it lies (n,; empty: none)."""

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


@njit(cache=True, forceinline=True)
def _is_clear(a, t, x, d, b, limit, slack, surfaces):  # type: ignore[no-untyped-def]
    """Tell whether a ray aimed at facet b (-1: none) that met facet a at t [m] reached its `limit` [m].

    Only the target's own smooth surface may lie before it by `slack` [m], others by the surfaces' touch [m]. Where
    another surface lies in the plane of the target, at the same place, that counts and the target does not: what is
    drawn twice scatters once. Facets of one plane overlap where the point lies within both.
    """
    if a < 0 or a == b:
        return True
    v, n = surfaces.vertices, surfaces.normal
    own = b >= 0 and surfaces.smooth[a] == surfaces.smooth[b]
    close = min(slack, surfaces.touch)
    free = t >= limit - (slack if own else close)
    if b < 0 or abs(t - limit) >= close:
        return free
    if abs(n[a, 0] * n[b, 0] + n[a, 1] * n[b, 1] + n[a, 2] * n[b, 2]) <= 1.0 - 1e-9:
        return free
    if surfaces.plane[a] != surfaces.plane[b] and not own:
        return False
    margin = surfaces.margin
    return free and not (contains(v[a], n[a], x, t, d, -margin) and contains(v[b], n[b], x, t, d, -margin))


@njit(cache=True, nogil=True)
def resolve_shadow_rays(  # type: ignore[no-untyped-def]
    todo, facet, t, origin, direction, targets, surfaces, reached, passed, blocker
):
    """Write what the shadow rays `todo` (m,) reached, that met `facet` (m,) at t (m,) [m]; return which of these (k,)
    go on behind a thin layer.

    Args: origin, direction (m, 3); targets as `ShadowTargets`, surfaces as `ShadowSurfaces`; reached (n,), passed (n,
    layers), blocker (n,) are written.
    """
    more = np.empty(len(todo), np.int64)
    count = 0
    for j in range(len(todo)):
        i, a = todo[j], facet[j]
        free = _is_clear(
            a, t[j], origin[j], direction[j], targets.facet[i], targets.limit[i], targets.slack[i], surfaces
        )
        if not free and len(targets.inside):
            free = surfaces.body[a] == targets.inside[i]
        if free:
            reached[i] = True
            blocker[i] = -1
            continue
        blocker[i] = a
        if not len(surfaces.is_layer) or not surfaces.is_layer[a]:
            continue
        for q in range(passed.shape[1]):
            if passed[i, q] < 0:
                passed[i, q] = a
                more[count] = j
                count += 1
                break
    return more[:count].copy()
