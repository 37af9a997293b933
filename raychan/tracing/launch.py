"""Launch: tubes seeded from the facets that face the transmitter, cut until phase and sight are simple on each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.curved_patches import edge_to_cut, halved
from raychan.geometry.lit_parts import lit_parts
from raychan.records import REFLECT, SCATTERER, TRANSMIT
from raychan.tracing.beyond_horizon import outlets
from raychan.tracing.contributions import Contributions
from raychan.tracing.culling import seed_facets
from raychan.tracing.edge_crossings import meeting_lines
from raychan.tracing.horizon import OBLIQUE
from raychan.tracing.legs import Leg, View
from raychan.tracing.shadow_edges import shadow_edges_of
from raychan.tracing.subdivide import divide
from raychan.tracing.tubes import (
    CENTRE,
    MOST_BEND,
    Refinement,
    Tubes,
    phases_of,
    stand,
    unit,
)
from raychan.tracing.visibility import aims, partly_seen, put_down, read_rays
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_BATCH = 1 << 17  # tubes launched at once: few scenes have more on one leg
RUNNING = 0.1  # of what tubes that do not face an end would add up to in phase: about what they do
GAPS = 1  # cuts of a hidden tube in search of a part that is seen


def launch(
    geometry: Geometry, leg: Leg, out: Leg, pieces: Bools, found: Contributions, more: bool, others: list[Leg]
) -> Iterator[Tubes]:
    """Yield the tubes of first bounces seen over `leg`, fine enough for a return over `out`, in batches.

    Args: pieces (p,) which may carry a first bounce; those of the leg's own mirrors never do; found what was so far;
    more whether the tubes will bounce again; others by which they may leave too.
    """
    f = geometry.facets
    shape = f.vertices, f.normals, geometry.edge_curvature
    ways = leg.image, leg.far, out.image, out.far
    allowed = pieces & (geometry.piece_role == SCATTERER)
    allowed[leg.pieces(geometry)] = False
    facet = seed_facets(geometry, leg, allowed)
    for part, bary in _cut_for_phase(geometry, facet, shape, ways, found, not more):
        part, bary = lit_parts(part, bary, *shape, geometry.both_sides, leg.image, leg.far)
        tubes = stand(geometry, leg, part, bary)
        if leg.mirrors:
            tubes = _returning(geometry, leg, out, others, tubes, found)
        yield _cut_for_sight(geometry, leg, out, tubes, found, more)


def _returning(geometry: Geometry, leg: Leg, out: Leg, others: list[Leg], tubes: Tubes, found: Contributions) -> Tubes:
    """Return the tubes that face the end of `out`, and of the rest what counts over it or one of the others."""
    _, facing = out.radiating(tubes.points, tubes.k, tubes.normals, OBLIQUE)
    away = np.flatnonzero(~facing)
    some, best, length = tubes.take(away), np.zeros(len(away)), np.zeros(len(away))
    for other in [out, *others] if len(away) else []:
        share, _ = other.radiating(some.points, some.k, some.normals, OBLIQUE)
        ph = phases_of(geometry, leg, other, some, found.rule)
        better = ph.bound * share > best
        best[better], length[better] = (ph.bound * share)[better], ph.length[better]
    keep = facing.copy()
    keep[away[found.that_count(RUNNING * best, length, 0)]] = True
    return tubes.take(keep)


def _cut_for_phase(
    geometry: Geometry, facet: Ints, shape: Any, ways: Any, found: Contributions, across: bool
) -> Iterator[tuple[Ints, Floats]]:
    """Cut along the edge on which the two-way phase bends most, until it is quadratic enough or no longer counts; yield
    facets and corners of the parts in batches, so that memory does not grow with their number.

    Args: across whether only an edge's length across the rays counts: tubes that bounce again are needed as short.
    """
    rule = found.rule
    limits = rule.wavenumber, rule.phase, rule.turn, rule.max_edge, MOST_BEND, across
    left = [(facet, np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy(), 0)]
    done: list[tuple[Ints, Floats]] = []
    held = 0
    while left:
        facet, bary, level = left.pop()
        if len(facet) > _BATCH:
            half = len(facet) // 2
            left += [(facet[half:].copy(), bary[half:].copy(), level), (facet[:half], bary[:half], level)]
            continue
        edge = edge_to_cut(facet, bary, *(*shape, *ways, *limits))
        more = found.budget.affords_phase(geometry, facet, edge >= 0)
        ready = ~more
        if held + np.count_nonzero(ready) > _BATCH:
            yield _joined(done)
            done, held = [], 0
        done.append((facet[ready], bary[ready]))
        held += len(done[-1][0])
        if more.any():
            left.append((*halved(facet[more], bary[more], edge[more], rule.jitter, level), level + 1))
    if held:
        yield _joined(done)


def _joined(parts: list[tuple[Ints, Floats]]) -> tuple[Ints, Floats]:
    return np.concatenate([f for f, _ in parts]), np.concatenate([b for _, b in parts])


def _cut_for_sight(geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, found: Contributions, more: bool) -> Tubes:
    """Keep what is seen; cut the tubes of which only some rays are seen, while they matter."""
    kept: list[Tubes] = []
    rule = found.rule

    def keep(view: View, ready: Bools) -> None:
        kept.append(tubes.take(ready))
        _write_leg(geometry, kept[-1], leg, view.corners[ready], view.passed[ready], rule)

    ph = phases_of(geometry, leg, out, tubes, rule)
    # What returns little by itself may still carry the next bounces.
    rows = found.that_count(ph.area if more else ph.bound, ph.length)
    if len(rows) < len(tubes):
        tubes, ph = tubes.take(rows), ph.take(rows)
    # First by the centre rays alone: what nobody sees must not count, and the strongest lit surface may stand behind
    # a wall.
    view = centres(geometry, leg, tubes, True, rule)
    found.add(ph.take(view.seen))
    ready = geometry.convex_alone or found.budget.spent(geometry)
    matters = (ph.bound > found.prune_threshold(ph.length)) & (not ready)
    keep(view, view.seen & ~matters)
    known: View | None = view.take(matters)
    tubes, matters = tubes.take(matters), matters[matters]
    for level in range(rule.levels + 1):
        if not len(tubes):
            break
        s = sight(geometry, leg, tubes, matters, True, rule, level < GAPS, known)
        split = found.budget.affords(geometry, tubes.facet, s.mixed & matters & (level < rule.levels))
        keep(s.centre, ~split & s.centre.seen)
        rows = np.flatnonzero(split)
        tubes, _ = divide(geometry, leg, tubes, rows, s.side, True, rule.jitter)
        ph = phases_of(geometry, leg, out, tubes, rule)
        known, matters = None, ph.bound > found.prune_threshold(ph.length)
    return Tubes.join(kept)


@dataclass(frozen=True)
class Sight:
    """How tubes are seen over a leg: by their centre rays (a `View`), by `some` (n,) ray, `mixed` (n,) in part; `side`
    (n, 3): where a shadow's edge runs through a tube, zeros where none is known."""

    centre: View
    some: Bools
    mixed: Bools
    side: Floats


