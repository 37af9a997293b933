"""The launch of a preview: each body is seen directly and over the ground, and scatters once.

Seed facets are pruned by their bounds before anything is traced, whole facets are seen or hidden by their centres, and
nothing bounces from body to body. What that leaves out is said in `run.preview`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.curved_patches import edge_to_cut, halved
from raychan.parallel import run_pair
from raychan.radar.beam_table import Beam
from raychan.records import MIRROR, SCATTERER, Points, Routes
from raychan.tracing.contributions import SHARE, Contributions, amplitudes
from raychan.tracing.culling import seed_facets
from raychan.tracing.launch import write_leg
from raychan.tracing.legs import Leg, Mirror, View, reachable
from raychan.tracing.radiation import FACING, phases_of, radiating
from raychan.tracing.routes import routes_of
from raychan.tracing.settings import PruneRule
from raychan.tracing.solver import Batch, Launch, Stats
from raychan.tracing.tubes import MOST_BEND, Refinement, Tubes, launch_tubes
from raychan.tracing.visibility import centre_visibility
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

# Seeds are pruned by a share of their bounds, which tubes out of phase stay under: at 1 tracing the urban street takes
# 20 % more CPU than at 0.25, at 0.1 echoes of the living street lose 6 dB (command not noted).
_SEEDS = 0.25
_SEEN = 0.5  # the same, of tubes that are seen: at 0.25 echoes of the living street lose 4 dB, at 0.5 they lose 2
_CLASSES, _A_CLASS = 64, 4.0  # of sizes below the threshold, and of these to a factor of two; not measured
_CUTS = 12  # times a facet is halved at most: 64 parts a side, of a wall of 40 m no part is longer than 0.6 m


def preview_routes(geometry: Geometry, points: Points, rule: PruneRule, stats: Stats) -> Iterator[Batch]:
    """Yield the routes of a preview, batch by batch; stats is filled.

    Args: geometry; points the targets given by their RCS; rule what may be left out.
    """
    launch, refined = Launch(geometry, points, rule, legs_over_ground), rule.refinement.for_depth(rule.bounces)

    def over(legs: list[Leg]) -> tuple[list[_Tubes], int]:
        """Return the tubes over some legs, and the rays that this thread cast for them."""
        before, seen = geometry.rays, []
        for leg in legs:
            outs = [out for out in launch.outs if len(leg.mirrors) + 1 + len(out.mirrors) <= rule.bounces]
            seen.append(_Tubes.over(geometry, leg, outs, refined))
        return seen, geometry.rays - before

    (direct, some), (others, more) = run_pair(lambda: over(launch.legs[:1]), lambda: over(launch.legs[1:]))
    before, found = geometry.rays, Contributions(refined)
    yield from launch.exact()
    # What the direct leg finds prunes the others.
    for tubes in direct + others:
        for routes in tubes.routes(found):
            stats.tubes += len(routes.kind)
            yield routes
    stats.legs = len(launch.legs)
    stats.rays += some + more + geometry.rays - before


def legs_over_ground(geometry: Geometry, end: Floats, bounces: int, beam: Beam | None = None) -> list[Leg]:
    """Return the direct leg from `end` (3,) [m], whose antenna has a `beam`, and one over each plane of the ground."""
    f = geometry.facets
    ground = np.flatnonzero((f.role == MIRROR)[f.body]) if len(f.body) else np.zeros(0, int)
    _, first = np.unique(geometry.plane[ground], return_index=True)
    legs = [Leg(end=end, beam=beam)]
    for facet in ground[first]:
        if bounces > 0 and (end - geometry.first[facet]) @ geometry.normal[facet] > 0.0:
            legs.append(Leg(end=end, mirrors=(Mirror.of(geometry, int(facet), 1.0),), beam=beam))
    return legs


@dataclass(frozen=True)
class _Tubes:
    """Tubes on their first surface that may count, and how the end of their leg in sees their centres."""

    geometry: Geometry
    leg: Leg
    outs: list[Leg]
    tubes: Tubes
    view: View

    @staticmethod
    def over(geometry: Geometry, leg: Leg, outs: list[Leg], rule: Refinement) -> _Tubes:
        """Return the tubes over a leg that may count over one of `outs`, cut where facets are large."""
        found = Contributions(rule)
        allowed = reachable(geometry, leg) & (geometry.piece_role == SCATTERER)
        allowed[leg.pieces(geometry)] = False
        facet = seed_facets(geometry, leg, allowed)
        whole = np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy()
        tubes = launch_tubes(geometry, leg, facet, whole)
        counts = np.zeros(len(facet), bool)
        for out in outs:
            ph = phases_of(geometry, leg, out, tubes, rule)
            counts |= _that_count(found, _SEEDS * ph.bound, ph.length)
        facet, bary, cut = _cut(geometry, leg, outs[0], facet[counts], whole[: counts.sum()], rule)
        tubes = launch_tubes(geometry, leg, facet, bary) if cut else tubes.take(counts)
        tubes = tubes.take(tubes.strength > 0.0)
        view = centre_visibility(geometry, leg, tubes, True, rule)
        tubes, view = tubes.take(view.seen), view.take(view.seen)
        write_leg(geometry, tubes, leg, view.corners, view.passed, rule)
        return _Tubes(geometry, leg, outs, tubes, view)

    def routes(self, found: Contributions) -> Iterator[Routes]:
        """Yield the routes over each leg out; what the strongest hide in their range cells is left out."""
        geometry, leg = self.geometry, self.leg
        for out in sorted(self.outs, key=lambda x: x is not leg):
            _, facing = radiating(out, self.tubes, FACING)
            tubes, view = self.tubes.take(facing), self.view.take(facing)
            ph = phases_of(geometry, leg, out, tubes, found.rule)
            each = None
            if out is leg:
                each = amplitudes(ph)
                found.add(ph, each)
            rows = np.flatnonzero(_that_count(found, _SEEN * ph.bound, ph.length))
            ph = ph.take(rows)
            each = amplitudes(ph) if each is None else each[rows]
            kept = np.flatnonzero(_that_count(found, np.abs(each), ph.length))
            rows, ph, each = rows[kept], ph.take(kept), each[kept]
            tubes, view = tubes.take(rows), view.take(rows)
            if out is not leg:
                view = centre_visibility(geometry, out, tubes, True, found.rule)
                tubes, ph, each = tubes.take(view.seen), ph.take(view.seen), each[view.seen]
                view = view.take(view.seen)
                found.add(ph, each)
            if len(tubes):
                yield routes_of(geometry, leg, out, tubes, True, view.corners, view.passed)


def _that_count(found: Contributions, size: Floats, length: Floats) -> Bools:
    """Return which tubes (n,) to keep: the weakest of each range cell are pruned while their sum in phase stays under
    0.3 of the prune threshold; as `Contributions.that_count`, but by classes of sizes in place of a sort.

    Args: size (n,) [1/m] of what each scatters, length (n,) [m] of its two-way path.
    """
    share = size / found.prune_threshold(length)
    cell = np.asarray(length / found.rule.cell, np.int64)
    octave = np.clip(_CLASSES + _A_CLASS * np.log2(np.maximum(share, 1e-9)), 0, _CLASSES - 1).astype(np.int64)
    sums = np.bincount(cell * _CLASSES + octave, share, (int(cell.max(initial=0)) + 1) * _CLASSES)
    sums = np.cumsum(sums.reshape(-1, _CLASSES), axis=1)
    return np.asarray(sums[cell, octave] > SHARE)


def _cut(
    geometry: Geometry, leg: Leg, out: Leg, facet: Ints, bary: Floats, rule: Refinement
) -> tuple[Ints, Floats, bool]:
    """Return facets (n,) and corners (n, 3, 3) of tubes cut until their phase is quadratic, and whether any was cut."""
    f = geometry.facets
    shape = f.vertices, f.normals, geometry.edge_curvature
    limits = rule.wavenumber, rule.phase, rule.turn, rule.max_edge, MOST_BEND, True
    done: list[tuple[Ints, Floats]] = []
    for level in range(_CUTS + 1):
        edge = edge_to_cut(facet, bary, *shape, leg.image, leg.far, out.image, out.far, *limits)
        more = (edge >= 0) & (level < _CUTS)
        done.append((facet[~more], bary[~more]))
        if not more.any():
            break
        facet, bary = halved(facet[more], bary[more], edge[more], 0.0, level)
    return np.concatenate([x for x, _ in done]), np.concatenate([x for _, x in done]), len(done) > 1
