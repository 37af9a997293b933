"""Radar cross-section of a body by itself: the same tubes, fields and errors as in a scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.channel.collect import routes_of
from raychan.channel.fields import transfer
from raychan.channel.launch import launch
from raychan.channel.legs import Leg
from raychan.channel.surface import Surface
from raychan.channel.trace import bounce, settle
from raychan.channel.tubes import Refinement
from raychan.frames import theta_phi
from raychan.units import C0

Floats = NDArray[np.float64]


def scattering(surface: Surface, leg: Leg, out: Leg, frequency: float, bounces: int, rule: Refinement):
    f = surface.facets
    every = np.ones(len(f.role), bool)

    def basis(look):
        t, p = theta_phi(look)
        return np.stack([t, p], axis=1).astype(complex)

    tubes = launch(surface, leg, out, every, rule)
    n = len(tubes)
    total = np.zeros((2, 2), complex)
    per = []
    none = np.full((n, rule.layers), -1, np.int32)
    first = True
    for b in range(1, bounces + 1):
        if not len(tubes):
            break
        if first and out == leg:
            seen, corners, passed = tubes, np.zeros((n, 0, 3)), none
            # layers passed on the way in are passed on the way out
            for j in range(rule.layers):
                passed[:, j] = np.where(tubes.kinds[:, j] == 2, tubes.facets[:, j], -1)
        else:
            seen, corners, passed = settle(surface, leg, out, tubes, float(np.abs(total).max()), rule)
        r = routes_of(surface, leg, out, seen.take(np.arange(len(seen))), first, corners, passed)
        a = transfer(r, f, frequency, basis, basis)
        per.append(a.sum(axis=0))
        total = total + per[-1]
        if b < bounces:
            tubes = bounce(
                surface, leg, out, tubes, first, float(np.abs(total).max()) * 4 * np.pi * frequency / C0 / 1.0, rule
            )
        first = False
    return total, per, n
