"""Trace and transfer in one: each batch of routes becomes paths at once, so that memory holds few."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from raychan.channel.ends import RadarEnds
from raychan.channel.paths import join, nothing, paths_of
from raychan.radar.beam_table import beam_of
from raychan.records import DiffractedRoutes, Facets, Paths, Points, Routes
from raychan.tracing.point_targets import diffracted_routes
from raychan.tracing.settings import PruneRule
from raychan.tracing.solver import Progress, launch_routes
from raychan.tracing.stats import Stats
from raychan.tracing.tubes import Refinement
from raychan.units import C0
from raychan.world.geometry import Geometry

Batch = Routes | DiffractedRoutes
_SLOTS = 3  # interactions on a path over wedges: edge, target, edge


def solve(
    facets: Facets | Geometry,
    points: Points,
    radar: RadarEnds,
    frequency: float,
    refinement: Refinement,
    bounces: int,
    diffraction: bool = False,
) -> tuple[Paths, Stats]:
    """Return the paths of one launch from a radar to its receivers, and what they cost.

    Args: facets, or the geometry made of them, which serves many launches; points the targets given by their RCS;
    frequency [Hz] of the carrier phase; refinement how finely tubes are cut; bounces the most interactions, both legs
    counted; diffraction over single wedges on the legs to point targets.
    """
    geometry = facets if isinstance(facets, Geometry) else Geometry(facets)
    there = getattr(radar, "rx_position", None)
    rule = PruneRule(np.asarray(radar.position, float), beam_of(radar), refinement, bounces, 0.0, diffraction, there)
    parts: list[Paths] = []
    stats = solve_into(parts.append, geometry, points, radar, frequency, rule)
    return join(parts), stats


def solve_into(
    gather: Callable[[Paths], Any],
    geometry: Geometry,
    points: Points,
    radar: RadarEnds,
    frequency: float,
    rule: PruneRule,
    progress: Progress | None = None,
    keep: Callable[[Batch], Any] | None = None,
) -> Stats:
    """Give the paths of one launch to `gather`, batch by batch, at least one; return what they cost.

    Args as for `solve`; progress is told (stage, share done); keep is given every batch of routes.
    """
    stats = Stats()
    gather(nothing(geometry.facets, radar))
    for routes in launch_routes(geometry, points, rule, stats, progress):
        gather(paths_of(routes, geometry.facets, radar, frequency))
        if keep:
            keep(routes)
    return stats


def paths_over_wedges(geometry: Geometry, points: Points, radar: RadarEnds, frequency: float) -> Paths:
    """Return the paths to targets given by their RCS over at least one wedge, none where there is no such path."""
    end, k = np.asarray(radar.position, float), 2.0 * np.pi * frequency / C0
    routes = diffracted_routes(geometry, points, end, k, _SLOTS)
    if routes is None:
        return nothing(geometry.facets, radar)
    return paths_of(routes, geometry.facets, radar, frequency)
