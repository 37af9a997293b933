"""Which parts of tubes an end of the link sees: shadow rays to centres and corners, and the edges between.

A tube counts as seen where its centre is. Where its contribution matters, its corners are tested too, and the edge of
the shadow that runs through it is found, so that it can be clipped there.

Everywhere: points (n, 4, 3) [m] corners and centres of tubes on facets (n,); image (3,) [m] that the rays come from, or
the unit direction towards it when far.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.tracing.edge_crossings import FacetPlanes, meeting_lines
from raychan.tracing.legs import Leg, View
from raychan.tracing.radiation import exit_points
from raychan.tracing.shadow_edges import shadow_edges_of
from raychan.tracing.tubes import Refinement, Tubes
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_GAP_LEVELS = 2
"""Subdivisions of a hidden tube in search of a part that is seen, on flat facets; on curved ones it is one. With one on
all, one of 150 bodies of overlapping boxes is off by 0.4 dB where 0.3 dB are stated, three are no better than two; with
two on all, a car takes 3 % more rays."""
_SHRINK = 0.98  # of a corner's distance from the centre: corners lie on edges that other facets share; not measured


class ShadowRays(NamedTuple):
    """What shadow rays to tubes met: seen, blocker (3 c,) of those to corners, one after the other, for the tubes of
    which corners (n,) were tested; seen, blocker (n,) of those to centres. Blockers are facets, -1 for none."""

    seen: Bools
    blocker: Ints
    centre_seen: Bools
    centre_blocker: Ints
    corners: Bools


@dataclass(frozen=True)
class Visibility:
    """How tubes are seen over a leg: by their centre rays (a `View`), by `some` (n,) ray, `mixed` (n,) in part; `side`
    (n, 3): signed distances [m] of corners from a shadow edge, zeros where none is known."""

    centre: View
    some: Bools
    mixed: Bools
    side: Floats


def centre_visibility(geometry: Geometry, leg: Leg, tubes: Tubes, first: bool, rule: Refinement) -> View:
    """Return how the centres of tubes are seen over a leg; first whether these stand on their first surface."""
    points = on_facets(geometry, tubes) if first else tubes.points
    shape = geometry.first, geometry.normal, leg.image, leg.far
    aim, target, near, _ = shadow_rays(points, tubes.points, tubes.facet, *shape, True, np.zeros(len(tubes), bool))
    return leg.visible(geometry, aim, target, near, rule.layers)


def tube_visibility(
    geometry: Geometry,
    leg: Leg,
    tubes: Tubes,
    matters: Bools,
    first: bool,
    rule: Refinement,
    level: int = 0,
    centre: View | None = None,
    facing_away: Bools | None = None,
) -> Visibility:
    """Return how tubes are seen over a leg; by the centre ray alone where subdividing would not matter.

    Args: matters (n,); first whether they stand on their first surface; level how often they were subdivided: at the
    first ones a gap is looked for through which a tube is seen that none of its rays is; centre how their centres are
    seen, tested if not given; facing_away (n,) tubes beyond the horizon, which their own body does not hide.
    """
    n = len(tubes)
    points = on_facets(geometry, tubes) if first else tubes.points
    where = tubes.facet, geometry.first, geometry.normal, leg.image, leg.far
    corners = np.zeros(n, bool) if geometry.convex_alone else matters
    aim, target, near, slack = shadow_rays(points, tubes.points, *where, centre is None, corners)
    if facing_away is not None:
        rows = np.concatenate([np.arange(n if centre is None else 0), np.repeat(np.flatnonzero(corners), 3)])
        rows = np.flatnonzero(facing_away[rows])
        if not geometry.hides_nothing:
            aim[rows], target[rows] = exit_points(geometry, leg, aim[rows], target[rows])
    view = leg.visible(geometry, aim, target, near, rule.layers)
    if geometry.hides_nothing and facing_away is not None:
        view.seen[rows] = True
    if centre is None:
        centre, view = view.take(slice(n)), view.take(slice(n, None))
    rays = ShadowRays(view.seen, view.blocker, centre.seen, centre.blocker, corners)
    gaps = np.where(geometry.curved[tubes.facet], level < 1, level < _GAP_LEVELS)
    some, mixed, search = classify_rays(rays, matters, gaps, geometry.smooth)
    if facing_away is not None:
        search &= ~facing_away
    side = np.zeros((n, 3))
    rows, *parts = gather_partly_visible(search, points, tubes.facet, rays, geometry.plane, leg.image, leg.far)
    if len(rows):
        found = _shadow_edges(geometry, leg, tubes.facet[rows], slack[rows], parts)
        side[rows] = found
        mixed[rows] |= (found != 0.0).any(axis=1)
    if leg.mirrors:
        # What the leg lights may lie between all rays: a strip of a long facet beside a small mirror.
        rows = np.flatnonzero(corners & (mixed | ~some) & ~side.any(axis=1))
        side[rows] = leg.bounds_of_light(tubes.points[rows])
        mixed[rows] |= (side[rows] != 0.0).any(axis=1)
    return Visibility(centre, some, mixed, side)


def _shadow_edges(geometry: Geometry, leg: Leg, facet: Ints, slack: Floats, parts: list[Any]) -> Floats:
    """Return signed distances (k, 3) [m] of corners from the shadow edges on tubes that are seen in part.

    Args: parts as `gather_partly_visible` returns them, from the points on.
    """
    points, met, planes, source, back, own = parts
    found = shadow_edges_of(geometry, leg).across(points, facet, slack)
    # Where a body runs into this one, the shadow ends on the line in which the two planes meet.
    every = FacetPlanes(geometry.plane, geometry.first, geometry.normal)
    beside = geometry.scene_topology.beside
    meeting_lines(points, source, back, leg.far, planes, met, every, beside, own, found)
    return found


def on_facets(geometry: Geometry, tubes: Tubes) -> Floats:
    """Return the points (n, 4, 3) [m] of tubes on their first surface, projected to the flat facets that rays meet."""
    if not geometry.curved[tubes.facet].any():
        return tubes.points
    found: Floats = project_to_facets(tubes.points, tubes.facet, tubes.bary, geometry.curved, geometry.facets.vertices)
    return found


@njit(cache=True, nogil=True)
def project_to_facets(points, facet, bary, curved, vertices):  # type: ignore[no-untyped-def]
    """Return the points (n, 4, 3), those on curved facets moved to the flat ones by their corners' bary (n, 3, 3)."""
    out = points.copy()
    for i in range(len(facet)):
        f = facet[i]
        if not curved[f]:
            continue
        for c in range(3):
            total = 0.0
            for q in range(3):
                at = 0.0
                for j in range(3):
                    at += bary[i, q, j] * vertices[f, j, c]
                out[i, q, c] = at
                total += at
            out[i, 3, c] = total / 3.0
    return out


