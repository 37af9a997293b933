"""Trace: from bounce to bounce; tubes that would straddle two surfaces are cut while they matter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.parallel import parallel_for
from raychan.records import REFLECT
from raychan.tracing.contributions import Contributions
from raychan.tracing.edge_crossings import edges_within
from raychan.tracing.launch import on_facets, write_layers
from raychan.tracing.legs import Leg
from raychan.tracing.resolve_hits import agreeing, ahead_of, corner_rays, fates, put_down, reflected, weigh
from raychan.tracing.silhouette_crossings import between
from raychan.tracing.subdivide import divide
from raychan.tracing.tubes import CENTRE, Refinement, Tubes
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Rows = NDArray[np.signedinteger]

_ALIKE = 0.98  # cosine within which normals of one smooth patch may differ over a tube
_LIGHT = 0.1  # of the cost of a cut for sight: what one between bounces takes
_MANY = 2000  # tubes from which on a second thread pays


def bounce(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, first: bool, last: bool, found: Contributions
) -> Tubes:
    """Return the tubes after one more reflection, standing where they land.

    Args: out the way back used to weigh tubes, but for its antenna; first, last whether `tubes` stand on their first
    surface, or land on their last; found what was so far.
    """
    rule = found.rule
    landed: list[Tubes] = []
    short = tubes.slots < rule.slots - 2
    tubes = tubes if short.all() else tubes.take(short)
    n = len(tubes)
    flight = _Flight(tubes, np.zeros((n, 4)), np.full((n, rule.layers), -1, np.int32), np.zeros((2, n), np.int8))
    while len(flight.tubes):
        flight = _step(geometry, leg, out, flight, first, last, found, landed)
    if not landed:
        return tubes.take(np.zeros(n, bool))
    weights = [_weigh(geometry, out, t, rule) for t in landed]
    area, bound, whole = np.concatenate(weights, axis=1)
    return Tubes.join(landed, found.that_count(bound if last else area, whole))


@dataclass(frozen=True)
class _Flight:
    """Tubes between two surfaces: `start` (n, 4) [m] from which hits count, layers `through` (n, l) so far, and how
    often each was cut and passed a layer, `count` (2, n)."""

    tubes: Tubes
    start: Floats
    through: Ints
    count: NDArray[np.int8]


def _step(
    geometry: Geometry,
    leg: Leg,
    out: Leg,
    flight: _Flight,
    first: bool,
    last: bool,
    found: Contributions,
    landed: list[Tubes],
) -> _Flight:
    """Cast centre rays, and corners where they matter; land what agrees; return what was cut, and what goes on behind
    the thin layers that were hit."""
    rule, tubes = found.rule, flight.tubes
    area, _, whole = _weigh(geometry, out, tubes, rule)
    way = np.empty_like(tubes.k)
    parallel_for(len(tubes), lambda rows: reflected(tubes.k[rows], tubes.normals[rows], way[rows]), _MANY)
    points = on_facets(geometry, tubes) if first else tubes.points
    mid, ahead = geometry.cast(points[:, CENTRE], way[:, CENTRE], tubes.facet, flight.start[:, CENTRE])
    if last:
        # What counts is how the phase will run where the tube lands: two mirrors at right angles send it straight
        # back. Before more mirrors nobody knows. Where the centre meets nothing a body may still stand beside it.
        span, whole = np.empty((2, len(tubes)))
        ways = geometry.first, geometry.normal, out.image, out.far, rule.wavenumber
        ahead_of(*(tubes.points, way, tubes.length, mid, ahead, *ways, span, whole))
        matters = area > found.prune_threshold(whole) * (1.0 + 0.5 * span)
    else:
        matters = area > found.prune_threshold(whole)
    matters &= not found.budget.spent(geometry)
    # Beside a centre that meets nothing no corner is cast: the outline of a body there runs through the tube.
    hit, t = np.repeat(mid, 4).reshape(-1, 4), np.repeat(ahead, 4).reshape(-1, 4)
    agree = mid >= 0
    rows = np.flatnonzero(matters & agree)
    met, reach = geometry.cast(*corner_rays(rows, points, way, tubes.facet, flight.start))
    hit[rows, :3], t[rows, :3] = met.reshape(-1, 3), reach.reshape(-1, 3)
    agreeing(rows, hit, geometry.plane, geometry.smooth, geometry.normal, _ALIKE, agree)
    side = _edges(geometry, leg, tubes, points, way, hit, t, np.flatnonzero(matters))
    mixed = (~agree & (mid >= 0)) | side.any(axis=1)
    split = found.budget.affords(geometry, tubes.facet, mixed & matters & (flight.count[0] < rule.levels), _LIGHT)
    ready = np.flatnonzero(~split & (mid >= 0))
    landed.append(_land(geometry, leg, tubes, ready, way, hit, agree, flight.through, rule))
    parts, rows = divide(geometry, leg, tubes, np.flatnonzero(split), side, first, rule.jitter)
    start = flight.start[rows]
    start[:] = np.where(start > 0, start.max(axis=1, keepdims=True), 0.0)
    cut = _Flight(parts, start, flight.through[rows], flight.count[:, rows] + np.array([[1], [0]], np.int8))
    behind = ready[geometry.is_layer[mid[ready]] & (flight.count[1, ready] < rule.layers)]
    return _beyond(flight, behind, mid, t, cut) if len(behind) else cut


def _beyond(flight: _Flight, rows: Rows, mid: Ints, t: Floats, cut: _Flight) -> _Flight:
    """Return what was cut, and the tubes `rows` behind the thin layers `mid` (n,) that their rays met after t (n, 4)
    [m]."""
    start = np.where(np.isfinite(t[rows]), t[rows], t[rows, CENTRE, None]) + 1e-6
    through, count = flight.through[rows], flight.count[:, rows]
    through[np.arange(len(rows)), count[1]] = mid[rows]
    count[1] += 1
    return _Flight(
        Tubes.join([cut.tubes, flight.tubes.take(rows)]),
        np.concatenate([cut.start, start]),
        np.concatenate([cut.through, through]),
        np.concatenate([cut.count, count], axis=1),
    )


def _weigh(geometry: Geometry, out: Leg, tubes: Tubes, rule: Refinement) -> Floats:
    """Return what tubes could scatter over a way, all in phase or as their corners' phases run [1/m], and the length
    of the whole way [m] (3, n)."""
    weights = np.empty((3, len(tubes)))
    rays = tubes.points, tubes.k, tubes.length, tubes.normals, tubes.facet, tubes.strength, tubes.spread
    how = out.image, out.far, rule.wavenumber, geometry.dull, *geometry.matter

    def some(rows: slice) -> None:
        weigh(*(*(x[rows] for x in rays), *how, *weights[:, rows]))

    parallel_for(len(tubes), some, _MANY)
    return weights


def _edges(
    geometry: Geometry, leg: Leg, tubes: Tubes, points: Floats, way: Floats, hit: Ints, t: Floats, rows: Rows
) -> Floats:
    """Return the sides (n, 3) of an edge that runs through each of the tubes `rows`; zeros where none does."""
    flat = tubes.flat & ~geometry.curved[tubes.facet]
    side = np.zeros((len(tubes), 3))
    rays = points, way, tubes.length
    around = geometry.extent, geometry.plane, geometry.first_edge, geometry.outline, geometry.first, geometry.normal

    def some(part: slice) -> None:
        edges_within(*(rows[part], *rays, flat, leg.far, hit, t, *around, side))

    parallel_for(len(rows), some, _MANY)
    between(geometry).across(rows, *rays, leg.far, flat, hit, t, side)
    return side


def _land(
    geometry: Geometry,
    leg: Leg,
    tubes: Tubes,
    rows: Rows,
    way: Floats,
    hit: Ints,
    agree: Bools,
    through: Ints,
    rule: Refinement,
) -> Tubes:
    """Return the tubes `rows` put down on the planes of the facets that they hit, or of the centre's where these do not
    agree, their reflection written into the history."""
    rows, facet, reach = fates(rows, tubes.points, way, hit, agree, geometry.first, geometry.normal)
    n = len(rows)
    points, k, normals = np.empty((n, 4, 3)), np.empty((n, 4, 3)), np.empty((n, 4, 3))
    length, (spread, strength) = np.empty((n, 4)), np.empty((2, n))
    flat, caustics = np.empty(n, bool), np.empty_like(tubes.caustics, shape=n)
    rays = tubes.points, way, tubes.length, tubes.normals, tubes.facet, tubes.spread, tubes.strength, tubes.flat
    f = geometry.facets
    shape = f.vertices, f.normals, geometry.curved, leg.far, rule.wavenumber, *geometry.matter
    written = points, k, length, normals, spread, strength, flat, caustics

    def some(part: slice) -> None:
        there = rows[part], facet[part], reach[part]
        put_down(*(*there, *rays, tubes.caustics, *shape, *(x[part] for x in written)))

    parallel_for(n, some, _MANY)
    vertex, normal = tubes.points[rows, CENTRE], tubes.normals[rows, CENTRE]
    after = Tubes(
        points=points,
        k=k,
        length=length,
        normals=normals,
        facet=facet[:, CENTRE].copy(),
        spread=spread,
        strength=strength,
        flat=flat,
        bary=np.empty((n, 0, 3)),
        slots=tubes.slots[rows] + np.int8(1),
        bounces=tubes.bounces[rows] + np.int8(1),
        caustics=caustics,
        last=tubes.history.append(tubes.last[rows], vertex, normal, tubes.facet[rows], REFLECT),
        history=tubes.history,
    )
    passed = through[rows]
    if (passed >= 0).any():
        write_layers(geometry, after, vertex, k[:, CENTRE], passed, rule)
    return after
