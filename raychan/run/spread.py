"""Spread: detections that a turning body brought away from where its paths were at the frame's start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from raychan.channel.rcs import stated_error
from raychan.run.provenance import chains, label_of
from raychan.run.result import Contribution, Explanation, Receiver
from raychan.tables import Detections, Paths
from raychan.units import C0

Floats = NDArray[np.float64]
_UNEXPLAINED = 0.1  # a cell to which turning bodies bring less than this share of its power is noise


def claimed(
    reasons: tuple[Explanation, ...], paths: Paths, turns: NDArray[np.bool_], power: Floats, error: Floats,
    detections: Detections, receiver: Receiver,
) -> tuple[Explanation, ...]:  # fmt: skip
    """Return the explanations with those cells that no path explains given to the turning body that filled them, and
    the error of all that turning bodies filled against what they brought.

    Args: turns (b,) which bodies turn; power, error (v, r) [W] of the map of what turning bodies brought, and how wrong
    it may be. Of several such bodies it is the one whose paths come nearest in range.
    """
    rows = np.flatnonzero((turns[np.maximum(paths.body, 0)] & (paths.kind > 0)).any(axis=1))
    if not len(rows):
        return reasons
    known = chains(paths, receiver.background)
    strength = np.abs(paths.amplitude[rows]) ** 2
    found = []
    for i, why in enumerate(reasons):
        brought = float(power[tuple(detections.cell[i])])
        if brought < _UNEXPLAINED * why.power:
            found.append(why)
            continue
        off = stated_error(complex(np.sqrt(brought)), float(np.sqrt(error[tuple(detections.cell[i])])))
        why = replace(why, predicted=brought, error_db=off)
        if not why.contributions:
            away = np.abs(0.5 * C0 * paths.delay[rows] - why.range)
            near = away <= away.min() + receiver.waveform.range_resolution
            chain = known.part[rows]
            leading = int(np.argmax(np.bincount(chain, strength * near, len(known.names))))
            mine = rows[(chain == leading) & near]
            strongest = int(mine[np.argmax(np.abs(paths.amplitude[mine]))])
            label = label_of(paths, strongest, known.bodies[leading], receiver)
            names, met = known.names[leading], len(known.bodies[leading])
            part = Contribution(names, met, why.range, why.rate, 1.0, len(mine))
            why = replace(why, label=label, contributions=(part,))
        found.append(why)
    return tuple(found)
