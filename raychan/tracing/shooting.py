"""Shooting and bouncing rays: tubes from their launch to their last bounce, out over every leg, as Routes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR, Routes
from raychan.tracing.bounce import bounce
from raychan.tracing.contributions import Contributions
from raychan.tracing.horizon import FACING, OBLIQUE
from raychan.tracing.launch import launch
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import reachable
from raychan.tracing.return_leg import resolve_return_leg
from raychan.tracing.routes import routes_of, same_way_back
from raychan.tracing.tube_phases import phases_of
from raychan.tracing.tubes import Refinement, Tubes
from raychan.world.geometry import Geometry

Bools = NDArray[np.bool_]


def tube_routes(
    geometry: Geometry,
    leg: Leg,
    outs: list[Leg],
    pieces: Bools,
    rule: Refinement,
    bounces: int,
    so_far: Contributions | None = None,
    first: Callable[[Tubes, Contributions], None] | None = None,
    ins: list[Leg] | None = None,
) -> Iterator[Routes]:
    """Yield the routes of tubes launched over `leg`, one batch for each bounce and outgoing leg.

    Args: outs the outgoing legs, the direct one first; pieces (p,) that may carry the first bounce; bounces the most
    interactions, both legs counted; so_far contributions to prune against; first is given the tubes on their first
    surface, whose own routes are then not yielded; ins all legs in, by default those out.
    """
    direct = outs[0]
    found = so_far or Contributions(rule.for_depth(bounces))
    more = bounces > len(leg.mirrors) + 1 and not geometry.convex_alone
    images = _Images.of(geometry, outs if ins is None else ins, outs)
    others = [out for out in outs[1:] if len(leg.mirrors) + 1 + len(out.mirrors) <= bounces]
    for tubes in launch(geometry, leg, direct, pieces, found, more, others):
        if first is not None:
            first(tubes, found)
        yield from _followed(geometry, leg, outs, tubes, images, bounces, found, first is None)


def _followed(
    geometry: Geometry,
    leg: Leg,
    outs: list[Leg],
    tubes: Tubes,
    images: _Images,
    bounces: int,
    found: Contributions,
    single: bool,
) -> Iterator[Routes]:
    """Yield the routes of tubes that stand on their first surface, and of all later bounces; without `single` those of
    the first surface are left out."""
    f, first = geometry.facets, True
    while len(tubes):
        count = int(tubes.bounces[0])
        # Mirrors such as the ground return by their exact foot points, not by tubes.
        own = f.role[f.body[tubes.facet]] != MIRROR
        by_image = images.returns(geometry, leg, tubes, first)
        # What returns by the leg that it came by counts first: the order of the others then does not matter.
        every = sorted(outs, key=lambda out: out is not leg) if first else outs
        for out in every if single or not first else []:
            if count + len(out.mirrors) > bounces:
                continue
            twice = by_image & (not first or images.over(geometry, out))
            yield from _returned(geometry, leg, out, tubes, own & ~twice, first, False, found)
            if geometry.has_layers:
                yield from _returned(geometry, leg, out, tubes, own & twice, first, True, found)
        if count >= bounces or geometry.convex_alone:
            return
        last = count + 1 >= bounces
        tubes = bounce(geometry, leg, outs[0], tubes, first, last, found)
        if first and len(tubes):
            tubes = tubes.take(~images.carry(geometry, tubes))
        first = False


def _returned(
    geometry: Geometry, leg: Leg, out: Leg, tubes: Tubes, own: Bools, first: bool, veiled: bool, found: Contributions
) -> Iterator[Routes]:
    """Yield the routes of tubes, of those chosen by `own` (n,), that an outgoing leg sees; `veiled`: only those that
    it sees through a layer."""
    rule, piece = found.rule, geometry.piece[tubes.facet]
    may = reachable(geometry, out).copy()
    may[out.pieces(geometry)] = False
    rows = np.flatnonzero(own & may[piece])
    if out.mirrors:
        rows = rows[out.may_leave(tubes.points[rows])]
    if not len(rows):
        return
    some = tubes.take(rows)
    if first and out == leg and not veiled:
        corners, passed = same_way_back(some, len(leg.mirrors), rule.layers)
        if not geometry.convex_alone:
            found.add(phases_of(geometry, leg, out, some, rule))
    else:
        some, corners, passed = resolve_return_leg(
            geometry, leg, out, some, found, first, veiled, OBLIQUE if first else FACING
        )
    if len(some):
        yield routes_of(geometry, leg, out, some, first, corners, passed)


@dataclass(frozen=True)
class _Images:
    """Returns that legs over mirrors carry already and tubes must not carry again; `planes` (p,) are the mirrors of
    legs in, `outward` (p,) those of legs out.

    Over several such mirrors in a row a wave scatters at the last one. Legs pass layers on their last stretch only:
    routes through a layer before it are left to the tubes.
    """

    planes: Bools
    outward: Bools

    @staticmethod
    def of(geometry: Geometry, ins: list[Leg], outs: list[Leg]) -> _Images:
        """Return the mirrors of legs in and out."""
        used = [{int(geometry.plane[m.facet]) for leg in legs for m in leg.mirrors} for legs in (ins, outs)]
        return _Images(*(np.isin(np.arange(geometry.plane.max(initial=-1) + 1), list(some)) for some in used))

    def over(self, geometry: Geometry, out: Leg) -> bool:
        """Tell whether an outgoing leg has a mirror that also scatters (the ground does not)."""
        return any(geometry.facets.role[m.body] != MIRROR for m in out.mirrors)

    def returns(self, geometry: Geometry, leg: Leg, tubes: Tubes, first: bool) -> Bools:
        """Tell which tubes (n,) stand on a mirror whose image carries their return: on their first surface those that
        leave over other mirrors, later all that came from another piece."""
        plane = geometry.plane[tubes.facet]
        if first:
            return self.planes[plane] & (tubes.slots == len(leg.mirrors))
        return self.outward[plane] & (geometry.piece[tubes.came_from()] != geometry.piece[tubes.facet])

    def carry(self, geometry: Geometry, tubes: Tubes) -> Bools:
        """Tell which tubes (n,) a leg covers: it leads over the mirror where they bounced first to where they are."""
        before = tubes.came_from()
        moved = geometry.piece[before] != geometry.piece[tubes.facet]
        return self.planes[geometry.plane[before]] & moved & ~tubes.history.behind_layer(tubes.last)
