"""Tubes that land after a reflection, and the parts of those that were subdivided, which go on (numba kernels)."""

from __future__ import annotations

import math

import numpy as np

from raychan.compile.jit import njit
from raychan.tracing.bounce_records import Flight, Landed
from raychan.tracing.contributions import BEGUN, CUTS, RAYS
from raychan.tracing.resolve_hits import IncidentTubes, LandedTubes, ReflectingFacets, resolve_hits, tubes_at_hits
from raychan.tracing.subdivide import parts_and_parents
from raychan.tracing.tube_rows import copy_tubes, room_for_tubes
from raychan.tracing.tubes import CENTRE
from raychan.vectors import copy_to

_BUDGET_SHARE = 0.1  # of a cut for visibility: what a cut between bounces takes of the budget; not measured
_PAST_LAYER = 1e-6  # m behind a layer from which on hits count


@njit(cache=True, uncounted=True)
def is_spent(account, how):  # type: ignore[no-untyped-def]
    """Tell whether the budgets for visibility are spent (see `contributions.Budget`)."""
    if account[BEGUN] < 0.0:
        account[BEGUN] = account[RAYS]
    return account[CUTS] > how.max_cuts or account[RAYS] - account[BEGUN] > how.max_rays


@njit(cache=True, nogil=True, error_model="numpy", uncounted=True)
def keep_to_budget(wanted, facet, body, how, account, uncut):  # type: ignore[no-untyped-def]
    """Leave of the tubes `wanted` (n,) on facets (n,) those that the budget affords, and count the others by their
    bodies, `uncut` (b,)."""
    rest = 0.0 if is_spent(account, how) else (how.max_cuts - account[CUTS]) / _BUDGET_SHARE
    count = 0
    for i in range(len(wanted)):
        if wanted[i]:
            count += 1
            if count > rest:
                wanted[i] = False
                uncut[body[facet[i]]] += 1
    account[CUTS] += _BUDGET_SHARE * count


@njit(cache=True, nogil=True, error_model="numpy")
def land(flight, met, landed, count, world, how):  # type: ignore[no-untyped-def]
    """Return the tubes `landed`, of which `count` are in use, with those of a flight that are not to be subdivided, on
    the planes of the facets that their rays meet, or of the facet that the centre ray meets where these are not of one
    surface; how many are in use then; and of which tubes (m,) the centre rays met something."""
    tubes, rays = flight.tubes, met.rays
    ready = _ready(met)
    shapes, curvature, curved = world.shapes, how.patches.edge_curvature, world.curved
    rows, facet, reach = resolve_hits(
        ready, tubes.points, rays.directions, rays.hit, rays.reach, met.one_surface, shapes.first, shapes.normal,
        (shapes.vertices, curvature, curved),
    )  # fmt: skip
    end = count + len(rows)
    if end > len(landed.left):
        landed = _grown(landed, count, max(end, 2 * len(landed.left)))
    out = landed.tubes
    before = IncidentTubes(
        tubes.points, rays.directions, tubes.length, tubes.normals, tubes.facet, tubes.spread, tubes.strength,
        tubes.flat, tubes.caustics,
    )  # fmt: skip
    after = LandedTubes(
        out.points[count:end], out.k[count:end], out.length[count:end], out.normals[count:end], out.spread[count:end],
        out.strength[count:end], out.flat[count:end], out.caustics[count:end],
    )  # fmt: skip
    facets = ReflectingFacets(shapes.vertices, how.patches.normals, curved, world.material, world.materials)
    tubes_at_hits(rows, facet, reach, before, facets, how.patches.far, how.wavenumber, after)
    _where_they_left(rows, facet, flight, landed, count)
    return landed, end, ready


@njit(cache=True, nogil=True)
def _grown(landed, count, size):  # type: ignore[no-untyped-def]
    """Return room for `size` landed tubes, with the first `count`."""
    through = np.empty((size, landed.through.shape[1]), np.int32)
    out = Landed(
        room_for_tubes(size, False), np.empty((size, 3)), np.empty((size, 3)), np.empty(size, np.int32), through
    )
    copy_tubes(landed.tubes, np.arange(count), out.tubes, 0)
    _copy_each(landed, count, out)
    return out