def centres(geometry: Geometry, leg: Leg, tubes: Tubes, first: bool, rule: Refinement) -> View:
    """Return how the centres of tubes are seen over a leg; first whether these stand on their first surface."""
    points = on_facets(geometry, tubes) if first else tubes.points
    shape = geometry.first, geometry.normal, leg.image, leg.far
    aim, target, near, _ = aims(points, tubes.points, tubes.facet, *shape, True, np.zeros(len(tubes), bool))
    return leg.visible(geometry, aim, target, near, rule.layers)


def sight(
    geometry: Geometry,
    leg: Leg,
    tubes: Tubes,
    matters: Bools,
    first: bool,
    rule: Refinement,
    gaps: bool = True,
    centre: View | None = None,
    beyond: Bools | None = None,
) -> Sight:
    """Return how tubes are seen over a leg; by the centre ray alone where cutting would not matter.

    Args: first whether they stand on their first surface; gaps whether to look for one through which a tube is seen
    that none of its rays is; centre how their centres are seen, cast if not given; beyond (n,) tubes that face away,
    which their own body does not hide.
    """
    n = len(tubes)
    points = on_facets(geometry, tubes) if first else tubes.points
    where = tubes.facet, geometry.first, geometry.normal, leg.image, leg.far
    corners = np.zeros(n, bool) if geometry.convex_alone else matters
    aim, target, near, slack = aims(points, tubes.points, *where, centre is None, corners)
    if beyond is not None:
        rows = np.concatenate([np.arange(n if centre is None else 0), np.repeat(np.flatnonzero(corners), 3)])
        rows = np.flatnonzero(beyond[rows])
        if not geometry.hides_nothing:
            aim[rows], target[rows] = outlets(geometry, leg, aim[rows], target[rows])
    view = leg.visible(geometry, aim, target, near, rule.layers)
    if geometry.hides_nothing and beyond is not None:
        view.seen[rows] = True
    if centre is None:
        centre, view = view.take(slice(n)), view.take(slice(n, None))
    rays = view.seen, view.blocker, centre.seen, centre.blocker, corners
    some, mixed, look = read_rays(*rays, matters, gaps, geometry.smooth)
    if beyond is not None:
        look &= ~beyond
    side = np.zeros((n, 3))
    rows, points, met, planes, source, back, own = partly_seen(
        look, points, tubes.facet, *rays, geometry.plane, leg.image, leg.far
    )
    if len(rows):
        found = shadow_edges_of(geometry, leg).across(points, tubes.facet[rows], slack[rows])
        # Where a body runs into this one, the shadow ends on the line in which the two planes meet.
        meeting_lines(points, source, back, leg.far, planes, met, geometry.first, geometry.normal, own, found)
        side[rows] = found
        mixed[rows] |= (found != 0.0).any(axis=1)
    return Sight(centre, some, mixed, side)


