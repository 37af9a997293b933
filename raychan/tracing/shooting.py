"""Shooting and bouncing rays: tubes from their launch to their last bounce, and over every return leg, as Routes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.poses import sizes
from raychan.records import MIRROR, Routes
from raychan.tracing.bounce import bounce
from raychan.tracing.contributions import Contributions, amplitudes
from raychan.tracing.images import Images, without_turned
from raychan.tracing.launch import OBLIQUE_SHARE, launch, seeds_of
from raychan.tracing.legs import Leg, View
from raychan.tracing.outgoing import Leaving
from raychan.tracing.radiation import FACING, LIT, OBLIQUE, Phases, phases_of, radiating_phases
from raychan.tracing.routes import leg_of_arrival, routes_of
from raychan.tracing.shared_work import all_of
from raychan.tracing.subdivide import bisect, subdivide
from raychan.tracing.tubes import Refinement, Tubes
from raychan.tracing.visibility import BISECT, CLIP, KEEP, choose_actions, tube_visibility
from raychan.tracing.ways import Way
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
T = TypeVar("T")

_SHARES = 8  # parts of what is left of a budget that each outgoing leg gets; not measured


@dataclass(frozen=True)
class Wanted:
    """What a further launch traces again: tubes that start on `facets` (f,), and of their routes those that scatter at
    their bounce number `depth` and leave over one of `outs`, numbers of legs."""

    facets: Bools
    depth: int
    outs: frozenset[int]

    def parts(self, most: int) -> Iterator[Wanted]:
        """Give parts of what is wanted, of about `most` first facets each."""
        rows = np.flatnonzero(self.facets)
        for some in np.array_split(rows, max(1, round(len(rows) / most))):
            facets = np.zeros_like(self.facets)
            facets[some] = True
            yield replace(self, facets=facets)


def tube_routes(
    geometry: Geometry,
    leg: Leg,
    outs: list[Leg],
    pieces: Bools,
    rule: Refinement,
    bounces: int,
    so_far: Contributions | None = None,
    first: Callable[[Tubes, Contributions], None] | None = None,
) -> Iterator[Routes]:
    """Yield the routes of tubes launched over `leg`, one batch for each bounce and outgoing leg.

    Args: outs the outgoing legs, the direct one first; pieces (p,) that may carry the first bounce; bounces the most
    interactions, both legs counted; so_far contributions to prune against; first is given the tubes on their first
    surface, whose own routes are then not yielded.
    """
    found = so_far or Contributions(rule.for_depth(bounces))
    images = Images.of(geometry, outs, outs)
    yield from numbered_routes(geometry, leg, outs, images, pieces, bounces, found, lambda routes, *_: routes, first)


def numbered_routes(
    geometry: Geometry,
    leg: Leg,
    outs: list[Leg],
    images: Images,
    pieces: Bools,
    bounces: int,
    found: Contributions,
    each: Callable[[Routes, int, int, bool], T],
    first: Callable[[Tubes, Contributions], None] | None = None,
    wanted: Wanted | None = None,
    way: Way | None = None,
    turned: bool = False,
) -> Iterator[T]:
    """Yield what `each` makes of the routes that `tube_routes` yields, of the number of the bounce at which they
    scatter, from 1 on, and of that of the leg over which they leave; it is called by any thread.

    Args: images of all legs in and out; wanted, if not all; way which of two ways this is, if rays are followed from
    both ends; turned: both ends are one, and routes that come over one leg and leave over another, both over grounds
    alone, stand for those with their ends exchanged, for which `each` is called once more (its last argument tells so);
    else as for `tube_routes`.
    """
    more = bounces > len(leg.mirrors) + 1 and not geometry.convex_alone and (wanted is None or wanted.depth > 1)
    others = [out for out in outs[1:] if len(leg.mirrors) + 1 + len(out.mirrors) <= bounces]
    only, pieces = None if wanted is None else wanted.facets, without_turned(geometry, leg, [outs[0], *others], pieces)
    if way is not None and way.back and not more:
        # Nothing bounces: of the way back only what the other one has not counts.
        only = way.may_have(geometry, leg, [outs[0], *others], seeds_of(geometry, leg, pieces), only)
    for tubes in launch(geometry, leg, outs[0], pieces, found, more, others, only):
        if first is not None:
            first(tubes, found)
        wave = _Wave(geometry, leg, outs, images, bounces, each, wanted, way, turned)
        yield from wave.followed(tubes, found, first is None)


@dataclass(frozen=True)
class _Wave(Generic[T]):
    """Tubes of one leg in, on their way from surface to surface."""

    geometry: Geometry
    leg: Leg
    outs: list[Leg]
    images: Images
    bounces: int
    each: Callable[[Routes, int, int, bool], T]
    wanted: Wanted | None
    way: Way | None
    turned: bool

    def followed(self, tubes: Tubes, found: Contributions, single: bool) -> Iterator[T]:
        """Yield what is made of the routes of tubes that stand on their first surface, and of all later bounces;
        without `single` those of the first surface are left out."""
        geometry, wanted, depth = self.geometry, self.wanted, 1
        while len(tubes):
            first, count = depth == 1, int(tubes.bounces[0])
            outs = [i for i in range(len(self.outs)) if count + len(self.outs[i].mirrors) <= self.bounces]
            if wanted is not None:
                outs = [i for i in outs if i in wanted.outs and depth == wanted.depth]
            if first and not single:
                outs = []
            ends = count >= self.bounces or geometry.convex_alone or (wanted is not None and depth == wanted.depth)
            # Mirrors such as the ground return by their exact foot points, not by tubes.
            scatters = geometry.facets.role[geometry.facets.body[tubes.facet]] != MIRROR
            share = 1.0 / min(max(len(outs), 1), _SHARES)
            twice, which = self.images.returns(geometry, tubes, first), OBLIQUE if first else FACING
            came_by = self.leg if first else None
            leaving = Leaving(geometry, self.outs, outs, tubes, scatters, twice, first, which, came_by)
            outs = [i for i in outs if leaving.any_over(i)]
            left = partial(self._left, tubes, leaving, depth, twice)
            # What returns by the leg that it came by counts first, and the others against that.
            same = [i for i in outs if first and self.outs[i] is self.leg]
            for i in same:
                yield from left(i, found)
            tasks, parts = [], list[Contributions]()
            for i in (i for i in outs if i not in same):
                parts.append(found.forked(geometry, share))
                tasks.append(partial(left, i, parts[-1]))
            landed: list[Tubes] = []
            if not ends:
                parts.append(found.forked(geometry, 0.5))
                tasks.insert(0, partial(self._bounced, tubes, count, depth, parts[-1], landed))
            for made in all_of(geometry, tasks):
                yield from made
            found.joined(parts)
            if ends:
                return
            tubes, depth = landed[0], depth + 1

    def _left(self, tubes: Tubes, leaving: Leaving, depth: int, twice: Bools, i: int, found: Contributions) -> list[T]:
        """Return what is made of the routes over leg out i of tubes on their surface number `depth`, `twice` (n,) as
        for `Leaving`."""
        rows, way = leaving.over(i), self._exchanged(depth, i)
        if way < 0:
            rows = rows[twice[rows]]
        if depth == 1 and (turned := leaving.turned(i)) >= 0:
            rows = rows[self.geometry.piece[tubes.facet[rows]] != self.geometry.piece[turned]]
        made, some = list[T](), tubes.only(rows)
        if self.way is not None and depth == 1:
            some = self.way.of_first_surface(self.geometry, self.leg, self.outs[i], some)
        for routes in _returned(self.geometry, self.leg, self.outs[i], some, depth == 1, found):
            made.append(self.each(routes, depth, i, False))
            if way > 0:
                plane = self.geometry.plane[routes.facet[np.arange(len(routes.kind)), routes.scatter]]
                made.append(self.each(take(routes, ~self.images.planes[plane]), depth, i, True))
        return made

    def _exchanged(self, depth: int, i: int) -> int:
        """Tell whether routes over leg out i also stand for those with their ends exchanged, 1, or are brought by
        those, -1; but for those of mirrors of legs. Else 0."""
        leg, out, role = self.leg, self.outs[i], self.geometry.facets.role
        over = leg.mirrors + out.mirrors
        if depth > 1 or not self.turned or out is leg or any(role[m.body] != MIRROR for m in over):
            return 0
        return 1 if i > next(j for j, one in enumerate(self.outs) if one is leg) else -1

    def _bounced(self, tubes: Tubes, count: int, depth: int, found: Contributions, landed: list[Tubes]) -> list[T]:
        """Put tubes after their next reflection into `landed`."""
        last = count + 1 >= self.bounces or (self.wanted is not None and depth + 1 == self.wanted.depth)
        after = bounce(self.geometry, self.leg, self.outs[0], tubes, depth == 1, last, found)
        if depth == 1 and len(after):
            after = after.take(~self.images.carry(self.geometry, after))
        landed.append(after)
        return []


def _returned(
    geometry: Geometry, leg: Leg, out: Leg, some: Tubes, first: bool, found: Contributions
) -> Iterator[Routes]:
    """Yield the routes of those tubes that an outgoing leg sees."""
    rule = found.rule
    if not len(some):
        return
    if first and out == leg:
        if not geometry.convex_alone:
            ph = phases_of(geometry, leg, out, some, rule)
            each = amplitudes(ph)
            found.add(ph, each)
            some = some.only(found.that_return(each, ph.length, geometry.facets.body[some.facet]))
        corners, passed = leg_of_arrival(some, len(leg.mirrors), rule.layers)
    else:
        which = OBLIQUE if first else FACING
        some, corners, passed = resolve_return_leg(geometry, leg, out, some, found, first, which)
    if len(some):
        yield routes_of(geometry, leg, out, some, first, corners, passed)


def resolve_return_leg(
    geometry: Geometry,
    leg: Leg,
    out: Leg,
    tubes: Tubes,
    found: Contributions,
    first: bool = False,
    which: int = FACING,
) -> tuple[Tubes, Floats, Ints]:
    """Subdivide tubes until their phase over `out` is quadratic and its end sees all or nothing of each.

    Args: first whether they stand on their first surface; which of them radiate (see `tracing.radiation`). What is
    seen is added to `found`. Returns: the tubes that are seen, and mirror points (n, m, 3) [m] and layers (n, l) of
    their leg out."""
    resolved: list[tuple[Tubes, View, Phases]] = []
    rule = found.rule
    for level in range(rule.levels + 1):
        ph, share, facing = radiating_phases(geometry, leg, out, tubes, rule, which)
        if not share.all():
            rows = np.flatnonzero(share)
            tubes, ph, share, facing = tubes.take(rows), ph.take(rows), share[rows], facing[rows]
        if which == OBLIQUE and not facing.all():
            # Beyond the horizon tubes are mostly out of phase with their neighbours, and few count.
            weak = np.flatnonzero(~facing)
            left = found.that_count(OBLIQUE_SHARE * ph.bound[weak] * share[weak], ph.length[weak], 0)
            rows = np.sort(np.concatenate([np.flatnonzero(facing), weak[left]]))
            tubes, ph, share, facing = tubes.only(rows), ph.take(rows), share[rows], facing[rows]
        least = found.prune_threshold(ph.length) if first else found.deep_threshold(ph.length)
        # Along an edge flat tubes may err alike though the phase runs over each.
        flat = rule.by_landing & tubes.flat & ~geometry.curved[tubes.facet]
        matters = np.where(flat, ph.in_phase, ph.bound) > least
        if not level and found.leaves_out(len(tubes)):
            rows = found.that_return(
                # Of what may be cut the parts are not known yet.
                np.where(matters, np.inf, amplitudes(ph) * share), ph.length, geometry.facets.body[tubes.facet]
            )  # fmt: skip
            tubes, ph, facing, matters = tubes.only(rows), ph.take(rows), facing[rows], matters[rows]
        matters &= not found.budget.spent(geometry)
        # In a scene currents beyond the horizon are weak: their visibility is tested by their centres alone.
        tested = matters if which == LIT else matters & facing
        view = tube_visibility(geometry, out, tubes, tested, first, rule, level, facing_away=~facing)
        cut = matters if level < rule.levels else np.zeros_like(matters)
        how = facing, view.centre.seen, view.some, view.mixed, ph.rough
        what = choose_actions(*how, cut)
        wanted = what >= BISECT
        afforded = found.budget.affords(geometry, tubes.facet, wanted)
        if afforded is not wanted:
            what = choose_actions(*how, cut & (~wanted | afforded))
        ready = np.flatnonzero(what == KEEP)
        if len(ready) or not resolved:
            resolved.append((tubes.take(ready), view.centre.take(ready), ph.take(ready)))
        if not (what >= BISECT).any():
            break
        tubes = _parts_of(geometry, leg, tubes, what, ph, view.side, first, rule.jitter)
    some, views, phases = zip(*resolved, strict=True)
    if not geometry.convex_alone:
        found.add(Phases.join(list(phases)))
    seen = View.join(list(views))
    return Tubes.join(list(some)), seen.corners, seen.passed


def _parts_of(
    geometry: Geometry, leg: Leg, tubes: Tubes, what: NDArray[np.int8], ph: Phases, side: Floats, first: bool,
    jitter: float,
) -> Tubes:  # fmt: skip
    """Return the parts of tubes that are to be bisected or clipped, `what` (n,); else as for `subdivide`."""
    bent, shaded, parts = np.flatnonzero(what == BISECT), np.flatnonzero(what == CLIP), list[Tubes]()
    if len(bent):
        # Where the phase bends on no edge, the longest is bisected.
        lengths = sizes(tubes.points[bent, :3] - np.roll(tubes.points[bent, :3], -1, axis=1))
        edge = np.argmax(np.where((ph.rough[bent] > 1.0)[:, None], np.abs(ph.bend[bent]), lengths), axis=1)
        parts.append(bisect(geometry, leg, tubes, bent, edge, first, jitter))
    if len(shaded):
        parts.append(subdivide(geometry, leg, tubes, shaded, side, first, jitter)[0])
    return Tubes.join(parts)
