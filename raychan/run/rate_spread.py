"""Spread: what turning bodies bring to a map beyond the rates that their paths have at the frame's start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import Detections, Paths
from raychan.run.convergence import figure
from raychan.run.folding import aliased
from raychan.run.labels import Chains, chains, label_of, response_of
from raychan.run.result import Contribution, Explanation, Receiver
from raychan.run.segments import Retraced
from raychan.run.unmodelled import Entry
from raychan.signal.baseband import synthesize
from raychan.units import db

Floats = NDArray[np.float64]
_UNEXPLAINED = 0.1  # a cell to which turning bodies bring less than this share of its power is noise


def meets(paths: Paths, turns: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell which paths (n,) meet one of the bodies `turns` (b,)."""
    body, kind = paths.ways.body, paths.ways.kind
    return np.asarray((turns[np.maximum(body, 0)] & (kind > 0)).any(axis=1))[paths.way]


def without(paths: Paths, turns: NDArray[np.bool_]) -> Paths:
    """Return the paths that do not meet the bodies `turns` (b,)."""
    kept: Paths = take(paths, ~meets(paths, turns))
    return kept


def launch_share(paths: Paths, others: Paths, turns: NDArray[np.bool_], radar: Radar) -> float:
    """Return by which share of their power two launches differ in what turning bodies bring to the first ramp."""
    one = replace(radar, noise=False, waveform=replace(radar.waveform, n_chirps=1))
    a, b = (synthesize(take(p, meets(p, turns)), one).samples for p in (paths, others))
    power = float((np.abs(a) ** 2).sum())
    return float((np.abs(a - b) ** 2).sum()) / power if power > 0.0 else 0.0


def motion(turned: Retraced) -> Entry:
    """Return the ledger's entry of a frame that was traced more than once."""
    level = float(db(max(turned.level(), 1e-30)))
    ends = "" if turned.reached else "; more of them do not bring it under the tolerance"
    how = f"traced {len(turned.times)} times within the frame; what they differ by, against the whole frame{ends}"
    return Entry(level, "estimate", how)


def claimed(
    reasons: tuple[Explanation, ...], paths: Paths, turns: NDArray[np.bool_], power: Floats, error: Floats,
    detections: Detections, receiver: Receiver,
) -> tuple[Explanation, ...]:  # fmt: skip
    """Return the explanations with those cells that no path explains given to the turning body that filled them, and
    the error of all that turning bodies filled against what they brought.

    Args: turns (b,) which bodies turn; power, error (v, r) [W] of the map of what turning bodies brought, and how wrong
    it may be. Of several such bodies it is the one whose paths come nearest in range.
    """
    rows = np.flatnonzero(meets(paths, turns))
    if not len(rows):
        return reasons
    known = chains(paths, receiver.background)
    found = []
    for i, why in enumerate(reasons):
        brought = float(power[tuple(detections.cell[i])])
        if brought < _UNEXPLAINED * why.power:
            found.append(why)
            continue
        off = figure(brought, float(error[tuple(detections.cell[i])]))
        why = replace(why, predicted=brought, error_db=off)
        if not why.contributions:
            why = _given(why, paths, rows, known, receiver)
        found.append(why)
    return tuple(found)


def _given(why: Explanation, paths: Paths, rows: NDArray[np.int64], known: Chains, receiver: Receiver) -> Explanation:
    """Return the explanation of a cell given to the chain, among `rows` of paths over turning bodies, that is strongest
    at the cell's range; at which rate it turns there is not known."""
    at = 0.5 * paths.length[rows]
    away, folded = aliased(at, why.range, response_of(receiver))
    near = away <= away.min() + receiver.waveform.range_resolution
    chain, strength = known.part[rows], np.abs(paths.amplitude[rows]) ** 2
    leading = int(np.argmax(np.bincount(chain, strength * near, len(known.names))))
    mine = np.flatnonzero((chain == leading) & near)
    strongest = int(mine[np.argmax(strength[mine])])
    label = label_of(paths, int(rows[strongest]), known.bodies[leading], receiver)
    names, met = known.names[leading], len(known.bodies[leading])
    part = Contribution(names, met, why.range, why.rate, 1.0, len(mine))
    same = mine[folded[mine] == folded[strongest]]
    true = float(np.average(at[same], weights=strength[same]))
    return replace(why, label=label, contributions=(part,), folded=bool(folded[strongest]), true_range=true)
