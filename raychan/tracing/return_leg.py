"""The return leg: tubes on their last surface are subdivided until their two-way phase is simple and each is seen, or
not, from the end of the leg out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.poses import sizes
from raychan.tracing.contributions import Contributions
from raychan.tracing.horizon import FACING, LIT, OBLIQUE
from raychan.tracing.launch import GAP_LEVELS, OBLIQUE_SHARE
from raychan.tracing.legs import Leg, View
from raychan.tracing.subdivide import bisect, subdivide
from raychan.tracing.tube_phases import Phases, phases_of
from raychan.tracing.tubes import Tubes
from raychan.tracing.visibility import BISECT, CLIP, KEEP, choose_actions, tube_visibility
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def resolve_return_leg(
    geometry: Geometry,
    leg: Leg,
    out: Leg,
    tubes: Tubes,
    found: Contributions,
    first: bool = False,
    veiled: bool = False,
    which: int = FACING,
) -> tuple[Tubes, Floats, Ints]:
    """Subdivide tubes until their phase over `out` is quadratic and its end sees all or nothing of each.

    Args: first whether they stand on their first surface; veiled: only what is seen through a layer is returned; which
    of them radiate (see `tracing.horizon`). What is seen is added to `found`. Returns: the tubes that are seen, and
    mirror points (n, m, 3) [m] and layers (n, l) of their leg out.
    """
    kept: list[tuple[Tubes, View, Phases]] = []
    rule = found.rule
    for level in range(rule.levels + 1):
        share, facing = out.radiating(tubes.points, tubes.k, tubes.normals, which)
        rows = np.flatnonzero(share > 0.0)
        tubes, share, facing = tubes.take(rows), share[rows], facing[rows]
        ph = phases_of(geometry, leg, out, tubes, rule)
        if which == OBLIQUE and not facing.all():
            # Beyond the horizon tubes are mostly out of phase with their neighbours, and few count.
            weak = np.flatnonzero(~facing)
            left = found.that_count(OBLIQUE_SHARE * ph.bound[weak] * share[weak], ph.length[weak], 0)
            rows = np.sort(np.concatenate([np.flatnonzero(facing), weak[left]]))
            tubes, ph, facing = tubes.take(rows), ph.take(rows), facing[rows]
        matters = (ph.bound > found.prune_threshold(ph.length)) & (not found.budget.spent(geometry))
        # In a scene currents beyond the horizon are weak: their visibility is tested by their centres alone.
        tested = matters if which == LIT else matters & facing
        view = tube_visibility(geometry, out, tubes, tested, first, rule, level < GAP_LEVELS, facing_away=~facing)
        cut = matters if level < rule.levels else np.zeros_like(matters)
        if veiled:
            view.centre.seen[(view.centre.passed < 0).all(axis=1)] = False
        how = facing, view.centre.seen, view.some, view.mixed, ph.rough
        what = choose_actions(*how, cut)
        wanted = (what == BISECT) | (what == CLIP)
        cut &= ~wanted | found.budget.affords(geometry, tubes.facet, wanted)
        what = choose_actions(*how, cut)
        ready, bent, shaded = (np.flatnonzero(what == w) for w in (KEEP, BISECT, CLIP))
        kept.append((tubes.take(ready), view.centre.take(ready), ph.take(ready)))
        if not len(bent) and not len(shaded):
            break
        # Where the phase bends on no edge, the longest is bisected.
        lengths = sizes(tubes.points[bent, :3] - np.roll(tubes.points[bent, :3], -1, axis=1))
        bend = np.abs(ph.bend[bent])
        edge = np.argmax(np.where((ph.rough[bent] > 1.0)[:, None], bend, lengths), axis=1)
        halved = bisect(geometry, leg, tubes, bent, edge, first, rule.jitter)
        parted, _ = subdivide(geometry, leg, tubes, shaded, view.side, first, rule.jitter)
        tubes = Tubes.join([halved, parted])
    some, views, phases = zip(*kept, strict=True)
    if not geometry.convex_alone:
        found.add(Phases.join(list(phases)))
    way = View.join(list(views))
    return Tubes.join(list(some)), way.corners, way.passed
