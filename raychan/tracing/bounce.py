"""One reflection: tubes leave their surface as rays of the law of reflection and are followed to the next surface.

The centre ray is cast first. Where a tube's contribution counts, its corner rays are cast too: a tube whose rays land
on several surfaces, or through which an edge runs, is subdivided (bisected, or clipped along that edge) and cast again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.records import MIRROR, REFLECT
from raychan.tracing.contributions import Contributions
from raychan.tracing.edge_crossings import FacetPlanes, TubeRays, edges_within
from raychan.tracing.launch import write_layers
from raychan.tracing.legs import Leg
from raychan.tracing.resolve_hits import (
    IncidentTubes,
    LandedTubes,
    ReflectingFacets,
    contribution_bounds,
    corner_rays,
    on_one_surface,
    phase_at_hits,
    reflect_directions,
    resolve_hits,
    spread_at_hits,
    tubes_at_hits,
)
from raychan.tracing.shared_work import all_of
from raychan.tracing.silhouette_crossings import silhouette_crossings_of
from raychan.tracing.subdivide import bisect, edge_of_spread, subdivide
from raychan.tracing.tubes import CENTRE, Refinement, Tubes, clearance, slices
from raychan.tracing.visibility import on_facets
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Rows = NDArray[np.signedinteger]

_DEEPER = 2.0  # fans that a tube may spread its rays by after its first bounce; trades rays for bias, not measured
_BUDGET_SHARE = 0.1  # of a cut for visibility: what a cut between bounces takes of the budget; not measured
_PARALLEL_FROM = 2000  # tubes from which on a second thread pays; not measured
_PART = 16384  # tubes that one thread follows at once; not measured
_WIDE = 0.05  # rad between the centre ray and a corner's; silhouettes clip narrower fans; not measured
_PAST_LAYER = 1e-6  # m behind a layer from which on hits count


@dataclass(frozen=True)
class _Bounce:
    """One reflection of one launch.

    Fields: leg in; out the leg by which contributions are bounded, without its antenna; first, last whether the tubes
    stand on their first surface, or land on their last; found the field found so far.
    """

    geometry: Geometry
    leg: Leg
    out: Leg
    first: bool
    last: bool
    found: Contributions

    @property
    def rule(self) -> Refinement:
        return self.found.rule


@dataclass(frozen=True)
class _Flight:
    """Tubes between two surfaces: `start` (n, 4) [m] from which hits count, layers passed so far, `through` (n, l), and
    how often each tube was cut and passed a layer, `count` (2, n)."""

    tubes: Tubes
    start: Floats
    through: Ints
    count: NDArray[np.int8]


def bounce(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, first: bool, last: bool, found: Contributions
) -> Tubes:
    """Return the tubes after one more reflection, on the surfaces where they land.

    Args: leg by which they came; out the leg by which their contributions are bounded, without its antenna; first, last
    whether `tubes` stand on their first surface, or land on their last; found the field found so far, by which tubes
    are subdivided or pruned.
    """
    has_room = tubes.slots < found.rule.slots - 2
    tubes = tubes if has_room.all() else tubes.take(has_room)
    parts = [tubes.only(rows) for rows in np.array_split(np.arange(len(tubes)), max(1, len(tubes) // _PART))]
    budgets = [found.forked(geometry, len(part) / max(len(tubes), 1)) for part in parts]
    steps = [_Bounce(geometry, leg, out, first, last, own) for own in budgets]
    flown = all_of(geometry, [partial(_flown, step, part) for step, part in zip(steps, parts, strict=True)])
    found.joined(budgets)
    landed = [some for part, _ in flown for some in part]
    if not landed:
        return tubes.take(np.zeros(len(tubes), bool))
    in_phase, bound, length = np.concatenate([some for _, weights in flown for some in weights], axis=1)
    return Tubes.join(landed, found.that_count(bound if last else in_phase, length))


def _flown(step: _Bounce, tubes: Tubes) -> tuple[list[Tubes], list[Floats]]:
    """Return the tubes where they land, and what they could contribute from there."""
    tubes = _narrowed(step, tubes)
    n, layers, landed = len(tubes), step.rule.layers, list[Tubes]()
    start = np.zeros((n, 4)) if step.first else clearance(step.geometry, tubes)
    flight = _Flight(tubes, start, np.full((n, layers), -1, np.int32), np.zeros((2, n), np.int8))
    while len(flight.tubes):
        flight = _cast_and_subdivide(step, flight, landed)
    return landed, [_contribution_bounds(step, t) for t in landed]


def _narrowed(step: _Bounce, tubes: Tubes) -> Tubes:
    """Return the tubes, those on curved surfaces bisected until each spreads its rays by `_DEEPER` fans at most, by one
    on first surfaces, where the launch does so already unless the rule is coarse; then only those that matter."""
    rule, done, coarse = step.rule, list[Tubes](), step.rule.coarse != 1.0
    fan = (1.0 if step.first else _DEEPER) * rule.fan
    if fan == np.inf or (step.first and not coarse):
        return tubes
    for _ in range(rule.levels):
        edge = edge_of_spread(tubes.k, tubes.normals, tubes.facet, step.geometry.curved, fan)
        wide = edge >= 0
        if coarse:
            in_phase, _, length = _contribution_bounds(step, tubes)
            wide &= in_phase > step.found.deep_threshold(length)
        if not wide.any():
            break
        done.append(tubes.take(~wide))
        tubes = bisect(step.geometry, step.leg, tubes, np.flatnonzero(wide), edge[wide], step.first, rule.jitter)
    return Tubes.join([tubes, *done])


def _cast_and_subdivide(step: _Bounce, flight: _Flight, landed: list[Tubes]) -> _Flight:
    """Cast centre rays, and corner rays where they matter; append to `landed` the tubes that land on one surface.

    Returns: the parts of tubes that were subdivided, and the tubes that go on behind thin layers.
    """
    geometry, found, rule, tubes = step.geometry, step.found, step.rule, flight.tubes
    directions = np.empty_like(tubes.k)
    parallel_for(
        len(tubes),
        lambda rows: reflect_directions(tubes.k[rows], tubes.normals[rows], directions[rows]),
        _PARALLEL_FROM,
    )
    points = on_facets(geometry, tubes) if step.first else tubes.points
    mid, ahead = geometry.cast(points[:, CENTRE], directions[:, CENTRE], tubes.facet, flight.start[:, CENTRE])
    matters = _matters(step, tubes, directions, mid, ahead)
    hit, reach = np.repeat(mid, 4).reshape(-1, 4), np.repeat(ahead, 4).reshape(-1, 4)
    one_surface = mid >= 0
    # Where the centre ray meets nothing, but the fan is wide, a corner may meet something.
    flat = tubes.flat & ~geometry.curved[tubes.facet]
    beside = np.flatnonzero(matters & ~one_surface & ~flat)
    followed = matters & one_surface
    followed[beside] = _wide(rule, directions[beside])
    rows = np.flatnonzero(followed)
    facets, distances = geometry.cast(*corner_rays(rows, points, directions, tubes.facet, flight.start))
    hit[rows, :3], reach[rows, :3] = facets.reshape(-1, 3), distances.reshape(-1, 3)
    on_one_surface(rows, hit, geometry.plane, geometry.smooth, geometry.normal, rule.patch, one_surface)
    rays = TubeRays(points, directions, tubes.length, flat, hit, reach)
    side = _edges_within(step, rays, np.flatnonzero(matters))
    mixed = (~one_surface & (hit >= 0).any(axis=1)) | side.any(axis=1)
    split = found.budget.affords(
        geometry, tubes.facet, mixed & matters & (flight.count[0] < rule.levels), _BUDGET_SHARE
    )
    ready = np.flatnonzero(~split & (mid >= 0))
    landed.append(_landed_tubes(step, tubes, ready, directions, hit, one_surface, flight.through))
    parts, rows = subdivide(geometry, step.leg, tubes, np.flatnonzero(split), side, step.first, rule.jitter)
    start = flight.start[rows]
    start[:] = np.where(start > 0, start.max(axis=1, keepdims=True), 0.0)
    cut = _Flight(parts, start, flight.through[rows], flight.count[:, rows] + np.array([[1], [0]], np.int8))
    behind = ready[geometry.is_layer[mid[ready]] & (flight.count[1, ready] < rule.layers)]
    return _with_tubes_behind_layers(flight, behind, mid, reach, cut) if len(behind) else cut


def _wide(rule: Refinement, directions: Floats) -> Bools:
    """Tell of which tubes (n,), where the rule leaves them so, corner rays spread too far from the centre's for
    silhouettes to be found between them."""
    if rule.fan < np.inf:
        return np.zeros(len(directions), bool)
    off = np.linalg.norm(directions[:, :CENTRE] - directions[:, CENTRE:], axis=2)
    return np.asarray(off.max(axis=1, initial=0.0) > _WIDE)


def _matters(step: _Bounce, tubes: Tubes, directions: Floats, mid: Ints, ahead: Floats) -> Bools:
    """Tell which tubes (n,) are worth subdividing: those that may contribute more than the prune threshold.

    Args: mid (n,) facet that the centre ray meets after `ahead` (n,) [m], -1 for none.
    """
    geometry, out, found = step.geometry, step.out, step.found
    in_phase, _, length = _contribution_bounds(step, tubes)
    if step.rule.by_landing:
        grown = np.empty(len(tubes))
        spread_at_hits(tubes.points, directions, mid, ahead, grown)
        in_phase *= grown
    if step.last:
        # What counts is how the phase runs where the tube lands: two mirrors at right angles send it straight back.
        # Where the centre ray meets nothing, or the ground, from which tubes do not return, a body may stand beside it.
        span, length = np.empty((2, len(tubes)))
        f = geometry.facets
        mid = np.where(f.role[f.body[mid]] == MIRROR, -1, mid)
        planes = geometry.first, geometry.normal
        rays = tubes.points, directions, tubes.length
        phase_at_hits(*rays, mid, ahead, *planes, out.image, out.far, step.rule.wavenumber, span, length)
        if step.rule.by_landing:
            # Beside where the centre ray lands the phase may run slowly, and there tubes along an edge err alike.
            span[tubes.flat & ~geometry.curved[tubes.facet]] = 0.0
        in_phase /= 1.0 + 0.5 * span
    matters = in_phase > found.deep_threshold(length)
    return np.asarray(matters & (not found.budget.spent(geometry)))


def _with_tubes_behind_layers(flight: _Flight, rows: Rows, mid: Ints, reach: Floats, cut: _Flight) -> _Flight:
    """Return the tubes `cut`, and the tubes `rows` that go on behind the thin layers `mid` (n,) that their rays meet
    after reach (n, 4) [m]."""
    start = np.where(np.isfinite(reach[rows]), reach[rows], reach[rows, CENTRE, None]) + _PAST_LAYER
    through, count = flight.through[rows], flight.count[:, rows]
    through[np.arange(len(rows)), count[1]] = mid[rows]
    count[1] += 1
    return _Flight(
        Tubes.join([cut.tubes, flight.tubes.take(rows)]),
        np.concatenate([cut.start, start]),
        np.concatenate([cut.through, through]),
        np.concatenate([cut.count, count], axis=1),
    )


def _contribution_bounds(step: _Bounce, tubes: Tubes) -> Floats:
    """Return what tubes could scatter over the leg out, all in phase or as their corners' phases run [1/m], and the
    length of the two-way path [m] (3, n)."""
    bounds = np.empty((3, len(tubes)))
    geometry, out = step.geometry, step.out
    rays = tubes.points, tubes.k, tubes.length, tubes.normals, tubes.facet, tubes.strength, tubes.spread
    how = out.image, out.far, step.rule.wavenumber, geometry.lossy, *geometry.material_columns

    def some(rows: slice) -> None:
        contribution_bounds(*(*(x[rows] for x in rays), *how, *bounds[:, rows]))

    parallel_for(len(tubes), some, _PARALLEL_FROM)
    return bounds


def _edges_within(step: _Bounce, rays: TubeRays, rows: Rows) -> Floats:
    """Return signed distances (n, 3) [m] of corners from an edge that runs through each of the tubes `rows`; zeros
    where none does."""
    geometry, side = step.geometry, np.zeros((len(rays.hit), 3))
    planes = FacetPlanes(geometry.plane, geometry.first, geometry.normal)
    edges = geometry.first_edge, geometry.plane_edges

    def some(part: slice) -> None:
        edges_within(rows[part], rays, step.leg.far, geometry.extent, planes, *edges, side)

    parallel_for(len(rows), some, _PARALLEL_FROM)
    silhouette_crossings_of(geometry).find(rows, rays, step.leg.far, side)
    return side


def _landed_tubes(
    step: _Bounce, tubes: Tubes, rows: Rows, directions: Floats, hit: Ints, one_surface: Bools, through: Ints
) -> Tubes:
    """Return the tubes `rows` on the planes of the facets that their rays meet, or of the facet that the centre ray
    meets where these are not of one surface; the reflection is written into their history."""
    geometry = step.geometry
    planes = geometry.first, geometry.normal
    f = geometry.facets
    patches = f.vertices, geometry.edge_curvature, geometry.curved
    rows, facet, reach = resolve_hits(rows, tubes.points, directions, hit, one_surface, *planes, patches)
    n = len(rows)
    before = IncidentTubes(
        tubes.points, directions, tubes.length, tubes.normals, tubes.facet, tubes.spread, tubes.strength, tubes.flat,
        tubes.caustics,
    )  # fmt: skip
    after = LandedTubes(
        np.empty((n, 4, 3)), np.empty((n, 4, 3)), np.empty((n, 4)), np.empty((n, 4, 3)), np.empty(n), np.empty(n),
        np.empty(n, bool), np.empty_like(tubes.caustics, shape=n),
    )  # fmt: skip
    facets = ReflectingFacets(f.vertices, f.normals, geometry.curved, *geometry.material_columns)

    def some(part: slice) -> None:
        there = rows[part], facet[part], reach[part]
        tubes_at_hits(*there, before, facets, step.leg.far, step.rule.wavenumber, slices(after, part))

    parallel_for(n, some, _PARALLEL_FROM)
    vertex, normal = tubes.points[rows, CENTRE], tubes.normals[rows, CENTRE]
    landed = Tubes(
        **after._asdict(),
        facet=facet[:, CENTRE].copy(),
        bary=np.empty((n, 0, 3)),
        slots=tubes.slots[rows] + np.int8(1),
        bounces=tubes.bounces[rows] + np.int8(1),
        last=tubes.history.append(tubes.last[rows], vertex, normal, tubes.facet[rows], REFLECT),
        history=tubes.history,
    )
    write_layers(geometry, landed, vertex, after.k[:, CENTRE], through[rows], step.rule)
    return landed