def on_facets(geometry: Geometry, tubes: Tubes) -> Floats:
    """Return the points (n, 4, 3) [m] of tubes on their first surface, put down on the flat facets that rays meet."""
    if not geometry.curved[tubes.facet].any():
        return tubes.points
    found: Floats = put_down(tubes.points, tubes.facet, tubes.bary, geometry.curved, geometry.facets.vertices)
    return found


def _write_leg(geometry: Geometry, tubes: Tubes, leg: Leg, corners: Floats, passed: Ints, rule: Refinement) -> None:
    """Write the leg's mirrors and the layers passed into the tubes' history."""
    every = np.arange(len(tubes))
    for i, m in enumerate(leg.mirrors):
        facet = np.full(len(tubes), m.facet, np.int32)
        tubes.append(every, corners[:, i], m.normal, facet, REFLECT)
        before = corners[:, i - 1] if i else leg.end
        d = unit(corners[:, i] - before)
        tubes.strength = tubes.strength * geometry.strength(facet, np.abs(d @ m.normal), rule.wavenumber)
    write_layers(geometry, tubes, tubes.points[:, CENTRE], tubes.k[:, CENTRE], passed, rule)


def write_layers(geometry: Geometry, tubes: Tubes, point: Floats, k: Floats, passed: Ints, rule: Refinement) -> None:
    """Write the layers (n, l) that the rays through `point` (n, 3) along k (n, 3) passed into the history."""
    for j in range(passed.shape[1]):
        rows = np.flatnonzero(passed[:, j] >= 0)
        facet = passed[rows, j]
        t = geometry.distance(facet, point[rows], k[rows])
        tubes.append(rows, point[rows] + t[:, None] * k[rows], geometry.normal[facet], facet, TRANSMIT)
        cosine = np.abs(np.einsum("ij,ij->i", geometry.normal[facet], k[rows]))
        tubes.strength[rows] *= geometry.strength(facet, cosine, rule.wavenumber, passing=True)
