"""Arcs of equal range about the radar, as the scale of a scene's picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.view.drawing import Drawing

Floats = NDArray[np.float64]

_MOST = 12  # arcs
_LIFT = 0.01  # m over the ground, or the arcs are hidden by it
_TURN = np.linspace(-np.pi, np.pi, 721)


@dataclass(frozen=True)
class Arc:
    """Points of one range [m] from the radar's foot point: lines (k, 3) [m], and the place (3,) [m] of their label."""

    range: float
    lines: tuple[Floats, ...]
    label: Floats


def axes(drawing: Drawing) -> tuple[Floats, Floats]:
    """Return the level unit vectors (3,) ahead of the radar and to its right."""
    ahead = drawing.boresight * [1.0, 1.0, 0.0]
    ahead = ahead / (np.linalg.norm(ahead) or 1.0)
    return ahead, np.cross(ahead, [0.0, 0.0, 1.0])


def arcs(drawing: Drawing) -> list[Arc]:
    """Return the arcs on the ground, or where there is none on a level under the scene, in steps of 1, 2 or 5."""
    low, high = drawing.floor()
    ahead, right = axes(drawing)
    reach = float(np.hypot(*np.maximum(drawing.radar - low, high - drawing.radar)[:2]))
    step = next(s for k in range(7) for s in (10.0**k, 2.0 * 10.0**k, 5.0 * 10.0**k) if reach <= _MOST * s)
    made = []
    for radius in np.arange(step, reach, step):
        arc = drawing.radar + radius * np.column_stack([np.cos(_TURN), np.sin(_TURN), 0.0 * _TURN])
        arc[:, 2] = low[2] + _LIFT
        inside = np.flatnonzero(((arc[:, :2] > low[:2]) & (arc[:, :2] < high[:2])).all(axis=1))
        runs = [run for run in np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1) if len(run) > 2]
        if runs:
            seen = arc[np.concatenate(runs)]
            front = seen[(seen - drawing.radar) @ ahead > 0.0]
            among = front if len(front) else seen
            made.append(Arc(float(radius), tuple(arc[run] for run in runs), among[np.argmax(among @ right)]))
    return made
