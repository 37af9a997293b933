"""Shadow rays to tubes: to the centre of each and, where its contribution matters, to its corners (numba kernels)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.geometry.embree_packet import own_packet
from raychan.parallel import parallel_for
from raychan.tracing.leg_rays import LegChain, follow_leg
from raychan.vectors import copy_to
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_SHRINK = 0.98  # of a corner's distance from the centre: corners lie on edges that other facets share; not measured
_PARALLEL_FROM = 1000  # tubes, of one to four rays each, from which on a second thread pays; not measured
NONE_AWAY = np.zeros(0, bool)
NO_GAPS, BETWEEN, ANY_GAP = 0, 1, 2
"""Where shadow edges are searched of tubes that no ray sees."""
_NO_BODY = np.zeros(0, np.int64)


class ShadowRays(NamedTuple):
    """Rays to the corners and centres of tubes, to be written.

    Fields: `points` (n, 4, 3) [m] at which they end, on facets `target` (n, 4), before which their own smooth
    surface may lie by `slack` (n,) [m]. Of centres `seen` (n,), the facet `blocker` (n,) in the way, -1 for none,
    mirror points `corners` (n, m, 3) [m], layers `passed` (n, l) (see `leg_rays.follow_leg`); of corners
    `corner_seen`, `corner_blocker` (n, 3), where they are tested. `some` (n,) ray is seen; only a part is, `mixed`
    (n,); whether to `search` (n,) for a shadow edge."""

    points: Floats
    target: Ints
    slack: Floats
    seen: Bools
    blocker: Ints
    corners: Floats
    passed: Ints
    corner_seen: Bools
    corner_blocker: Ints
    some: Bools
    mixed: Bools
    search: Bools

    @staticmethod
    def room(n: int, mirrors: int, layers: int) -> ShadowRays:
        """Return rays to n tubes over so many mirrors, through at most so many layers on each stretch."""
        points, target, slack = np.empty((n, 4, 3)), np.empty((n, 4), np.int32), np.empty(n)
        seen, some, mixed, search = np.zeros((4, n), bool)
        centre = seen, np.empty(n, np.int32), np.empty((n, mirrors, 3)), np.empty((n, layers * (mirrors + 1)), np.int32)
        corner = np.empty((n, 3), bool), np.empty((n, 3), np.int32)
        return ShadowRays(points, target, slack, *centre, *corner, some, mixed, search)


class TubesToSee(NamedTuple):
    """Tubes on their surface: points (n, 4, 3) [m] of the curved surface; the same moved to the flat facets that rays
    meet, to be written if other than these; facet (n,); bary (n, 3, 3) corners on the first facet. No tubes: the rays
    are drawn already."""

    points: Floats
    flat: Floats
    facet: Ints
    bary: Floats


class FlatFacets(NamedTuple):
    """Facets: vertices (f, 3, 3) [m]; a point on each (f, 3) [m] and its normal (f, 3); which are curved (f,), and the
    curvatures (f, 3, 3) [m] of their edges."""

    vertices: Floats
    first: Floats
    normal: Floats
    curved: Bools
    bend: Floats


class Tested(NamedTuple):
    """What of tubes is tested: corners (n,); whether centres are; tubes that matters (n,), of which shadow edges are
    searched; `gaps` (n,) where they are searched of tubes that no ray sees: `NO_GAPS` nowhere, `BETWEEN` two smooth
    patches that hide a tube, `ANY_GAP` also beside one patch, which may be hollow; facing_away (n,; empty: none) tubes
    beyond the horizon, for which no edge is searched and which a convex body does not hide."""

    corners: Bools
    centres: bool
    matters: Bools
    gaps: NDArray[np.int8]
    facing_away: Bools

    @staticmethod
    def centres_of(n: int) -> Tested:
        """Return that only the centres of n tubes are tested."""
        none = np.zeros(n, bool)
        return Tested(none, True, none, np.full(n, NO_GAPS, np.int8), NONE_AWAY)


_NO_TUBES = TubesToSee(np.empty((0, 4, 3)), np.empty((0, 4, 3)), np.empty(0, np.int32), np.empty((0, 3, 3)))


def cast_shadow_rays(
    geometry: Geometry,
    chain: LegChain,
    rays: ShadowRays,
    tested: Tested,
    tubes: TubesToSee = _NO_TUBES,
    inside: NDArray[np.int64] = _NO_BODY,
    cast: bool = True,
) -> None:
    """Draw the rays to tubes, and write how they are seen over a leg, on all threads; count the rays.

    Args: inside (n,; empty: none) bodies in which the points lie, which do not hide them; cast whether rays are cast,
    not only drawn.
    """
    if not len(geometry.first):
        # Where nothing is, nothing hides.
        rays.seen[:], rays.passed[:], rays.blocker[:] = True, -1, -1
        return
    vertices, bend = geometry.facets.vertices, geometry.edge_curvature
    facets = FlatFacets(vertices, geometry.first, geometry.normal, geometry.curved, bend)
    fixed = tubes, facets, inside, chain, 2.0 * geometry.extent + 1.0, geometry.met_by_rays
    projects, counts = len(tubes.facet) > 0 and tubes.flat is not tubes.points, []

    def some(rows: slice) -> None:
        room = np.empty(rays.corners.shape[1:]), np.empty(rays.passed.shape[1], np.int32)
        how = projects, cast, rows.start, rows.stop
        counts.append(_each_tube(rays, tested, *fixed, own_packet(), room, *how))

    parallel_for(len(rays.slack), some, _PARALLEL_FROM)
    geometry.count_rays(sum(counts))


def points_seen(
    geometry: Geometry, chain: LegChain, points: Floats, facet: Ints, slack: Floats, layers: int, inside: Ints | None
) -> ShadowRays:
    """Return rays to single points (n, 3) [m] on facets (n,), as centres (see `legs.Leg.visible`)."""
    rays = ShadowRays.room(len(points), len(chain.at), layers)
    rays.points[:, 3], rays.target[:, 3], rays.slack[:] = points, facet, slack
    body = _NO_BODY if inside is None else np.ascontiguousarray(inside, np.int64)
    cast_shadow_rays(geometry, chain, rays, Tested.centres_of(len(points)), _NO_TUBES, body)
    return rays


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def project_to_facet(bary, vertices, out):  # type: ignore[no-untyped-def]
    """Write the corners and centre (4, 3) [m] of a tube on the flat facet of vertices (3, 3), its corners at bary (3,
    3)."""
    for c in range(3):
        total = 0.0
        for q in range(3):
            at = 0.0
            for j in range(3):
                at += bary[q, j] * vertices[j, c]
            out[q, c] = at
            total += at
        out[3, c] = total / 3.0


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
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


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _move_across(bend, image, far, points):  # type: ignore[no-untyped-def]
    """Move points (4, 3) [m] on a flat facet, across the ray to the last one, by as much as its curved surface lies
    beside it on average: what hides a part of the facet then hides as large a part of the surface."""
    along, size = 0.0, 0.0
    for c in range(3):
        k = image[c] if far else points[3, c] - image[c]
        # Of a patch's products l_i l_j the mean is a twelfth.
        along -= k * (bend[0, c] + bend[1, c] + bend[2, c]) / 12.0
        size += k * k
    for c in range(3):
        k = image[c] if far else points[3, c] - image[c]
        moved = -(bend[0, c] + bend[1, c] + bend[2, c]) / 12.0 - along * k / size
        for q in range(4):
            points[q, c] += moved


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _draw(i, rays, tubes, facets, image, far, projects):  # type: ignore[no-untyped-def]
    """Write where the rays to tube i end, and the tube moved to flat facets where it `projects` to these."""
    f, flat = tubes.facet[i], tubes.flat[i]
    if projects and facets.curved[f]:
        project_to_facet(tubes.bary[i], facets.vertices[f], flat)
        _move_across(facets.bend[f], image, far, flat)
    elif projects:
        for q in range(4):
            copy_to(flat[q], tubes.points[i, q])
    rays.slack[i] = _slack(tubes.points[i], facets.first[f], facets.normal[f], image, far)
    for q in range(4):
        rays.target[i, q] = f
        for c in range(3):
            rays.points[i, q, c] = flat[3, c] if q == 3 else flat[3, c] + _SHRINK * (flat[q, c] - flat[3, c])


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _each_tube(  # type: ignore[no-untyped-def]
    rays, tested, tubes, facets, inside, leg, reach, caster, packet, room, projects, cast, begin, end
):  # fmt: skip
    """Draw rays to tubes `begin` to `end` and follow them; return how many rays were cast.

    Args: leg, reach, caster, packet as for `follow_leg`; room for mirror points and layers of corners; projects, cast
    as in `cast_shadow_rays`.
    """
    casts, smooth, hides_nothing = 0, caster[2].smooth, caster[3]
    for i in range(begin, end):
        if len(tubes.facet):
            _draw(i, rays, tubes, facets, leg.images[len(leg.at)], leg.far, projects)
        if not cast:
            continue
        away = len(tested.facing_away) > 0 and tested.facing_away[i]
        for q in range(3, -1, -1):
            if not (tested.corners[i] if q < 3 else tested.centres):
                continue
            corners, passed = room
            if q == 3:
                corners, passed = rays.corners[i], rays.passed[i]
            aimed = rays.points[i, q], rays.target[i, q], rays.slack[i], inside[i] if len(inside) else -1
            free, block, tries = follow_leg(*aimed, leg, reach, caster, packet, corners, passed)
            casts += tries
            # A convex body alone does not hide its own currents.
            free = free or (away and hides_nothing)
            if q == 3:
                rays.seen[i], rays.blocker[i] = free, block
            else:
                rays.corner_seen[i, q], rays.corner_blocker[i, q] = free, block
        some, whole, block = rays.seen[i], rays.seen[i], rays.blocker[i]
        one = block >= 0
        for q in range(3 if tested.corners[i] else 0):
            other = rays.corner_blocker[i, q]
            some |= rays.corner_seen[i, q]
            whole &= rays.corner_seen[i, q]
            # Behind one smooth patch there is a gap only if it is hollow.
            one = one and other >= 0 and smooth[other] == smooth[block]
        rays.some[i], rays.mixed[i] = some, some and not whole
        gap = tested.gaps[i] == ANY_GAP or (tested.gaps[i] == BETWEEN and not one)
        rays.search[i] = tested.matters[i] and (some or gap) and not away
    return casts
