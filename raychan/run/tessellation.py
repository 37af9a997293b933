"""Tessellation: what it may change that a mesh's facets stand for a smooth surface, by how deep that bends them."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from raychan.radar.radar import Radar
from raychan.records import BLOCKER, Paths
from raychan.run.mechanisms import peak
from raychan.world.geometry import Geometry

_OPPOSED = 2.0  # of a field: the most that a phase can change it by


def strongest_bend(
    paths: Paths, geometry: Geometry, names: Collection[str], radar: Radar, settings: Any
) -> tuple[str, float, float]:
    """Return of the bodies named the one whose strongest cell the surface between its facets may change most: its name,
    its phase [rad] and the change [W]; '' where none of them is bent or returns.

    Smooth facets lie off the flat ones by their sag, a quarter of the bulge of an edge, and the way there and back by
    2 k times that: the rms over the body's area is how far the field of flat facets is off.
    """
    f, k = geometry.facets, 2.0 * np.pi / radar.waveform.wavelength
    found = ("", 0.0, 0.0)
    for body, name in enumerate(f.body_names):
        rows = np.flatnonzero((f.body == body) & geometry.curved)
        if name not in names or not len(rows) or f.role[body] == BLOCKER:
            continue
        sag = 0.25 * np.linalg.norm(geometry.edge_curvature[rows], axis=2)
        phase = 2.0 * k * float(np.sqrt(np.average((sag**2).mean(axis=1), weights=geometry.area[rows])))
        met = ((paths.ways.body == body) & (paths.ways.kind > 0)).any(axis=1)[paths.way]
        changed = min(phase, _OPPOSED) ** 2 * peak(paths, met, radar, settings)
        if changed > found[2]:
            found = (name, phase, changed)
    return found
