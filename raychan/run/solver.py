"""Solve: a scene's facets and a radar become Paths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.channel.paths import RadarEnds, join, nothing, paths_of
from raychan.radar.beam_table import beam_of
from raychan.records import MIRROR, REFLECT, Facets, Paths, Points, Routes
from raychan.tracing.contributions import Contributions
from raychan.tracing.edge_diffraction import diffracted_paths
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import legs_over, reachable
from raychan.tracing.point_targets import point_routes
from raychan.tracing.shooting import tube_routes
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
_TUBES = (
    10_000_000  # that cuts for phase may come by: a quarter of a minute of one core; urban streets at 0.1 dB: a million
)
_CUTS, _CUTS_A_FACET = 40_000, 4  # for sight; urban streets at 0.1 dB take 13,000
Progress = Callable[[str, float], None]


@dataclass
class Stats:
    """What a solution cost and what it left out."""

    rays: int = 0
    tubes: int = 0
    legs: int = 0
    uncut: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """Tubes (bodies,) that were too many to be cut as finely as asked for."""
    seconds: dict[str, float] = field(default_factory=dict)

    def add(self, stage: str, since: float) -> None:
        """Add the time since `since` to a stage."""
        self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - since


def refinement(
    frequency: float,
    tolerance_db: float,
    floor: float = 0.0,
    layers: int = 2,
    jitter: float = 0.0,
    cell: float = np.inf,
) -> Refinement:
    """Return how finely tubes must be cut for a tolerance [dB].

    Args: floor [1/m] the scattered amplitude that drowns in noise; layers that a stretch may pass; jitter another
    lattice; cell [m] of two-way length that the radar tells apart. The constants are those at which two launches of the
    shapes in the tests differ by about half the tolerance; at half the noise a tube, cells 13 dB above it do: a coarser
    tolerance leaves no more than that, for what many tubes under a higher floor leave adds up to more than is stated.
    """
    fine = tolerance_db / 0.5
    return Refinement(
        wavenumber=2.0 * np.pi * frequency / C0,
        phase=min(0.2, 0.1 * fine),
        turn=min(0.3, 0.15 * fine),
        relative=min(0.15, 0.05 * fine),
        max_edge=0.3 * min(1.0, np.sqrt(fine)),
        floor=0.5 * floor * min(fine, 1.0),
        cell=cell,
        layers=layers,
        slots=8 + layers,
        jitter=jitter,
    )


def solve(facets: Facets | Geometry, *args: Any, **options: Any) -> tuple[Paths, Stats]:
    """Return the paths of a scene seen by a monostatic radar, and what they cost; args as for `solve_into` from
    `facets` on."""
    parts: list[Paths] = []
    stats = solve_into(parts.append, facets, *args, **options)
    return join(parts), stats


def solve_into(
    gather: Callable[[Paths], None],
    facets: Facets | Geometry,
    points: Points,
    radar: RadarEnds,
    frequency: float,
    rule: Refinement,
    bounces: int,
    progress: Progress | None = None,
    diffraction: bool = False,
    each: Callable[[Routes], None] | None = None,
) -> Stats:
    """Give the paths of a scene seen by a monostatic radar to `gather`, batch by batch, at least one; return what they
    cost.

    Args: facets, or the surface made of them, which serves many solutions;
    frequency [Hz] of the carrier phase; rule how finely tubes are cut; bounces: the most interactions,
    both ways counted; progress is told (stage, share done); diffraction adds single wedges on the ways to point
    targets; each is given every set of routes.
    """
    stats = Stats()
    since = perf_counter()
    geometry = facets if isinstance(facets, Geometry) else Geometry(facets)
    facets, before = geometry.facets, geometry.rays
    stats.add("build", since)
    legs = legs_over(geometry, np.asarray(radar.position, float), bounces - 1, beam_of(radar))
    stats.legs = len(legs)
    gather(nothing(facets, radar))

    def carry(routes: Routes) -> None:
        gather(paths_of(routes, facets, radar, frequency))
        if each:
            each(routes)

    since = perf_counter()
    found = point_routes(geometry, points, legs, legs, bounces, rule.slots, rule.layers)
    if found is not None:
        carry(found)
    if diffraction:
        for paths in diffracted_paths(geometry, points, radar, frequency, rule.slots, legs):
            gather(paths)
    found = _foot_points(geometry, legs, rule)
    if found is not None:
        carry(found)
    stats.add("points", since)
    cuts = _CUTS + _CUTS_A_FACET * len(facets.vertices)
    so_far = Contributions(replace(rule.for_depth(bounces), max_tubes=min(rule.max_tubes, _TUBES), max_cuts=cuts))
    for i, leg in enumerate(legs):
        if progress:
            progress("trace", i / len(legs))
        pieces = reachable(geometry, leg)
        if not pieces.any():
            continue
        since = perf_counter()
        for routes in tube_routes(geometry, leg, legs, pieces, rule, bounces, so_far):
            stats.add("trace", since)
            since = perf_counter()
            stats.tubes += len(routes.kind)
            carry(routes)
            stats.add("fields", since)
            since = perf_counter()
        stats.add("trace", since)
    stats.rays, stats.uncut = geometry.rays - before, so_far.uncut
    if progress:
        progress("trace", 1.0)
    return stats


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
    length = np.array([2.0 * h for _, _, h in rows])
    return Routes(
        tx=legs[0].end,
        rx=legs[0].end,
        far=False,
        vertices=vertices,
        normals=normals,
        facet=facet,
        body=body,
        kind=kind,
        scatter=np.full(n, -1, np.int8),
        points=np.zeros((n, 6, 3)),
        lengths=np.repeat(length[:, None], 6, axis=1),
        length=length,
        taper=np.ones((n, 3)),
        area=np.zeros(n),
        spread_in=1.0 / length,
        spread_out=np.ones(n),
        caustics=np.zeros(n, np.int8),
        sigma=np.zeros(n),
    )
