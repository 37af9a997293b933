"""Detections of turning bodies, whose echoes spread over rates: their paths have one rate each, at the frame's middle,
so the map cells that they fill before and after it are explained from the retraced samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import take
from raychan.radar.radar import Radar
from raychan.radar.side_lobes import main_lobe
from raychan.records import Detections, MapError, Paths, RangeDoppler
from raychan.run.convergence import figure
from raychan.run.explanation.directions import UNEXPLAINED
from raychan.run.explanation.folding import Shown, aliased, peaks_of
from raychan.run.explanation.labels import Chains, chains, label_of, response_of
from raychan.run.explanation.other_tracings import seen_best, seen_in_range, standing
from raychan.run.explanation.seen_in_samples import seen_in
from raychan.run.ledger_entry import Entry
from raychan.run.receiver import quiet_map
from raychan.run.result import SIDELOBE, Contribution, Explanation, Receiver
from raychan.run.segments import Retraced
from raychan.signal.baseband import synthesize
from raychan.units import db

Floats = NDArray[np.float64]


def meets(paths: Paths, turns: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which paths (n,) meet one of the bodies `turns` (b,)."""
    body, kind = paths.trajectories.body, paths.trajectories.kind
    return np.asarray((turns[np.maximum(body, 0)] & (kind > 0)).any(axis=1))[paths.trajectory]


def without(paths: Paths, turns: NDArray[np.bool_]) -> Paths:
    """Return the paths that do not meet the bodies `turns` (b,)."""
    kept: Paths = take(paths, ~meets(paths, turns))
    return kept


def launch_share(
    paths: Paths, others: Paths, turns: NDArray[np.bool_], brought: Floats, radar: Radar, settings: Any
) -> Floats:
    """Return the relative power (r,) by which two launches at mid-frame differ in the echoes of bodies that are carried
    on, over the main lobe about each range of the map: of each body by itself where they stand at ranges of their own.

    Args: brought, map (v, r) [W] of these echoes; where mid-frame has little of it, all ranges together count too."""
    own = replace(radar, noise=False)
    a, b = (synthesize(take(p, meets(p, turns)), own).samples for p in (paths, others))
    half = int(np.ceil(main_lobe(settings.range_window, radar.waveform.n_samples) * settings.pad[1]))
    levels = [x.sum(axis=0) for x in (quiet_map(a, radar, settings), quiet_map(a - b, radar, settings), brought)]
    power, change, there = (np.convolve(x, np.ones(2 * half + 1))[half : half + len(x)] for x in levels)
    share = np.divide(change, power, out=np.zeros(len(power)), where=power > 0.0)
    whole = float(change.sum() / power.sum()) if power.any() else 0.0
    return np.where(power >= UNEXPLAINED * there, share, np.maximum(share, whole))


def motion(turned: Retraced) -> Entry:
    """Return the ledger's entry of a frame that was traced more than once."""
    level = float(db(max(turned.level(), 1e-30)))
    ends = "" if turned.reached else "; further tracings do not reach the tolerance"
    how = f"traced {len(turned.times)} times within the frame; their difference, against the whole frame{ends}"
    return Entry(level, "estimate", how)


