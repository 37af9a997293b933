"""Map cells that are or may become detections: their levels, what launches changed of these, source by source, and
which sources of tubes are to be traced again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import COVER
from raychan.run.refinement.source_changes import Changes, class_of
from raychan.tracing.sources import EXACT, Sources, held_in

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating]
Bools = NDArray[np.bool_]

_LEFT = 0.3
"""Of the tolerance, as an amplitude: so much tubes may bring that are not traced again, shallow and deep each. With
half of the tolerance for shallow ones `bench.detections`, seeds 10000 to 10058, takes 2.6 % fewer rays, and 64 in place
of 66 of 74 levels are within 0.5 dB."""
_UNTRACED = 0.44
"""Share of the rms sum of shallow tubes not traced again by which they may be wrong, over COVER: covers 95 % of
what tracing them brings in 335 levels of `bench.detections`, seeds 0 to 69. The first launch cuts stronger tubes finer:
what these change by says nothing of weak ones."""
_KNOWN = 0.1  # of their rms sum: the weakest of these tubes are not kept one by one
# Of the tolerance, as an amplitude: so much the last changes of sources may add up to that are not refined.
_REST = 0.15
ALONG = math.sqrt(0.5)
"""Share of an error's amplitude, rms, that lies along a level and changes it: their phases are unrelated. Of 106 levels
of `bench.detections`, seeds 9700 to 9759, refined until they are within, 99 % lie within what is stated with it or
without."""
_CLAIMED = 0.1
"""Of the tolerance: no smaller error of tubes is stated, for what feeds a cell least is not traced again. Of such
levels 99 % lie within what is stated with it, 98 % with half of it."""
_ROOM = 0.9  # of the tolerance: the rest is for what is under the noise, and for neighbouring cells
_NOTHING = 1e-3  # of the tolerance, as an amplitude: smaller changes are not kept one by one
_FIRM, _HELD = 0.7, 0.5
"""A doubt that has not shrunk by _FIRM is one of errors that come by chance, and the next one may be small by chance:
_HELD of it counts on, until another change is small as well. With it 73 of 76 levels of `bench.detections`, seeds 9700
to 9759 at 1 dB, lie within what is stated, without 72."""
_SHRINK = 0.65  # factor on doubts a step, as long as a cell has not told its own: median of the same seeds
_FAST, _SLOW = 0.4, 0.75  # limits of such factors that cells tell by few steps (not measured)
# Of the rms sum of a cell's changes: those of sources that bring least a ray wait. Urban's second step takes 0.25 of
# the rays that all but _REST take, and leaves the same cells open.
_PART = 0.3


class MapCells:
    """Levels in map cells that are or may become detections, of all cells at one pair of elements after the other:
    `level` (n,), the sum of paths there; `tubes` (n,), the rms sum of what tubes bring; `left` (n,), the sum of deep
    ones that are never traced again; `tolerance` (n,), by which share of its amplitude a level may be wrong. `place`
    (c, 3) of the cells: range [m], rate [m/s] and amplitude.

    Args: level (p, c) at each pair of elements, whose mean power a tolerance counts from, or (c,) at one.
    """

    def __init__(self, place: Floats, level: Complexes, tolerance_db: float) -> None:
        level = np.atleast_2d(level)
        self.place, self.level = place, level.ravel()
        self.left, self._least = np.zeros(len(self.level), complex), np.zeros(len(self.level))
        self.tubes = np.zeros(len(self.level))
        none = np.zeros(0, np.int64), np.zeros(0)
        self._weak, self._untraced = [none for _ in self.level], np.zeros(len(self.level))
        self.tolerance = np.full(len(self.level), 1.0 - 10.0 ** (-tolerance_db / 20.0))
        if len(level) > 1:
            mean = np.sqrt((np.abs(level) ** 2).mean(axis=0))
            self.tolerance *= (mean / np.maximum(np.abs(level), 1e-300)).ravel()
        self._changes = [Changes.none() for _ in self.level]
        self._before = np.full(len(self.level), np.inf)
        self._shrunk, self._told = np.zeros(len(self.level)), np.zeros(len(self.level))
        self._held, self._older = np.zeros(len(self.level)), np.full(len(self.level), np.inf)

    def __len__(self) -> int:
        return len(self.level)

    def cell_of(self, i: int) -> Floats:
        """Return the place (3,) of the cell of level i."""
        return np.asarray(self.place[i % len(self.place)])

    @property
    def settled(self) -> list[tuple[float, float]]:
        """Ranges and rates of the cells that are refined no further and of which each level is within its tolerance."""
        left = np.flatnonzero(self.open | (self.doubt > np.abs(self.level) * self.tolerance)) % max(len(self.place), 1)
        return [(float(at[0]), float(at[1])) for at in np.delete(self.place, left, axis=0)]

    def loosened(self, spread_db: Floats) -> list[tuple[float, float]]:
        """Let levels be wrong by what displaced bodies move them, (c,) [dB], where that is more; return the ranges and
        rates of these cells."""
        speckle = 1.0 - 10.0 ** (-spread_db / 20.0)
        rows = speckle > self.tolerance[: len(speckle)]
        self.tolerance = np.maximum(self.tolerance, np.tile(speckle, len(self) // max(len(speckle), 1)))
        return [(float(at[0]), float(at[1])) for at in self.place[rows]]

    def spare(self, least: Floats) -> None:
        """Let levels below amplitudes (c,), from which on cells are detections or peaks, be wrong by what keeps them
        from it."""
        self._least = np.tile(least, len(self) // max(len(least), 1))

    def weak(self, i: int, source: Sources, sums: Complexes) -> None:
        """Note what weak shallow sources (s,) bring in cell i, which need not be traced again for it."""
        power = np.abs(sums) ** 2
        order = np.argsort(-power)
        kept = order[np.cumsum(power[order]) - power[order] < (1.0 - _KNOWN**2) * power.sum()]
        self._weak[i], self._untraced[i] = (source[kept], power[kept]), _UNTRACED * math.sqrt(power[kept].sum())

    def traced(self, source: Sources) -> None:
        """Note which sources (s,), in order, the first step traced again: the other weak ones stay as they are."""
        left = [power[~held_in(source, own)].sum() for own, power in self._weak]
        self._untraced = _UNTRACED * np.sqrt(np.array(left))

    @property
    def allowed(self) -> Floats:
        """By which share of its amplitude (c,) a level may be wrong: the tolerance, or what a weak one lacks."""
        return np.maximum(self.tolerance, self._least / np.maximum(np.abs(self.level), 1e-300) - 1.0)

    def changed(self, i: int, source: Sources, by: Complexes) -> None:
        """Note by what sources (s,), in order, changed cell i."""
        self.level[i] += by.sum()
        least = _NOTHING * self.tolerance[i] * abs(self.level[i])
        self._changes[i] = self._changes[i].with_more(source, by, least)

    @property
    def doubt(self) -> Floats:
        """What may be wrong of each level (c,), as an amplitude: what may still change, a share of what that was a step
        before where it had not shrunk then, and the least that is stated of tubes."""
        held = self._held * _ROOM * np.abs(self.level) * self.allowed
        least = np.minimum(_CLAIMED * self.tolerance * np.abs(self.level), self.tubes)
        return np.maximum(np.maximum(self._open_doubt, held), least)

    @property
    def _open_doubt(self) -> Floats:
        """What may still change of each level (c,)."""
        return np.array([self._open_doubt_of(i) for i in range(len(self))])

    def _open_doubt_of(self, i: int) -> float:
        """Return the sum of what may still change of level i and of deep tubes never cut, or, where that cancels, their
        rms sum; and, in squares, what shallow tubes that were not traced again may be wrong by."""
        whole, rms = self._changes[i].sums
        sizes = abs(whole.sum() + self.left[i]), float(np.hypot(np.hypot(*rms), abs(self.left[i])))
        return ALONG * COVER * math.hypot(max(sizes), self._untraced[i])

    @property
    def change(self) -> Floats:
        """By how much (c, 2) shallow and deep tubes may still change each level, rms sums."""
        return np.array([c.sums[1] for c in self._changes]).reshape(-1, 2)

    def doubt_by_source(self, i: int) -> tuple[Sources, Floats]:
        """Return the sources (n,) that changed cell i, and what may still change (n,) by each, over COVER."""
        return self._changes[i].source, self._changes[i].doubt

    def slowness(self, i: int) -> tuple[Sources, Floats, Floats]:
        """Return the sources (n,) that changed cell i, by what factor (n,) the error of each exceeds COVER times its
        last change, and what share (n,) of what is allowed the latter is."""
        known = self._changes[i]
        return known.source, known.slowness, np.abs(known.change) / max(abs(self.level[i]) * self.allowed[i], 1e-300)

    @property
    def over(self) -> Floats:
        """What may be wrong of each level over what is allowed of it (c,)."""
        return self._open_doubt / np.maximum(_ROOM * np.abs(self.level) * self.allowed, 1e-300)

    @property
    def open(self) -> Bools:
        """Which levels (c,) are to be refined further."""
        return np.asarray(((self.over > 1.0) | self._to_confirm) & self.change.any(axis=1))

    @property
    def _to_confirm(self) -> Bools:
        """Which levels (c,) one change brought within their tolerance although the doubt before had not shrunk: another
        change tells whether it was small by chance."""
        return np.asarray((self.over <= 1.0) & (self._held > 1.0))

    def stepped(self) -> None:
        """Note what a step has made of the doubts."""
        before, self._before, old = self._before, self.over, self._older
        self._held, self._older = np.where(before > _FIRM * old, _HELD * before, 0.0), before
        told = np.isfinite(before) & (before != self._before) & (before > 0.0)
        self._shrunk[told] += np.log(np.maximum(self._before[told], 1e-9) / before[told])
        self._told += told

    @property
    def steps(self) -> Floats:
        """How many steps (c,) it takes to bring each level within its tolerance, about, by what steps brought so far:
        the doubt of one step may be large or small by chance."""
        shrink = np.clip(np.exp((math.log(_SHRINK) + self._shrunk) / (1.0 + self._told)), _FAST, _SLOW)
        over = np.where(np.isfinite(self._before), np.sqrt(self._before * shrink * self.over), self.over)
        return np.asarray(np.maximum(np.ceil(np.log(np.maximum(over, 1.0)) / -np.log(shrink)), 1.0))

    def sources(self, i: int) -> Sources:
        """Return the sources (n,) that changed cell i."""
        return self._changes[i].source

    def wanted(self, i: int, rays: Floats, launch: Sources) -> Sources:
        """Return the sources whose last changes keep cell i open, without those that bring least a ray, as long as
        neither their sum nor their rms sum exceeds what may stay; all that changed it where that is to be confirmed.

        Args: rays (n,) that it takes to trace each source again; launch (n,) one number for all traced together.
        """
        known, allowed = self._changes[i], self.allowed[i] * abs(self.level[i])
        confirmed = self._held[i] <= 1.0 or self._open_doubt_of(i) > _ROOM * allowed
        _, group = np.unique(launch, return_inverse=True)
        change = known.slowness * known.change
        sums = np.bincount(group, change.real) + 1j * np.bincount(group, change.imag)
        power, cost = np.bincount(group, known.doubt**2), np.zeros(len(sums))
        cost[group] = rays
        limit = max(_REST * allowed, _PART * math.sqrt(power.sum()))
        order = np.argsort(power / cost, kind="stable")
        rest = np.maximum(np.sqrt(np.cumsum(power[order])), np.abs(np.cumsum(sums[order])))
        first = int(np.flatnonzero(rest <= limit * confirmed).max(initial=-1)) + 1
        return known.source[np.isin(group, order[first:])]


def feeding_sources(source: Sources, sums: Complexes, tolerance: float) -> Bools:
    """Tell on which sources (s,) a cell's level depends, by sums (s,) of its paths by source.

    The weakest are left out, of shallow and of deep ones each, as long as neither their sum nor their rms sum exceeds a
    share of the tolerance.
    """
    limit, deep, brings = _LEFT * tolerance * abs(sums.sum()), class_of(source) == 1, (source != EXACT) & (sums != 0.0)
    found = np.zeros(len(source), bool)
    for rows in (~deep, deep):
        some = np.flatnonzero(rows & brings)
        found[some[_but_weakest(sums[some], limit)]] = True
    return found


def _but_weakest(sums: Complexes, limit: float) -> NDArray[np.intp]:
    """Return the rows without the weakest, as long as neither their sum nor their rms sum exceeds a limit."""
    order = np.argsort(np.abs(sums), kind="stable")
    ordered = sums[order]
    left = np.maximum(np.sqrt(np.cumsum(np.abs(ordered) ** 2)), np.abs(np.cumsum(ordered)))
    keep = int(np.flatnonzero(left <= limit).max(initial=-1)) + 1
    return order[keep:]
