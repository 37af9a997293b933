"""Shoot: tubes from launch to last bounce, over every way in and out, as Routes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from raychan.channel.collect import routes_of
from raychan.channel.found import Found
from raychan.channel.launch import launch
from raychan.channel.legs import Leg
from raychan.channel.mirrors import reachable
from raychan.channel.surface import Surface
from raychan.channel.trace import bounce, settle
from raychan.channel.tubes import CENTRE, Refinement, Tubes, phases_of
from raychan.frames import sizes
from raychan.tables import MIRROR, TRANSMIT, Routes

Floats = NDArray[np.float64]


def tube_routes(
    surface: Surface,
    leg: Leg,
    outs: list[Leg],
    bodies: NDArray[np.bool_],
    rule: Refinement,
    bounces: int,
    so_far: Found | None = None,
) -> Iterator[Routes]:
    """Yield the routes of tubes launched over `leg`, bounce by bounce and way out by way out.

    Args: so_far what launches over other legs have found.
    """
    f = surface.facets
    direct = outs[0]
    # Where a wave still has to bounce it does not matter how the antenna looks at the place.
    blind = replace(direct, beam=None)
    found = so_far or Found(rule)
    tubes = launch(surface, leg, direct, bodies, found)
    mirror_planes = _planes_in(surface, outs)
    first = True
    reach = [reachable(surface, out) for out in outs]
    while len(tubes):
        counts = tubes.bounces
        present = np.bincount(f.body[tubes.facet], minlength=len(f.role)) > 0
        for out, may in zip(outs, reach, strict=True):
            if not (present & may).any():
                continue
            fits = counts + len(out.mirrors) <= bounces
            fits &= may[f.body[tubes.facet]] & ~np.isin(f.body[tubes.facet], list(out.bodies))
            # Ground has no return of its own here; a plane mirror lit from another body returns by its image, not
            # twice.
            fits &= f.role[f.body[tubes.facet]] != MIRROR
            if not first:
                fits &= ~(mirror_planes[tubes.facet] & _other_body(surface, tubes))
            if out.mirrors or not first:
                fits &= _may_leave(out, tubes)
            some = tubes.take(fits)
            if not len(some):
                continue
            if first and out == leg:
                corners, passed = _same_way_back(some, leg, rule)
            else:
                some, corners, passed = settle(surface, leg, out, some, found, first)
            if len(some):
                found.add(phases_of(surface, leg, out, some, first, rule))
                yield routes_of(surface, leg, out, some, first, corners, passed)
        tubes = tubes.take(counts < bounces)
        if not len(tubes) or surface.convex_alone:
            return
        before = tubes
        last = int(before.bounces[0]) + 1 >= bounces
        tubes = bounce(surface, leg, blind, before, first, last, found)
        if first and len(tubes):
            # From a plane mirror to another body: the legs over mirrors have these.
            previous = tubes.came_from()
            moved = f.body[previous] != f.body[tubes.facet]
            tubes = tubes.take(~(mirror_planes[previous] & moved))
        first = False


def _other_body(surface: Surface, tubes: Tubes) -> NDArray[np.bool_]:
    f = surface.facets
    return f.body[tubes.came_from()] != f.body[tubes.facet]


def _may_leave(out: Leg, tubes: Tubes) -> NDArray[np.bool_]:
    """Tell which tubes could send something over a way out: turned to it, and within the circles of its mirrors."""
    centre = tubes.points[:, CENTRE]
    ok = np.einsum("nj,nj->n", out.rays(centre)[0], tubes.normals[:, CENTRE]) < 0.0
    if out.mirrors:
        rows = np.flatnonzero(ok)
        size = sizes(tubes.points[rows, :3] - centre[rows, None]).max(axis=1)
        ok[rows] = out.may_reach(centre[rows], size)
    return ok


def _planes_in(surface: Surface, legs: list[Leg]) -> NDArray[np.bool_]:
    used = {int(surface.plane[m.facet]) for leg in legs for m in leg.mirrors}
    return np.isin(surface.plane, list(used))


def _same_way_back(tubes: Tubes, leg: Leg, rule: Refinement) -> tuple[Floats, NDArray[np.int32]]:
    """Return the way out of first-bounce tubes over the leg they came by, from their history."""
    n, m = len(tubes), len(leg.mirrors)
    vertices, _, facets, kinds = tubes.history.tables(tubes.last, tubes.slots)
    passed = np.full((n, rule.layers), -1, np.int32)
    for j in range(rule.layers):
        slot = m + j
        passed[:, j] = np.where(kinds[:, slot] == TRANSMIT, facets[:, slot], -1)
    return vertices[:, :m], passed