@njit(cache=True, forceinline=True)
def _slack(curved_points, first, normal, image, far):  # type: ignore[no-untyped-def]
    """Return by how much [m] the neighbours of a tube on the same curved surface may lie before it: a multiple of its
    height over its facet, along the ray."""
    height, slope, size = 0.0, 0.0, 0.0
    for q in range(4):
        rise = 0.0
        for c in range(3):
            rise += (curved_points[q, c] - first[c]) * normal[c]
        height = max(height, abs(rise))
    for c in range(3):
        k = image[c] if far else curved_points[3, c] - image[c]
        slope += k * normal[c]
        size += k * k
    return 1e-5 + 3.0 * height / max(abs(slope) / math.sqrt(size), 0.05)


@njit(cache=True, nogil=True, error_model="numpy")
def shadow_rays(points, curved_points, facet, first, normal, image, far, centres, corners):  # type: ignore[no-untyped-def]
    """Return the shadow rays (r,) to cast: points (r, 3) [m], facets and slack (r,) [m]; and the slack (n,) [m] of each
    tube.

    Args: curved_points (n, 4, 3) [m] the points on the curved surface; first, normal (m, 3) of the facets; centres
    whether those of all tubes are wanted, which then come first; corners (n,) of which tubes the corners are.
    """
    n = len(facet)
    at = n if centres else 0
    r = at
    for i in range(n):
        r += 3 if corners[i] else 0
    aim, target, near, slack = np.empty((r, 3)), np.empty(r, np.int32), np.empty(r), np.empty(n)
    for i in range(n):
        f = facet[i]
        slack[i] = _slack(curved_points[i], first[f], normal[f], image, far)
        if centres:
            target[i], near[i] = f, slack[i]
            for c in range(3):
                aim[i, c] = points[i, 3, c]
        if corners[i]:
            for q in range(3):
                target[at], near[at] = f, slack[i]
                for c in range(3):
                    aim[at, c] = points[i, 3, c] + _SHRINK * (points[i, q, c] - points[i, 3, c])
                at += 1
    return aim, target, near, slack


