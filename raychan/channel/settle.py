"""Settle: tubes that have landed are cut until their phase over a way out is simple and the way is seen or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.cut import divide, halves
from raychan.channel.found import Found
from raychan.channel.launch import GAPS, sight
from raychan.channel.legs import Leg, View
from raychan.channel.surface import Surface
from raychan.channel.tubes import Phases, Tubes, phases_of
from raychan.kernels.sight import BENT, READY, SHADED, sort_out

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def settle(
    surface: Surface, leg: Leg, out: Leg, tubes: Tubes, found: Found, first: bool = False, veiled: bool = False
) -> tuple[Tubes, Floats, Ints]:
    """Cut tubes until their phase over `out` is linear enough and the receiver sees all or nothing of each.

    What is seen counts as found; if `veiled` only what is seen through a layer does, and is returned. Returns: the seen
    tubes, and mirror points (n, m, 3) and layers (n, l) of their way out.
    """
    kept: list[tuple[Tubes, View, Phases]] = []
    rule = found.rule
    for level in range(rule.levels + 1):
        ph = phases_of(surface, leg, out, tubes, rule)
        matters = ph.bound > found.doubt(ph.length)
        view = sight(surface, out, tubes, matters, first, rule, level < GAPS)
        cut = matters if level < rule.levels else np.zeros_like(matters)
        if veiled:
            view.centre.seen[(view.centre.passed < 0).all(axis=1)] = False
        seen = view.centre.seen, view.some, view.mixed
        what = sort_out(tubes.points, tubes.normals, out.image, out.far, *seen, ph.rough, cut)
        ready, bent, shaded = (np.flatnonzero(what == w) for w in (READY, BENT, SHADED))
        kept.append((tubes.take(ready), view.centre.take(ready), ph.take(ready)))
        if not len(bent) and not len(shaded):
            break
        edge = np.argmax(np.abs(ph.bend[bent]), axis=1)
        halved = halves(surface, leg, tubes, bent, edge, first, rule.jitter)
        parted, _ = divide(surface, leg, tubes, shaded, view.side, first, rule.jitter)
        tubes = Tubes.join([halved, parted])
    some, views, phases = zip(*kept, strict=True)
    if not surface.convex_alone:
        found.add(Phases.join(list(phases)))
    way = View.join(list(views))
    return Tubes.join(list(some)), way.corners, way.passed
