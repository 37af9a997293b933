"""Shoot: tubes from launch to last bounce, over every way in and out, as Routes."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from raychan.channel.collect import routes_of, same_way_back
from raychan.channel.found import Found
from raychan.channel.launch import launch
from raychan.channel.legs import Leg
from raychan.channel.mirrors import reachable
from raychan.channel.settle import settle
from raychan.channel.surface import Surface
from raychan.channel.trace import bounce
from raychan.channel.tubes import Refinement, Tubes, phases_of
from raychan.kernels.horizon import FACING, OBLIQUE
from raychan.tables import MIRROR, Routes

Floats = NDArray[np.float64]


def tube_routes(
    surface: Surface,
    leg: Leg,
    outs: list[Leg],
    bodies: NDArray[np.bool_],
    rule: Refinement,
    bounces: int,
    so_far: Found | None = None,
    first: Callable[[Tubes, Found], None] | None = None,
) -> Iterator[Routes]:
    """Yield the routes of tubes launched over `leg`, bounce by bounce and way out by way out.

    Args: so_far what launches over other legs have found; first is given the tubes on their first surface, whose own
    routes are then not among those yielded.
    """
    direct = outs[0]
    found = so_far or Found(rule)
    more = bounces > len(leg.mirrors) + 1 and not surface.convex_alone
    mirror_planes = _planes_in(surface, outs)
    others = [out for out in outs[1:] if len(leg.mirrors) + 1 + len(out.mirrors) <= bounces]
    for tubes in launch(surface, leg, direct, bodies, found, more, others):
        if first is not None:
            first(tubes, found)
        yield from _followed(surface, leg, outs, tubes, mirror_planes, bounces, found, first is None)


def _followed(
    surface: Surface, leg: Leg, outs: list[Leg], tubes: Tubes, mirror_planes: NDArray[np.bool_],
    bounces: int, found: Found, single: bool,
) -> Iterator[Routes]:  # fmt: skip
    """Yield the routes of tubes on their first surface, bounce by bounce and way out by way out.

    Args: mirror_planes (p,) which planes are mirrors of the legs; single whether those of the first surface count.
    """
    f, rule = surface.facets, found.rule
    first = True
    while len(tubes):
        count, body = int(tubes.bounces[0]), f.body[tubes.facet]
        # Ground has no return of its own here; a plane mirror lit from another body returns by its image, not twice.
        own = f.role[body] != MIRROR
        if not first:
            own &= ~(mirror_planes[tubes.facet] & (f.body[tubes.came_from()] != body))
        present = np.bincount(body[own], minlength=len(f.role)) > 0
        for out in outs if single or not first else []:
            may = reachable(surface, out) & present
            may[list(out.bodies)] = False
            if count + len(out.mirrors) > bounces or not may.any():
                continue
            rows = np.flatnonzero(own & may[body])
            if out.mirrors:
                rows = rows[out.may_leave(tubes.points[rows])]
            if not len(rows):
                continue
            some = tubes.take(rows)
            if first and out == leg:
                corners, passed = same_way_back(some, len(leg.mirrors), rule.layers)
                if not surface.convex_alone:
                    found.add(phases_of(surface, leg, out, some, first, rule))
            else:
                which = OBLIQUE if first else FACING
                some, corners, passed = settle(surface, leg, out, some, found, first, which)
            if len(some):
                yield routes_of(surface, leg, out, some, first, corners, passed)
        if count >= bounces or surface.convex_alone:
            return
        last = count + 1 >= bounces
        tubes = bounce(surface, leg, outs[0], tubes, first, last, found)
        if first and len(tubes):
            # From a plane mirror to another body: the legs over mirrors have these.
            previous = tubes.came_from()
            moved = f.body[previous] != f.body[tubes.facet]
            tubes = tubes.take(~(mirror_planes[previous] & moved))
        first = False


def _planes_in(surface: Surface, legs: list[Leg]) -> NDArray[np.bool_]:
    used = {int(surface.plane[m.facet]) for leg in legs for m in leg.mirrors}
    return np.isin(surface.plane, list(used))
