"""Which parts of tubes an end of the link sees: shadow rays to centres and corners, and the edges between.

A tube counts as seen where its centre is. Where its contribution matters, its corners are tested too, and the edge of
the shadow that runs through it is found, so that it can be clipped there.

Everywhere: points (n, 4, 3) [m] corners and centres of tubes on facets (n,); image (3,) [m] that the rays come from, or
the unit direction towards it when far.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.parallel import parallel_for
from raychan.tracing.edge_crossings import FacetPlanes, meeting_lines
from raychan.tracing.image_paths import bounds_of_light
from raychan.tracing.legs import Leg, View
from raychan.tracing.radiation import exit_points
from raychan.tracing.shadow_edges import longest_shadows, shadow_edges_of
from raychan.tracing.tube_rays import (
    ANY_GAP,
    BETWEEN,
    NO_GAPS,
    NONE_AWAY,
    ShadowRays,
    Tested,
    TubesToSee,
    cast_shadow_rays,
    project_to_facet,
)
from raychan.tracing.tubes import Refinement, Tubes
from raychan.vectors import copy_to
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Rows = NDArray[np.intp]

_GAP_LEVELS = 2
"""Subdivisions of a hidden tube in search of a part that is seen, on flat facets; on curved ones it is one. With one on
all, one of 150 bodies of overlapping boxes is off by 0.4 dB where 0.3 dB are stated, three are no better than two; with
two on all, a car takes 3 % more rays."""
_PARALLEL_FROM = 200  # tubes searched for shadow edges from which on a second thread pays; not measured


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
    rays = ShadowRays.room(len(tubes), len(leg.mirrors), rule.layers)
    cast_shadow_rays(geometry, leg.chain, rays, Tested.centres_of(len(tubes)), _drawn(geometry, tubes, first))
    return View.of(rays)


def tube_visibility(
    geometry: Geometry,
    leg: Leg,
    tubes: Tubes,
    matters: Bools,
    first: bool,
    rule: Refinement,
    level: int | None = 0,
    centre: View | None = None,
    facing_away: Bools | None = None,
) -> Visibility:
    """Return how tubes are seen over a leg; by the centre ray alone where subdividing would not matter.

    Args: matters (n,); first whether they stand on their first surface; level how often they were subdivided: at the
    first ones a gap is looked for through which a tube is seen that none of its rays is, if None in all tubes, also
    beside a single smooth patch; centre how their centres are seen, tested if not given; facing_away (n,) tubes beyond
    the horizon, which their own body does not hide.
    """
    n = len(tubes)
    corners = np.zeros(n, bool) if geometry.convex_alone else matters
    away = NONE_AWAY if facing_away is None else facing_away
    rays = ShadowRays.room(n, len(leg.mirrors), rule.layers)
    if centre is not None:
        rays = rays._replace(seen=centre.seen, blocker=centre.blocker, corners=centre.corners, passed=centre.passed)
    tested = Tested(corners, centre is None, matters, _gaps(geometry, tubes, level), away)
    drawn = _drawn(geometry, tubes, first)
    if not geometry.hides_nothing and away.any():
        cast_shadow_rays(geometry, leg.chain, rays, tested, drawn, cast=False)
        _leave_bodies(geometry, leg, rays, tested)
        cast_shadow_rays(geometry, leg.chain, rays, tested)
    else:
        cast_shadow_rays(geometry, leg.chain, rays, tested, drawn)
    side = np.zeros((n, 3))
    rows = np.flatnonzero(rays.search)
    if len(rows):
        _search(geometry, leg, rows, drawn, rays, corners, side)
    if leg.mirrors:
        edges_of_light(tubes.points, corners, rays, leg.edges_of_mirrors, side)
    return Visibility(View.of(rays) if centre is None else centre, rays.some, rays.mixed, side)


def _gaps(geometry: Geometry, tubes: Tubes, level: int | None) -> NDArray[np.int8]:
    """Return where gaps are looked for through which parts of hidden tubes (n,), subdivided `level` times (None:
    anywhere), are seen, as for `Tested`."""
    if level is None:
        return np.full(len(tubes), ANY_GAP, np.int8)
    looked_for = np.where(geometry.curved[tubes.facet], level < 1, level < _GAP_LEVELS)
    return np.where(looked_for, BETWEEN, NO_GAPS).astype(np.int8)


def _drawn(geometry: Geometry, tubes: Tubes, first: bool) -> TubesToSee:
    """Return tubes as rays are drawn to them."""
    # On their first surface tubes are moved to the flat facets that rays meet.
    flat = np.empty_like(tubes.points) if first and geometry.any_curved else tubes.points
    return TubesToSee(tubes.points, flat, tubes.facet, tubes.bary)


def _leave_bodies(geometry: Geometry, leg: Leg, rays: ShadowRays, tested: Tested) -> None:
    """Move the points of tubes beyond the horizon to where the rays from there leave their body."""
    cast = np.column_stack([tested.corners] * 3 + [np.full(len(rays.slack), tested.centres)])
    rows = np.nonzero(cast & tested.facing_away[:, None])
    rays.points[rows], rays.target[rows] = exit_points(geometry, leg, rays.points[rows], rays.target[rows])


def _search(
    geometry: Geometry, leg: Leg, rows: Rows, tubes: TubesToSee, rays: ShadowRays, corners: Bools, side: Floats
) -> None:
    """Write signed distances (n, 3) [m] of the corners of tubes `rows` (k,), which are seen in part, from the shadow
    edges on them, and that these are `mixed`."""
    edges = shadow_edges_of(geometry, leg)
    planes = FacetPlanes(geometry.plane, geometry.first, geometry.normal)
    facets = planes, geometry.smooth, geometry.touch, geometry.scene_topology.beside

    def some(part: slice) -> None:
        edges_across(rows[part], tubes, rays, corners, facets, leg.image, leg.far, edges, side)

    parallel_for(len(rows), some, _PARALLEL_FROM)


@njit(cache=True, nogil=True)
def project_to_facets(points, facet, bary, curved, vertices):  # type: ignore[no-untyped-def]
    """Return the points (n, 4, 3), those on curved facets moved to the flat ones by their corners' bary (n, 3, 3)."""
    out = points.copy()
    for i in range(len(facet)):
        if curved[facet[i]]:
            project_to_facet(bary[i], vertices[facet[i]], out[i])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def edges_across(rows, tubes, rays, corners, facets, image, far, edges, side):  # type: ignore[no-untyped-def]
    """Write into side (n, 3) how the corners of tubes `rows` (k,), seen in part, lie to a shadow edge.

    Args: tubes as `TubesToSee`, rays as `ShadowRays`; corners (n,) of which tubes the corners were tested; facets as
    `FacetPlanes`, their smooth patches (f,), touch [m] within which surfaces lie on each other, and the facets (f, 3)
    beside each; edges as `shadow_edges.ShadowEdges`.
    """
    planes, smooth, touch, beside = facets
    n = len(rows)
    points, facet, slack, found = np.empty((n, 4, 3)), np.empty(n, np.int32), np.empty(n), np.zeros((n, 3))
    met, plane = np.empty((n, 4), np.int32), np.empty((n, 4), np.int32)
    source, back, own = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    _gather(
        rows, tubes, rays, corners, planes.number, image, far, (points, facet, slack, met, plane, source, back, own)
    )
    longest_shadows(points, facet, slack, planes.normal, smooth, touch, edges, found)
    # Where a body runs into this one, the shadow ends on the line in which the two planes meet.
    meeting_lines(points, source, back, far, plane, met, planes, beside, own, found)
    for j in range(n):
        for q in range(3):
            side[rows[j], q] = found[j, q]
            rays.mixed[rows[j]] |= found[j, q] != 0.0


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _gather(rows, tubes, rays, corners, plane, image, far, out):  # type: ignore[no-untyped-def]
    """Write of tubes `rows` (k,) what `edges_across` needs, one after the other.

    Args: plane (f,) of the facets; out points (k, 4, 3) [m]; facet, slack (k,); met (k, 4) blockers, -1 for the tube's
    own surface; planes (k, 4) of these, -1 unknown; source (k, 3) [m], back (k, 3) the direction towards it; own (k, 3)
    unit normals of the tubes.
    """
    at, facet, slack, met, planes, source, back, own = out
    for j in range(len(rows)):
        i = rows[j]
        facet[j], slack[j] = tubes.facet[i], rays.slack[i]
        for q in range(4):
            cast = q < 3 and corners[i]
            free = rays.corner_seen[i, q] if cast else rays.seen[i]
            block = rays.corner_blocker[i, q] if cast else rays.blocker[i]
            met[j, q] = block
            planes[j, q] = plane[block] if block >= 0 else (plane[facet[j]] if free else -1)
            copy_to(at[j, q], tubes.flat[i, q])
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


@njit(cache=True, nogil=True, error_model="numpy")
def edges_of_light(points, corners, rays, mirrors, side):  # type: ignore[no-untyped-def]
    """Write into side (n, 3) where what a leg lights of tubes (n,) ends, and that these are `mixed`: it may lie between
    all their rays, as a strip of a long facet beside a small mirror.

    Args: points (n, 4, 3) [m]; corners (n,) of which tubes the corners were tested; rays as `ShadowRays`; mirrors as
    `Leg.edges_of_mirrors`.
    """
    rows, count = np.empty(len(points), np.int64), 0
    for i in range(len(points)):
        if corners[i] and (rays.mixed[i] or not rays.some[i]) and not side[i].any():
            rows[count] = i
            count += 1
    bounds_of_light(points, rows[:count], *mirrors, side)
    for i in rows[:count]:
        rays.mixed[i] |= side[i].any()


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
