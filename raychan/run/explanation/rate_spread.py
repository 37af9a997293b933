"""Detections of turning bodies, whose echoes spread over rates: their paths have one rate each, at the frame's middle,
so the map cells that they fill before and after it are explained from the retraced samples."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.records import Detections, Paths
from raychan.run.convergence import figure
from raychan.run.explanation.folding import aliased
from raychan.run.explanation.labels import Chains, chains, label_of, response_of
from raychan.run.explanation.seen_in_samples import seen_in
from raychan.run.ledger_entry import Entry
from raychan.run.receiver import quiet_map
from raychan.run.result import SIDELOBE, Contribution, Explanation, Receiver
from raychan.run.segments import Retraced
from raychan.signal.baseband import synthesize
from raychan.units import db

Floats = NDArray[np.float64]
_UNEXPLAINED = 0.1  # of a cell's power: a cell with less from turning bodies is noise (not measured)


def meets(paths: Paths, turns: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which paths (n,) meet one of the bodies `turns` (b,)."""
    body, kind = paths.trajectories.body, paths.trajectories.kind
    return np.asarray((turns[np.maximum(body, 0)] & (kind > 0)).any(axis=1))[paths.trajectory]


def without(paths: Paths, turns: NDArray[np.bool_]) -> Paths:
    """Return the paths that do not meet the bodies `turns` (b,)."""
    kept: Paths = take(paths, ~meets(paths, turns))
    return kept


def launch_share(paths: Paths, others: Paths, turns: NDArray[np.bool_], radar: Radar) -> float:
    """Return the relative power by which two launches differ in the echoes of turning bodies over the first ramp."""
    one = replace(radar, noise=False, waveform=replace(radar.waveform, n_chirps=1))
    a, b = (synthesize(take(p, meets(p, turns)), one).samples for p in (paths, others))
    power = float((np.abs(a) ** 2).sum())
    return float((np.abs(a - b) ** 2).sum()) / power if power > 0.0 else 0.0


def motion(turned: Retraced) -> Entry:
    """Return the ledger's entry of a frame that was traced more than once."""
    level = float(db(max(turned.level(), 1e-30)))
    ends = "" if turned.reached else "; further tracings do not reach the tolerance"
    how = f"traced {len(turned.times)} times within the frame; their difference, against the whole frame{ends}"
    return Entry(level, "estimate", how)


def claimed(
    reasons: tuple[Explanation, ...], paths: Paths, turned: Retraced, error: Floats, detections: Detections,
    receiver: Receiver, radar: Radar, settings: Any,
) -> tuple[Explanation, ...]:  # fmt: skip
    """Return the explanations, with cells that no path explains assigned to a turning body, and with the level and the
    error of all cells of turning bodies by the samples of these, which hold what constant rates do not.

    Args: error (v, r) [W] of the map of their echoes; settings of the processing. Of several turning bodies the one
    whose paths are nearest in range is taken.
    """
    rows = np.flatnonzero(meets(paths, turned.turns))
    if not len(rows):
        return reasons
    known, off = chains(paths, receiver.background), error[tuple(detections.cell.T)]
    power = quiet_map(turned.turning, radar, settings)[tuple(detections.cell.T)]
    brought, whole = (seen_in(x, detections, radar, settings) for x in (turned.turning, turned.samples))
    found = []
    for i, why in enumerate(reasons):
        if brought[i] < _UNEXPLAINED * why.power:
            found.append(why)
            continue
        why = replace(why, predicted=float(whole[i]), error_db=figure(float(power[i]), float(off[i])))
        # Paths at the frame's middle bring side lobes to what the body fills before and after it.
        if not why.contributions or why.label == SIDELOBE:
            why = _given(why, paths, rows, known, receiver)
        found.append(why)
    return tuple(found)


def _given(why: Explanation, paths: Paths, rows: NDArray[np.int64], known: Chains, receiver: Receiver) -> Explanation:
    """Return the explanation of a cell assigned to the strongest chain at its range, among `rows` of paths over turning
    bodies; the rate of that part of the body is not known."""
    response = response_of(receiver)
    at = response.stands(paths.delay[rows], paths.range_rate[rows], True)[0]
    away, folded = aliased(at, why.range, response)
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
