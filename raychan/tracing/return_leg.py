"""Settle: tubes that have landed are cut until their phase over a way out is simple and the way is seen or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.poses import sizes
from raychan.tracing.contributions import Contributions
from raychan.tracing.horizon import FACING, LIT, OBLIQUE
from raychan.tracing.launch import GAPS, RUNNING, sight
from raychan.tracing.legs import Leg, View
from raychan.tracing.subdivide import divide, halves
from raychan.tracing.tubes import Phases, Tubes, phases_of
from raychan.tracing.visibility import BENT, READY, SHADED, sort_out
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
    """Cut tubes until their phase over `out` is linear enough and the receiver sees all or nothing of each.

    What is seen counts as found. Args: first whether they stand on their first surface; veiled: only what is seen
    through a layer counts, and is returned; which of them radiate (see `tracing.horizon`). Returns: the seen tubes, and
    mirror points (n, m, 3) and layers (n, l) of their way out.
    """
    kept: list[tuple[Tubes, View, Phases]] = []
    rule = found.rule
    for level in range(rule.levels + 1):
        share, facing = out.radiating(tubes.points, tubes.k, tubes.normals, which)
        rows = np.flatnonzero(share > 0.0)
        tubes, share, facing = tubes.take(rows), share[rows], facing[rows]
        ph = phases_of(geometry, leg, out, tubes, rule)
        if which == OBLIQUE and not facing.all():
            # Beyond the horizon most is out of phase with its neighbours, and little of it counts.
            weak = np.flatnonzero(~facing)
            left = found.that_count(RUNNING * ph.bound[weak] * share[weak], ph.length[weak], 0)
            rows = np.sort(np.concatenate([np.flatnonzero(facing), weak[left]]))
            tubes, ph, facing = tubes.take(rows), ph.take(rows), facing[rows]
        matters = (ph.bound > found.prune_threshold(ph.length)) & (not found.budget.spent(geometry))
        # Of what little a scene sees of them, currents beyond the horizon are asked for by their centres alone.
        asked = matters if which == LIT else matters & facing
        view = sight(geometry, out, tubes, asked, first, rule, level < GAPS, beyond=~facing)
        cut = matters if level < rule.levels else np.zeros_like(matters)
        if veiled:
            view.centre.seen[(view.centre.passed < 0).all(axis=1)] = False
        how = facing, view.centre.seen, view.some, view.mixed, ph.rough
        what = sort_out(*how, cut)
        wanted = (what == BENT) | (what == SHADED)
        cut &= ~wanted | found.budget.affords(geometry, tubes.facet, wanted)
        what = sort_out(*how, cut)
        ready, bent, shaded = (np.flatnonzero(what == w) for w in (READY, BENT, SHADED))
        kept.append((tubes.take(ready), view.centre.take(ready), ph.take(ready)))
        if not len(bent) and not len(shaded):
            break
        # Where phases run alike along all edges, the longest is cut.
        lengths = sizes(tubes.points[bent, :3] - np.roll(tubes.points[bent, :3], -1, axis=1))
        bend = np.abs(ph.bend[bent])
        edge = np.argmax(np.where((ph.rough[bent] > 1.0)[:, None], bend, lengths), axis=1)
        halved = halves(geometry, leg, tubes, bent, edge, first, rule.jitter)
        parted, _ = divide(geometry, leg, tubes, shaded, view.side, first, rule.jitter)
        tubes = Tubes.join([halved, parted])
    some, views, phases = zip(*kept, strict=True)
    if not geometry.convex_alone:
        found.add(Phases.join(list(phases)))
    way = View.join(list(views))
    return Tubes.join(list(some)), way.corners, way.passed
