"""What the next step of a refinement traces again: what brings cells within their tolerance for few rays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.run.refinement.budget import FORESEEN, SECONDS, STEPS, Budget
from raychan.run.refinement.map_cells import MapCells
from raychan.run.refinement.seconds import StepRays
from raychan.tracing.source_rays import SourceRays
from raychan.tracing.sources import Sources, without_out
from raychan.tracing.stats import Stats

Floats = NDArray[np.float64]

SLOW = "changes that shrink too slowly for more steps to help"
_HOPE = 0.1  # of the rays left: so many cells may take that are not expected to be reached (not measured)
_SURE = 3  # steps from which on cells are given up for the steps or rays that they would take (not measured)
_GROWTH = 1.6
"""Rays of a cell's step over those of the one before: ever fewer sources keep it open. At 2.2, as for one source, cells
are given up before half of the rays that are left is spent: 90 % of the detections of `bench.detections`, seeds 9640 to
9759, at 0.5 dB are within it, 93 % at 1.6, by 16 and 21 million rays."""
_LESS = 0.7  # of the rays of a plan, at most, may be planned where its step would end too late (not measured)


def next_step(
    cells: MapCells, rays: SourceRays, cost: StepRays, budget: Budget, so_far: Stats, steps: int
) -> tuple[Sources, float, str]:
    """Return the sources to trace again, when that must have ended, and what ends the refinement, '' if nothing does.

    Args: so_far what launches took; steps that are left.
    """
    left, which = budget.left(so_far)
    while True:
        wanted, planned_rays, ended = planned(cells, rays, (left, which), steps)
        if not ended and len(wanted):
            ended = budget.ended(so_far, planned_rays)
        if ended or not len(wanted):
            return wanted, math.inf, ended
        foreseen, within = cost.of(wanted, rays.next_step(wanted)), budget.pace.rays
        if foreseen <= within:
            return wanted, budget.pace.end(foreseen), ""
        # A step takes more rays than its plan counts: so much less may be planned.
        left, which = min(left, planned_rays) * min(within / foreseen, _LESS), SECONDS


def planned(cells: MapCells, rays: SourceRays, budget: tuple[float, str], steps: int) -> tuple[Sources, float, str]:
    """Return the sources to trace again, how many rays that takes, about, and, where open cells have none, why.

    Cells that take fewest rays come first. After some steps those that are not expected to be reached by the rays that
    are left wait, and by the steps that are left, unless they take few: what they would take is lost.

    Args: budget the rays that are left, and what does not allow more; steps that are left.
    """
    left, which = budget
    opened, needs = np.flatnonzero(cells.open).tolist(), cells.steps
    every = np.unique(np.concatenate([np.zeros(0, np.int64), *(cells.sources(i) for i in opened)]))
    launch, cost = without_out(every), _GROWTH * rays.of(every)
    wanted, needed = dict[int, list[Sources]](), dict[int, float]()
    for i in opened:
        at, place = np.searchsorted(every, cells.sources(i)), i % len(cells.place)
        wanted.setdefault(place, []).append(cells.wanted(i, cost[at], launch[at]))
        needed[place] = max(needed.get(place, 0.0), float(needs[i]))
    rows = {p: np.searchsorted(every, np.unique(np.concatenate(x))) for p, x in wanted.items()}
    rows = {p: r for p, r in rows.items() if len(r)}
    if not rows or steps <= 0:
        ended = SLOW if steps > 0 else f"{STEPS} steps"
        return every[:0], 0.0, ended if opened else ""
    # How changes shrink is not known before some: until then a step must be paid for, not all that follow.
    known = STEPS - steps >= _SURE
    series = {p: (_GROWTH ** min(n, steps) - 1.0) / (_GROWTH - 1.0) if known else 1.0 for p, n in needed.items()}
    hope = {p: _HOPE if known and n > steps else 1.0 for p, n in needed.items()}
    taken, spent, again = np.zeros(0, np.int64), 0.0, np.zeros(len(every), bool)
    for p in sorted(rows, key=lambda p: series[p] * _sum(cost, launch, rows[p])):
        more = series[p] * _sum(cost, launch, rows[p][~np.isin(launch[rows[p]], taken)])
        if spent + more <= hope[p] * left:
            spent, again[rows[p]] = spent + more, True
            taken = np.union1d(taken, launch[rows[p]])
    ended = which + (FORESEEN if left > 0.0 else "") if max(hope[p] for p in rows) == 1.0 else SLOW
    return every[again], _sum(cost, launch, np.flatnonzero(again)), "" if again.any() else ended


def _sum(cost: Floats, launch: Sources, rows: NDArray[np.intp]) -> float:
    """Return the rays of some rows, those traced together once."""
    _, first = np.unique(launch[rows], return_index=True)
    return float(cost[rows[first]].sum())
