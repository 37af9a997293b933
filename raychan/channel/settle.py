"""Settle: tubes that have landed are cut until their phase over a way out is simple and the way is seen or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.found import Found
from raychan.channel.launch import GAPS, divide, sight
from raychan.channel.legs import Leg
from raychan.channel.surface import Surface
from raychan.channel.tubes import CENTRE, Tubes, halves, phases_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def settle(
    surface: Surface, leg: Leg, out: Leg, tubes: Tubes, found: Found, first: bool = False
) -> tuple[Tubes, Floats, Ints]:
    """Cut tubes until their phase over `out` is linear enough and the receiver sees all or nothing of each.

    Returns: the seen tubes, and mirror points (n, m, 3) and layers (n, l) of their way out.
    """
    kept, ways, layers = [], [], []
    rule = found.rule
    for level in range(rule.levels + 1):
        ph = phases_of(surface, leg, out, tubes, first, rule)
        matters = ph.bound > found.doubt(ph.length)
        view = sight(surface, out, tubes, matters, first, rule, level < GAPS)
        back = np.einsum("nj,nj->n", out.rays(tubes.points[:, CENTRE])[0], tubes.normals[:, CENTRE])
        lit = back < 0.0
        rough = lit & view.some & (ph.rough > 1.0)
        mixed = lit & view.mixed
        split = (mixed | rough) & matters & (level < rule.levels)
        ready = ~split & lit & view.centre.seen
        kept.append(tubes.take(ready))
        ways.append(view.centre.corners[ready])
        layers.append(view.centre.passed[ready])
        if not split.any():
            break
        # Bends come first: they need an edge of their own.
        bent, shaded = np.flatnonzero(split & rough), np.flatnonzero(split & ~rough)
        edge = np.argmax(np.abs(ph.bend[bent]), axis=1)
        halved = halves(surface, leg, tubes.take(bent), edge, first, rule.jitter)
        parted, _ = divide(surface, leg, tubes.take(shaded), shaded, view.side[shaded], first, rule)
        tubes = Tubes.join([halved, parted])
    return Tubes.join(kept), np.concatenate(ways), np.concatenate(layers)
