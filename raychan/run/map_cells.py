"""Map cells that are or may become detections: their levels, what launches changed of these, source by source, and
which sources of tubes are to be traced again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import COVER
from raychan.run.source_changes import Changes, class_of
from raychan.tracing.sources import EXACT, Sources

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating]
Bools = NDArray[np.bool_]
Classes = tuple[Sources, Sources]
"""Sources of shallow tubes, and of deep ones."""

_SHALLOW = 0.5  # of the tolerance, as an amplitude: so much shallow tubes may bring that are not traced again
_DEEP = 0.3  # of the tolerance, as an amplitude: so much the deep tubes left uncut may bring
_EITHER = 0.5  # of the tolerance: a class of tubes whose change takes more of it is refined further
_REST = (
    0.15  # of the tolerance, as an amplitude: so much the last changes of sources may add up to that are not refined
)
ALONG = math.sqrt(0.5)
"""Share of an error's amplitude, rms, that lies along a level and changes it: their phases are unrelated. Of 106 levels
of `bench.detections`, seeds 9700 to 9759, refined until they are within, 99 % lie within what is stated with it or
without."""
_CLAIMED = 0.1
"""Of the tolerance: no smaller error of tubes is stated, for what feeds a cell least is not traced again. Of 110 such
levels all lie within what is stated with it, 98 % without."""
_ROOM = 0.9  # of the tolerance: the rest is for what is under the noise, and for neighbouring cells
_NOTHING = 1e-3  # of the tolerance, as an amplitude: smaller changes are not kept one by one
_FIRM, _HELD = 0.7, 0.5
"""A doubt that has not shrunk by _FIRM is one of errors that come by chance, and the next one may be small by chance:
_HELD of it counts on, until another change is small as well. With it 73 of 76 levels of `bench.detections`, seeds 9700
to 9759 at 1 dB, lie within what is stated, without 72."""
_SURE, _SHRINK = 3, 0.7
"""From so many steps on a cell is given up whose error would not be within the tolerance after all STEPS if it shrank
by this factor a step. Of 38 cells above it after three of six steps (seeds 0 to 93) the 10 by 0.7^-3 or more were not
reached, 22 of the others were."""


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
        self.tolerance = np.full(len(self.level), 1.0 - 10.0 ** (-tolerance_db / 20.0))
        if len(level) > 1:
            mean = np.sqrt((np.abs(level) ** 2).mean(axis=0))
            self.tolerance *= (mean / np.maximum(np.abs(level), 1e-300)).ravel()
        self._changes = [Changes.none() for _ in self.level]
        self._given_up, self._before = np.zeros(len(self.level), bool), np.full(len(self.level), np.inf)
        self._held, self._older = np.zeros(len(self.level)), np.full(len(self.level), np.inf)

    def __len__(self) -> int:
        return len(self.level)

    def cell_of(self, i: int) -> Floats:
        """Return the place (3,) of the cell of level i."""
        return np.asarray(self.place[i % len(self.place)])

    def loosened(self, spread_db: Floats) -> int:
        """Let levels be wrong by what displaced bodies move them, (c,) [dB], where that is more; return of how many
        cells."""
        speckle = 1.0 - 10.0 ** (-spread_db / 20.0)
        count = int((speckle > self.tolerance[: len(speckle)]).sum())
        self.tolerance = np.maximum(self.tolerance, np.tile(speckle, len(self) // max(len(speckle), 1)))
        return count

    def spare(self, least: Floats) -> None:
        """Let levels below amplitudes (c,), from which on cells are detections, be wrong by what keeps them from it."""
        self._least = np.tile(least, len(self) // max(len(least), 1))

    @property
    def allowed(self) -> Floats:
        """By which share of its amplitude (c,) a level may be wrong: the tolerance, or what a weak one lacks."""
        return np.maximum(self.tolerance, self._least / np.maximum(np.abs(self.level), 1e-300) - 1.0)

    def changed(self, i: int, source: Sources, by: Complexes) -> None:
        """Note by what sources (s,), in order, changed cell i."""
        self.level[i] += by.sum()
        self._changes[i].add(source, by, _NOTHING * self.tolerance[i] * abs(self.level[i]))

    @property
    def doubt(self) -> Floats:
        """What may be wrong of each level (c,), as an amplitude: what may still change, a share of what that was a step
        before where it had not shrunk then, and the least that is stated of tubes."""
        held = self._held * _ROOM * np.abs(self.level) * self.allowed
        least = np.minimum(_CLAIMED * self.tolerance * np.abs(self.level), self.tubes)
        return np.maximum(np.maximum(self._open_doubt, held), least)

    @property
    def _open_doubt(self) -> Floats:
        """The sum of what may still change of each level (c,) and of what was never cut, or, where that cancels, their
        rms sum."""
        found = np.zeros(len(self))
        for i, changes in enumerate(self._changes):
            whole, rms = changes.sums()
            sizes = abs(whole.sum() + self.left[i]), float(np.hypot(np.hypot(*rms), abs(self.left[i])))
            found[i] = ALONG * COVER * max(sizes)
        return found

    @property
    def change(self) -> Floats:
        """By how much (c, 2) shallow and deep tubes may still change each level, rms sums."""
        return np.array([c.sums()[1] for c in self._changes]).reshape(-1, 2)

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
        """Which classes of tubes (c, 2) keep a level from its tolerance."""
        share = ALONG * COVER * self.change / np.maximum(np.abs(self.level) * self.allowed, 1e-300)[:, None]
        largest = share >= share.max(axis=1, keepdims=True)
        refined = (self.over > 1.0)[:, None] & ((share > _EITHER) | largest)
        return np.asarray((refined | self._to_confirm[:, None]) & (share > 0.0))

    @property
    def _to_confirm(self) -> Bools:
        """Which levels (c,) one change brought within their tolerance although the doubt before had not shrunk: another
        change tells whether it was small by chance."""
        return np.asarray((self.over <= 1.0) & (self._held > 1.0))

    def give_up(self, steps: int, left: int) -> None:
        """Refine cells no more whose tolerance is out of reach, after some steps and before those that are left."""
        before, self._before, old = self._before, self.over, self._older
        self._held, self._older = np.where(before > _FIRM * old, _HELD * before, 0.0), before
        if steps >= _SURE:
            # The change of one step may be large by chance.
            self._given_up |= np.minimum(before, self._before) * _SHRINK**left > 1.0

    @property
    def to_refine(self) -> Bools:
        """Which classes of tubes (c, 2) must be refined."""
        return self.open & ~self._given_up[:, None]

    def wanted(self, i: int) -> Classes:
        """Return the sources whose last changes keep cell i open, shallow and deep: all but the weakest, as long as
        neither their sum nor their rms sum exceeds a share of the tolerance; all that changed it last where that is to
        be confirmed."""
        known, limit = self._changes[i], _REST * self.allowed[i] * abs(self.level[i]) * (not self._to_confirm[i])
        classes = class_of(known.source)
        found = [_but_weakest(known.source[classes == j], known.change[classes == j], limit, True) for j in (0, 1)]
        return found[0], found[1]


def feeding_sources(source: Sources, sums: Complexes, tolerance: float) -> Classes:
    """Return the shallow and the deep sources that a cell's level depends on, of sums (s,) of its paths by source.

    The weakest are left out: of the deep, as long as neither their sum nor their rms sum exceeds a share of the
    tolerance; of the shallow, which the first launch has cut, as long as their rms sum does not.
    """
    level, classes = abs(sums.sum()), class_of(source)
    shallow, deep = (np.flatnonzero((classes == j) & (source != EXACT) & (sums != 0.0)) for j in (0, 1))
    return (
        _but_weakest(source[shallow], sums[shallow], _SHALLOW * tolerance * level, False),
        _but_weakest(source[deep], sums[deep], _DEEP * tolerance * level, True),
    )


def _but_weakest(source: Sources, sums: Complexes, limit: float, both: bool) -> Sources:
    """Return the sources without the weakest, as long as their rms sum, or with `both` neither that nor their sum,
    exceeds a limit."""
    order = np.argsort(np.abs(sums), kind="stable")
    ordered = sums[order]
    small = np.sqrt(np.cumsum(np.abs(ordered) ** 2)) <= limit
    if both:
        small &= np.abs(np.cumsum(ordered)) <= limit
    keep = int(np.flatnonzero(small).max(initial=-1)) + 1
    return source[order[keep:]]