@njit(cache=True, nogil=True)
def classify_rays(rays, matters, gaps, smooth):  # type: ignore[no-untyped-def]
    """Return of tubes (n,) whether some ray is seen, whether only some are, and whether to search for a shadow edge.

    Args: rays as `ShadowRays`; matters (n,); gaps (n,) whether to search a tube that two bodies hide, between which
    there may be a gap: behind one smooth patch (f,) there is none.
    """
    seen, blocker, centre_seen, centre_blocker, corners = rays
    n = len(corners)
    some, mixed, search = np.empty(n, np.bool_), np.empty(n, np.bool_), np.empty(n, np.bool_)
    at = 0
    for i in range(n):
        whole, block = centre_seen[i], centre_blocker[i]
        some[i], one = whole, block >= 0
        if corners[i]:
            for q in range(at, at + 3):
                some[i] |= seen[q]
                whole &= seen[q]
                one = one and blocker[q] >= 0 and smooth[blocker[q]] == smooth[block]
            at += 3
        mixed[i] = some[i] and not whole
        search[i] = matters[i] and (some[i] or (gaps[i] and not one))
    return some, mixed, search


@njit(cache=True, nogil=True, error_model="numpy")
def gather_partly_visible(search, points, facet, rays, plane, image, far):  # type: ignore[no-untyped-def]
    """Return of the tubes to `search` (n,) their numbers, points, what each ray met, and the planes of that.

    Args: rays as `ShadowRays`; plane (f,) of the facets. Returns: rows (k,); points (k, 4, 3) [m]; met (k, 4) blockers,
    -1 for the tube's own surface; planes (k, 4) of these, -1 unknown; source (k, 3) [m], back (k, 3) the direction
    towards it; own (k, 3) unit normals of the tubes.
    """
    k = 0
    for i in range(len(search)):
        k += 1 if search[i] else 0
    rows, at = np.empty(k, np.int64), np.empty((k, 4, 3))
    met, planes = np.empty((k, 4), np.int32), np.empty((k, 4), np.int32)
    source, back, own = np.empty((k, 3)), np.empty((k, 3)), np.empty((k, 3))
    j, ray = 0, 0
    for i in range(len(search)):
        if search[i]:
            rows[j] = i
            for q in range(4):
                cast = q < 3 and rays.corners[i]
                free = rays.seen[ray + q] if cast else rays.centre_seen[i]
                block = rays.blocker[ray + q] if cast else rays.centre_blocker[i]
                met[j, q] = block
                planes[j, q] = plane[block] if block >= 0 else (plane[facet[i]] if free else -1)
                for c in range(3):
                    at[j, q, c] = points[i, q, c]
            size, area = 0.0, 0.0
            for c in range(3):
                a, b = (c + 1) % 3, (c + 2) % 3
                own[j, c] = (at[j, 1, a] - at[j, 0, a]) * (at[j, 2, b] - at[j, 0, b])
                own[j, c] -= (at[j, 1, b] - at[j, 0, b]) * (at[j, 2, a] - at[j, 0, a])
                area += own[j, c] ** 2
                source[j, c] = image[c]
                back[j, c] = image[c] if far else image[c] - at[j, 3, c]
                size += back[j, c] ** 2
            for c in range(3):
                own[j, c] /= max(math.sqrt(area), 1e-300)
                back[j, c] /= math.sqrt(size)
            j += 1
        if rays.corners[i]:
            ray += 3
    return rows, at, met, planes, source, back, own


DROP, KEEP, BISECT, CLIP = 0, 1, 2, 3
"""What is done with a tube."""


@njit(cache=True, nogil=True)
def choose_actions(facing, seen, some, mixed, rough, matters):  # type: ignore[no-untyped-def]
    """Return for each tube (n,) whether to DROP it, KEEP it, BISECT it where its phase bends, or CLIP it where only a
    part of it is seen.

    Args: facing (n,) whether it faces the end; seen (n,) by its centre ray, `some` (n,) by any, `mixed` (n,) in part;
    rough (n,) see `radiation.phases`; matters (n,) whether it may be subdivided.
    """
    out = np.empty(len(seen), np.int8)
    for i in range(len(seen)):
        out[i] = KEEP if seen[i] else DROP
        if matters[i]:
            # Bends come first: they choose the edge to bisect.
            if some[i] and rough[i] > 1.0:
                out[i] = BISECT
            elif mixed[i]:
                # Beyond the horizon no shadow edge is known to clip along.
                out[i] = CLIP if facing[i] else BISECT
    return out