@njit(cache=True, nogil=True, uncounted=True)
def _copy_each(landed, count, out):  # type: ignore[no-untyped-def]
    """Write the columns of the first `count` landed tubes that are not of `TubeColumns`."""
    for i in range(count):
        out.left[i] = landed.left[i]
        copy_to(out.vertex[i], landed.vertex[i])
        copy_to(out.normal[i], landed.normal[i])
        copy_to(out.through[i], landed.through[i])


@njit(cache=True, nogil=True)
def _ready(met):  # type: ignore[no-untyped-def]
    """Return the tubes (m,) whose centre rays met something, but for those that are to be subdivided."""
    out, count = np.empty(len(met.wanted), np.int64), 0
    for i in range(len(out)):
        if not met.wanted[i] and met.rays.hit[i, 3] >= 0:
            out[count] = i
            count += 1
    return out[:count]


@njit(cache=True, nogil=True, uncounted=True)
def _where_they_left(rows, facet, flight, landed, count):  # type: ignore[no-untyped-def]
    """Write, from `count` on, the columns of landed tubes that `tubes_at_hits` does not write; facet (m, 4) where the
    tubes `rows` (m,) land."""
    tubes, out = flight.tubes, landed.tubes
    for j in range(len(rows)):
        i, at = rows[j], count + j
        out.facet[at], out.last[at] = facet[j, 3], tubes.last[i]
        out.slots[at], out.bounces[at] = tubes.slots[i] + 1, tubes.bounces[i] + 1
        landed.left[at] = tubes.facet[i]
        copy_to(landed.vertex[at], tubes.points[i, CENTRE])
        copy_to(landed.normal[at], tubes.normals[i, CENTRE])
        copy_to(landed.through[at], flight.through[i])


@njit(cache=True, nogil=True, error_model="numpy")
def going_on(flight, met, ready, world, how):  # type: ignore[no-untyped-def]
    """Return the parts of tubes that are subdivided, and then those of the tubes `ready` (m,) that go on behind thin
    layers, as a flight."""
    tubes = flight.tubes
    split, count = np.empty(len(met.wanted), np.int64), 0
    for i in range(len(split)):
        if met.wanted[i]:
            split[count] = i
            count += 1
    split = split[:count]
    parts, parent, kept = parts_and_parents(tubes, split, met.side, how.patches, how.first, how.jitter)
    behind, count = np.empty(len(ready), np.int64), 0
    for i in ready:
        if world.is_layer[met.rays.hit[i, 3]] and flight.passed[i] < how.layers:
            behind[count] = i
            count += 1
    behind = behind[:count]
    n = len(kept) + count
    onward = Flight(
        room_for_tubes(n, how.first),
        np.empty((n, 4)),
        np.empty((n, how.layers), np.int32),
        np.empty(n, np.int8),
        np.empty(n, np.int8),
    )
    copy_tubes(parts, kept, onward.tubes, 0)
    copy_tubes(tubes, behind, onward.tubes, len(kept))
    _each_going_on(flight, parent, kept, behind, met.rays, onward)
    return onward


@njit(cache=True, nogil=True, uncounted=True)
def _each_going_on(flight, parent, kept, behind, rays, onward):  # type: ignore[no-untyped-def]
    """Write the columns of a flight that are not of its tubes: of the parts `kept` (k,) of parents, then of tubes
    `behind` (m,) layers."""
    for j in range(len(kept)):
        i = parent[kept[j]]
        start = flight.start[i]
        most = max(max(start[0], start[1]), max(start[2], start[3]))
        for q in range(4):
            onward.start[j, q] = most if start[q] > 0.0 else 0.0
        copy_to(onward.through[j], flight.through[i])
        onward.cuts[j], onward.passed[j] = flight.cuts[i] + 1, flight.passed[i]
    for j in range(len(behind)):
        i, at = behind[j], len(kept) + j
        for q in range(4):
            reach = rays.reach[i, q]
            onward.start[at, q] = (reach if math.isfinite(reach) else rays.reach[i, 3]) + _PAST_LAYER
        copy_to(onward.through[at], flight.through[i])
        onward.through[at, flight.passed[i]] = rays.hit[i, 3]
        onward.cuts[at], onward.passed[at] = flight.cuts[i], flight.passed[i] + 1
