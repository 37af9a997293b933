"""The rays of a reflection: what tubes meet, and which of them are to be subdivided (numba kernels)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.geometry.intersect import first_hit
from raychan.records import MIRROR
from raychan.tracing.bounce_records import Met
from raychan.tracing.edge_crossings import TubeRays, edge_within
from raychan.tracing.resolve_hits import (
    contribution_bound,
    corner_origin,
    growth_at_hit,
    on_one_surface,
    phase_at_hit,
    reflect_directions,
)
from raychan.tracing.silhouette_crossings import longest_crossing
from raychan.tracing.visibility import project_to_facets
from raychan.vectors import row

_WIDE = 0.05  # rad between the centre ray and a corner's; silhouettes clip narrower fans; not measured


@njit(cache=True, nogil=True)
def room_for(flight, world, how):  # type: ignore[no-untyped-def]
    """Return room for what the rays of a flight meet."""
    tubes = flight.tubes
    n, points = len(tubes.facet), tubes.points
    if how.first:
        points = project_to_facets(points, tubes.facet, tubes.bary, world.curved, world.shapes.vertices)
    flat, hit, reach = np.empty(n, np.bool_), np.empty((n, 4), np.int32), np.empty((n, 4))
    rays = TubeRays(points, np.empty((n, 4, 3)), tubes.length, flat, hit, reach)
    return Met(rays, np.zeros((n, 3)), np.empty(n, np.bool_), np.empty(n, np.bool_))


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def _first_hit(x, d, skip, start, groups, shapes, floats, words):  # type: ignore[no-untyped-def]
    """Return what `first_hit` does. Not for speed, but so that its code is there once."""
    return first_hit(x, d, skip, start, groups, shapes, floats, words)


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _cast(i, q, x, flight, met, world, packet):  # type: ignore[no-untyped-def]
    """Cast ray q of tube i from x (3,); write what it meets, and return how often it was cast."""
    d = row(met.rays.directions[i], q)
    skip, start = flight.tubes.facet[i], flight.start[i, q]
    found, distance, casts = _first_hit(x, d, skip, start, world.groups, world.shapes, packet[0], packet[1])
    met.rays.hit[i, q], met.rays.reach[i, q] = found, distance
    return casts


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def cast_centres(begin, end, flight, met, world, packet):  # type: ignore[no-untyped-def]
    """Reflect the tubes from `begin` to `end` and cast their centre rays; return how many rays were cast."""
    tubes, casts = flight.tubes, 0
    for i in range(begin, end):
        reflect_directions(tubes.k[i], tubes.normals[i], met.rays.directions[i])
        met.rays.flat[i] = tubes.flat[i] and not world.curved[tubes.facet[i]]
        casts += _cast(i, 3, row(met.rays.points[i], 3), flight, met, world, packet)
    return casts


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def cast_corners(begin, end, matter, tag, flight, met, world, how, packet, tested, room, landed):  # type: ignore[no-untyped-def]
    """Cast the corner rays of the tubes from `begin` to `end` whose centre rays were cast, where they matter, and write
    which tubes are to be subdivided; return how many rays were cast.

    Args: matter whether any may; tag, tested as for `longest_crossing`, the tag of tube 0; room (9, 3), landed (4,).
    """
    rays, casts = met.rays, 0
    for i in range(begin, end):
        hit, side, wide = rays.hit[i], met.side[i], False
        mid = hit[3]
        one_surface, any_hit = mid >= 0, mid >= 0
        for q in range(3):
            hit[q], rays.reach[i, q] = mid, rays.reach[i, 3]
        matters = matter and _matters(i, flight.tubes, rays, world, how, room)
        if matters:
            # Where the centre ray meets nothing, but the fan is wide, a corner may meet something.
            if mid >= 0 or (not rays.flat[i] and how.wide and _is_wide(rays.directions[i])):
                for q in range(3):
                    casts += _cast(i, q, corner_origin(rays.points[i], q), flight, met, world, packet)
                    any_hit = any_hit or hit[q] >= 0
                one_surface = on_one_surface(hit, world.plane, world.smooth, world.shapes.normal, how.patch)
            outlines, far = world.outlines, how.patches.far
            edge_within(
                i, rays, far, outlines.extent, outlines.planes, world.first_edge, world.plane_edges, side, room, landed
            )
            if side[0] == 0.0 and side[1] == 0.0 and side[2] == 0.0:
                # What stands where a tube is too wide to be searched shows once it is bisected.
                wide = longest_crossing(i, tag + i, rays, far, outlines, side, tested, room)
        met.one_surface[i] = one_surface
        mixed = (not one_surface and any_hit) or side[0] != 0.0 or side[1] != 0.0 or side[2] != 0.0 or wide
        met.wanted[i] = mixed and matters and flight.cuts[i] < how.levels
    return casts


@njit(cache=True, forceinline=True, uncounted=True)
def _is_wide(directions):  # type: ignore[no-untyped-def]
    """Tell whether corner rays spread too far from the centre's for silhouettes to be found between them."""
    most = 0.0
    for q in range(3):
        off = 0.0
        for c in range(3):
            off += (directions[3, c] - directions[q, c]) ** 2
        most = max(most, math.sqrt(off))
    return most > _WIDE


@njit(cache=True, forceinline=True, uncounted=True)
def _in_cell(levels, length, cell):  # type: ignore[no-untyped-def]
    """Return the level (c,) of the cell of a length [m]."""
    return levels[min(int(max(length / cell, 0.0)), len(levels) - 1)]


@njit(cache=True, forceinline=True, error_model="numpy", uncounted=True)
def _matters(i, tubes, rays, world, how, room):  # type: ignore[no-untyped-def]
    """Tell whether tube i is worth subdividing: one that may contribute more than the prune threshold, or reflect more
    than counts at a specular point of a curved surface."""
    surface = world.lossy, world.material, world.materials
    points, directions, length = tubes.points[i], rays.directions[i], tubes.length[i]
    in_phase, _, whole = contribution_bound(i, tubes, how.image, how.far, how.wavenumber, surface)
    mid, ahead, flat = rays.hit[i, 3], rays.reach[i, 3], rays.flat[i]
    bent = mid >= 0 and (not flat or world.curved[mid])
    growth = growth_at_hit(points, directions, mid, ahead, room) if how.by_landing or bent else 1.0
    if how.by_landing:
        in_phase *= growth
    # Where the centre ray meets nothing, or the ground, from which tubes do not return, a body may stand beside it.
    if mid >= 0 and world.role[world.body[mid]] == MIRROR:
        mid = -1
    runs, span, there = 0.0, 0.0, whole
    if how.last or bent:
        first, normal, out = world.shapes.first, world.shapes.normal, (how.image, how.far)
        span, there = phase_at_hit(points, directions, length, mid, ahead, first, normal, out, how.wavenumber, room[0])
    if how.last:
        # What counts is how the phase runs where the tube lands: two mirrors at right angles send it straight back. But
        # beside where the centre ray lands it may run slowly, and there tubes along an edge err alike.
        runs, whole = (0.0 if how.by_landing and flat else span), there
    if in_phase > _in_cell(how.thresholds, whole, how.cell) * (1.0 + 0.5 * runs):
        return True
    if not bent or mid < 0:
        return False
    # Over curved surfaces the tube may hold a specular point, where the phase is stationary. Of a phase that is
    # quadratic in one direction a share of (pi / (4 S))^(1/2) is left, of a linear one 2 / S, for a span of S.
    most = in_phase if how.by_landing else growth * in_phase
    return most > _in_cell(how.specular, there, how.cell) * math.sqrt(1.0 + 4.0 / math.pi * span)