def claimed(
    reasons: tuple[Explanation, ...], paths: Paths, turned: Retraced,
    detected: tuple[RangeDoppler, Detections, MapError], receiver: Receiver, radar: Radar, settings: Any,
) -> tuple[Explanation, ...]:  # fmt: skip
    """Return the explanations, with cells that no path of the middle explains assigned to what the tracing has in which
    they are strongest, or to a turning body, and with the level and the error of all cells of turning bodies by the
    samples of these, which hold what constant rates do not.

    Args: detected, the map of the receiver, its detections and its error; settings of the processing. Of several
    turning bodies of which no tracing explains the cell, the one whose paths are nearest in range is taken.
    """
    rdmap, detections, error = detected
    cells, middle = tuple(detections.cell.T), _Middle.of(paths, turned.turns, receiver)
    off, power = error.power[cells], quiet_map(turned.turning, radar, settings)[cells]
    brought, whole = (seen_in(x, detections, radar, settings) for x in (turned.turning, turned.samples))
    at, tracings = peaks_of(detections, rdmap, response_of(receiver)), list[Paths]()
    found = []
    for i, why in enumerate(reasons):
        turns = brought[i] >= UNEXPLAINED * why.power
        if turns:
            why = replace(why, predicted=float(whole[i]), error_db=figure(float(power[i]), float(off[i])))
        # Paths at the frame's middle bring side lobes to what the body fills before and after it.
        nothing = not why.contributions or (turns and why.label == SIDELOBE)
        if nothing and (turns or whole[i] >= UNEXPLAINED * why.power):
            tracings = tracings or [standing(x, late, receiver) for x, late in turned.tracings]
            shown = Shown(float(at[i, 0]), float(at[i, 1]), float(detections.rate[i]))
            seen = seen_best(tracings, shown, why.power, receiver)
            if turns and not seen and not middle.near(why.range).any():
                turning = [take(x, meets(x, turned.turns)) for x in tracings]
                seen = seen_in_range(turning, shown, receiver)
            if turns and middle.has(seen.names if seen else None, why.range):
                why = middle.explains(why, seen.names if seen else None)
            elif seen:
                error_db = why.error_db if turns else figure(float(whole[i]), float(off[i]))
                why = replace(seen.explains(why, shown, receiver), predicted=float(whole[i]), error_db=error_db)
        found.append(why)
    return tuple(found)


@dataclass(frozen=True)
class _Middle:
    """Paths over turning bodies at the middle of the frame, `rows` of all paths."""

    paths: Paths
    rows: NDArray[np.int64]
    known: Chains
    receiver: Receiver

    @staticmethod
    def of(paths: Paths, turns: NDArray[np.bool_], receiver: Receiver) -> _Middle:
        return _Middle(paths, np.flatnonzero(meets(paths, turns)), chains(paths, receiver.background), receiver)

    def has(self, names: tuple[str, ...] | None, range: float) -> bool:
        """Return whether a chain of such names, or any, is near a range [m]."""
        if names is None:
            return len(self.rows) > 0
        chain = self.known.part[self.rows][self.near(range)]
        return any(self.known.names[g] == names for g in np.unique(chain))

    def near(self, range: float) -> NDArray[np.bool_]:
        """Return which paths (n,) are within a cell of a range [m]."""
        return np.asarray(self._away(range)[0] <= self.receiver.waveform.range_resolution)

    def explains(self, why: Explanation, names: tuple[str, ...] | None) -> Explanation:
        """Return the explanation of a cell assigned to the strongest chain at its range, of such names where it has
        any; the rate of that part of the body is not known."""
        paths, rows, known = self.paths, self.rows, self.known
        away, folded, at = self._away(why.range)
        near = away <= away.min() + self.receiver.waveform.range_resolution
        chain, strength = known.part[rows], np.abs(paths.amplitude[rows]) ** 2
        if names is not None:
            near &= np.array([x == names for x in known.names])[chain]
        leading = int(np.argmax(np.bincount(chain, strength * near, len(known.names))))
        mine = np.flatnonzero((chain == leading) & near)
        strongest = int(mine[np.argmax(strength[mine])])
        label = label_of(paths, int(rows[strongest]), known.bodies[leading], self.receiver)
        part = Contribution(known.names[leading], len(known.bodies[leading]), why.range, why.rate, 1.0, len(mine))
        same = mine[folded[mine] == folded[strongest]]
        true = float(np.average(at[same], weights=strength[same]))
        return replace(why, label=label, contributions=(part,), folded=bool(folded[strongest]), true_range=true)

    def _away(self, range: float) -> tuple[Floats, NDArray[np.bool_], Floats]:
        """Return how far (n,) [m] paths stand from a range [m], whether they are folded there, and their ranges."""
        response = response_of(self.receiver)
        at = response.stands(self.paths.delay[self.rows], self.paths.range_rate[self.rows], True)[0]
        return *aliased(at, range, response), at
