"""Shoot: tubes from launch to last bounce, over every way in and out, as Routes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR, Routes
from raychan.tracing.bounce import bounce
from raychan.tracing.contributions import Found
from raychan.tracing.horizon import FACING, OBLIQUE
from raychan.tracing.launch import launch
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import reachable
from raychan.tracing.return_leg import settle
from raychan.tracing.routes import routes_of, same_way_back
from raychan.tracing.tubes import Refinement, Tubes, phases_of
from raychan.world.geometry import Surface

Bools = NDArray[np.bool_]


def tube_routes(
    surface: Surface,
    leg: Leg,
    outs: list[Leg],
    pieces: Bools,
    rule: Refinement,
    bounces: int,
    so_far: Found | None = None,
    first: Callable[[Tubes, Found], None] | None = None,
) -> Iterator[Routes]:
    """Yield the routes of tubes launched over `leg`, bounce by bounce and way out by way out.

    Args: pieces (p,) which may carry the first bounce; so_far what launches over other legs have found; first is given
    the tubes on their first surface, whose own routes are then not among those yielded.
    """
    direct = outs[0]
    found = so_far or Found(rule.for_depth(bounces))
    more = bounces > len(leg.mirrors) + 1 and not surface.convex_alone
    images = _Images.of(surface, outs)
    others = [out for out in outs[1:] if len(leg.mirrors) + 1 + len(out.mirrors) <= bounces]
    for tubes in launch(surface, leg, direct, pieces, found, more, others):
        if first is not None:
            first(tubes, found)
        yield from _followed(surface, leg, outs, tubes, images, bounces, found, first is None)


def _followed(
    surface: Surface, leg: Leg, outs: list[Leg], tubes: Tubes, images: _Images, bounces: int, found: Found, single: bool
) -> Iterator[Routes]:
    """Yield the routes of tubes on their first surface, bounce by bounce and way out by way out; `single`: those of the
    first surface too."""
    f, first = surface.facets, True
    while len(tubes):
        count = int(tubes.bounces[0])
        # Ground has no return of its own here.
        own = f.role[f.body[tubes.facet]] != MIRROR
        by_image = images.returns(surface, leg, tubes, first)
        for out in outs if single or not first else []:
            if count + len(out.mirrors) > bounces:
                continue
            twice = by_image & (not first or images.over(surface, out))
            yield from _returned(surface, leg, out, tubes, own & ~twice, first, False, found)
            if surface.veils:
                yield from _returned(surface, leg, out, tubes, own & twice, first, True, found)
        if count >= bounces or surface.convex_alone:
            return
        last = count + 1 >= bounces
        tubes = bounce(surface, leg, outs[0], tubes, first, last, found)
        if first and len(tubes):
            tubes = tubes.take(~images.carry(surface, tubes))
        first = False


def _returned(
    surface: Surface, leg: Leg, out: Leg, tubes: Tubes, own: Bools, first: bool, veiled: bool, found: Found
) -> Iterator[Routes]:
    """Yield the routes of those tubes, of `own` (n,), that are seen over a way out, or seen through a layer."""
    rule, piece = found.rule, surface.piece[tubes.facet]
    may = reachable(surface, out).copy()
    may[out.pieces(surface)] = False
    rows = np.flatnonzero(own & may[piece])
    if out.mirrors:
        rows = rows[out.may_leave(tubes.points[rows])]
    if not len(rows):
        return
    some = tubes.take(rows)
    if first and out == leg and not veiled:
        corners, passed = same_way_back(some, len(leg.mirrors), rule.layers)
        if not surface.convex_alone:
            found.add(phases_of(surface, leg, out, some, rule))
    else:
        some, corners, passed = settle(surface, leg, out, some, found, first, veiled, OBLIQUE if first else FACING)
    if len(some):
        yield routes_of(surface, leg, out, some, first, corners, passed)


@dataclass(frozen=True)
class _Images:
    """What returns by its image in a mirror must not return by tubes too: `planes` (p,) that are mirrors of legs.

    Over several such mirrors in a row a wave scatters at the last. No leg leads through a layer before its last
    stretch, though: such ways are the tubes'.
    """

    planes: Bools

    @staticmethod
    def of(surface: Surface, legs: list[Leg]) -> _Images:
        """Return the mirrors of legs."""
        used = {int(surface.plane[m.facet]) for leg in legs for m in leg.mirrors}
        return _Images(np.isin(np.arange(surface.plane.max(initial=-1) + 1), list(used)))

    def over(self, surface: Surface, out: Leg) -> bool:
        """Tell whether a way out leads over a mirror that may be the last to scatter."""
        return any(surface.facets.role[m.body] != MIRROR for m in out.mirrors)

    def returns(self, surface: Surface, leg: Leg, tubes: Tubes, first: bool) -> Bools:
        """Tell of tubes (n,) whether they stand on a mirror that has their returns by its image: on their first
        surface those that leave over other mirrors, later all that came from another piece."""
        mirror = self.planes[surface.plane[tubes.facet]]
        if first:
            return mirror & (tubes.slots == len(leg.mirrors))
        return mirror & (surface.piece[tubes.came_from()] != surface.piece[tubes.facet])

    def carry(self, surface: Surface, tubes: Tubes) -> Bools:
        """Tell of tubes (n,) whether a leg over the mirror on which they stood first leads to the piece where they
        landed."""
        before = tubes.came_from()
        moved = surface.piece[before] != surface.piece[tubes.facet]
        return self.planes[surface.plane[before]] & moved & ~tubes.history.veiled(tubes.last)
