"""One launch: the routes of a scene from a radar and back, over every leg."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR, REFLECT, TRANSMIT, DiffractedRoutes, Points, Routes
from raychan.tracing.contributions import Contributions
from raychan.tracing.legs import Leg, legs_over, reachable
from raychan.tracing.point_targets import diffracted_routes, point_routes
from raychan.tracing.routes import Interactions, ray_routes
from raychan.tracing.settings import PruneRule
from raychan.tracing.shooting import tube_routes
from raychan.tracing.tubes import Refinement
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Progress = Callable[[str, float], None]

# A launch beyond these limits cuts no more and says so.
_TUBES = 10_000_000  # cut for phase: a quarter of a minute of one core; urban streets at 0.1 dB take a million
_CUTS, _CUTS_A_FACET = 40_000, 4  # cuts for visibility; urban streets at 0.1 dB take 13,000


@dataclass
class Stats:
    """What a launch cost and what it left coarser than asked for."""

    rays: int = 0
    tubes: int = 0
    legs: int = 0
    uncut: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """Tubes (bodies,) that were too many to be cut as finely as asked for."""


def launch_routes(
    geometry: Geometry, points: Points, rule: PruneRule, stats: Stats, progress: Progress | None = None
) -> Iterator[Routes | DiffractedRoutes]:
    """Yield the routes of a scene from transmitter to receiver, batch by batch.

    Args: geometry, which serves many launches; points the targets given by their RCS; rule what may be left out; stats
    is filled; progress is told ("trace", share done).
    """
    refined, bounces, before = rule.refinement, rule.bounces, geometry.rays
    legs = legs_over(geometry, np.asarray(rule.position, float), bounces - 1, rule.beam)
    outs = legs if rule.rx is None else legs_over(geometry, np.asarray(rule.rx, float), bounces - 1, rule.beam)
    stats.legs = len(legs)
    found = point_routes(geometry, points, legs, outs, bounces, refined.slots, refined.layers)
    if found is not None:
        yield found
    if rule.diffraction and rule.rx is not None:
        raise ValueError(
            "diffraction is modelled for a receiver beside the transmitter only: model.diffraction = false"
        )
    if rule.diffraction:
        over = diffracted_routes(geometry, points, legs[0].end, refined.wavenumber, refined.slots)
        if over is not None:
            yield over
    if rule.rx is None:
        found = _foot_points(geometry, legs, refined)
    else:
        found = _direct_routes(geometry, legs, outs[0].end, refined.slots, refined.layers)
    if found is not None:
        yield found
    cuts = _CUTS + _CUTS_A_FACET * len(geometry.facets.vertices)
    limited = replace(
        refined.for_depth(bounces), max_tubes=min(refined.max_tubes, _TUBES), max_cuts=min(refined.max_cuts, cuts)
    )
    # Every leg is pruned against what the direct leg has found, and itself: the order of the others does not matter.
    direct = Contributions(limited)
    for i, leg in enumerate(legs):
        if progress:
            progress("trace", i / len(legs))
        pieces = reachable(geometry, leg)
        if not pieces.any():
            continue
        so_far = direct if i == 0 else direct.forked()
        for routes in tube_routes(geometry, leg, outs, pieces, refined, bounces, so_far, ins=legs):
            stats.tubes += len(routes.kind)
            yield routes
    stats.rays, stats.uncut = geometry.rays - before, direct.budget.uncut
    if progress:
        progress("trace", 1.0)


def _foot_points(geometry: Geometry, legs: list[Leg], rule: Refinement) -> Routes | None:
    """Return the exact routes to the ground's foot points and back: a plane mirror too large for tubes."""
    f = geometry.facets
    rows = []
    for leg in legs:
        if len(leg.mirrors) != 1 or f.role[leg.mirrors[0].body] != MIRROR:
            continue
        m = leg.mirrors[0]
        height = float((leg.end - m.point) @ m.normal)
        foot = leg.end - height * m.normal
        hit, _ = geometry.cast(leg.end[None], -m.normal[None], np.array([-1], np.int32))
        if hit[0] >= 0 and geometry.plane[hit[0]] == geometry.plane[m.facet]:
            rows.append((foot, m, height))
    if not rows:
        return None
    n, d = len(rows), rule.slots
    vertices = np.broadcast_to(legs[0].end, (n, d, 3)).copy()
    normals, facet = np.zeros((n, d, 3)), np.full((n, d), -1, np.int32)
    kind, body = np.zeros((n, d), np.int8), np.full((n, d), -1, np.int16)
    for i, (foot, m, _) in enumerate(rows):
        vertices[i, 0], normals[i, 0], facet[i, 0], kind[i, 0], body[i, 0] = foot, m.normal, m.facet, REFLECT, m.body
    length = np.array([2.0 * height for _, _, height in rows])
    return ray_routes(legs[0].end, legs[0].end, Interactions(vertices, normals, facet, body, kind), length)


def _direct_routes(geometry: Geometry, legs: list[Leg], rx: Floats, slots: int, layers: int) -> Routes | None:
    """Return the exact routes to a receiver elsewhere, at rx (3,) [m], over legs whose mirrors only reflect: line of
    sight, and over the ground; None if there is none.

    Other surfaces reflect by their tubes. Args: slots for interactions; layers that the last stretch may pass.
    """
    body_role, rows = geometry.facets.role, []
    for leg in legs:
        if any(body_role[m.body] != MIRROR for m in leg.mirrors) or not leg.may_reach(rx[None], np.zeros(1))[0]:
            continue
        view = leg.visible(geometry, rx[None], np.array([-1], np.int32), np.full(1, 1e-6), layers)
        if not view.seen[0]:
            continue
        heading, length = leg.rays(rx[None])
        stops = [(spot, m.normal, m.facet, REFLECT) for spot, m in zip(view.corners[0], leg.mirrors, strict=True)]
        start = view.corners[0, -1] if leg.mirrors else leg.end
        through = []
        for facet in view.passed[0][view.passed[0] >= 0]:
            t = geometry.distance(np.array([facet]), start[None], heading)[0]
            through.append((float(t), (start + t * heading[0], geometry.normal[facet], int(facet), TRANSMIT)))
        stops += [stop for _, stop in sorted(through, key=lambda pair: pair[0])]
        rows.append((float(length[0]), stops))
    if not rows:
        return None
    n = len(rows)
    vertices, normals = np.broadcast_to(rx, (n, slots, 3)).copy(), np.zeros((n, slots, 3))
    facet, kind = np.full((n, slots), -1, np.int32), np.zeros((n, slots), np.int8)
    for i, (_, stops) in enumerate(rows):
        for j, stop in enumerate(stops):
            vertices[i, j], normals[i, j], facet[i, j], kind[i, j] = stop
    body = geometry.facets.body[np.maximum(facet, 0)] if len(geometry.facets.body) else facet
    length = np.array([r[0] for r in rows])
    met = Interactions(vertices, normals, facet, np.where(facet >= 0, body, -1).astype(np.int16), kind)
    return ray_routes(legs[0].end, rx, met, length)
