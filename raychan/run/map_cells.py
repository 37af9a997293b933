"""Map cells that are or may become detections: their levels, what launches changed of these, source by source, and
which sources of tubes are to be traced again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.channel.error import COVER
from raychan.run.sourced_paths import DEEP
from raychan.tracing.sources import EXACT, Sources, depth_of

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
_NOTHING = 1e-3  # of the tolerance, as an amplitude: smaller changes are not kept one by one
_UNKNOWN = 0.757
"""Factor by which changes are taken to shrink a step where there was one only. COVER, chosen for launches a factor 3
apart, covers errors that fall with the size to the power of 0.40 or faster; for steps of a factor 2 that is 2^-0.40."""
_SLOWEST = 3.0  # factor on a last change: beyond, the error is as good as unknown


@dataclass
class _Changes:
    """The last change (n,) of a cell's level by each source (n,), and of their two classes the squared rms sums (2, 2)
    of the newest changes and of those before, of sources changed twice."""

    source: Sources
    change: Complexes
    pair: Floats

    def add(self, source: Sources, by: Complexes, least: float) -> None:
        """Note changes by sources (s,), in order, that replace earlier ones of these."""
        if not len(source):
            return
        at = np.minimum(np.searchsorted(source, self.source), len(source) - 1)
        again = source[at] == self.source
        classes = class_of(self.source[again])
        for j in (0, 1):
            mine = classes == j
            if mine.any():
                both = by[at[again]][mine], self.change[again][mine]
                self.pair[j] = [float((np.abs(x) ** 2).sum()) for x in both]
        keep = np.abs(by) > least
        self.source = np.concatenate([self.source[~again], source[keep]])
        self.change = np.concatenate([self.change[~again], by[keep]])

    @property
    def ratio(self) -> Floats:
        """By what factor (2,) the changes of each class shrink a step."""
        with np.errstate(divide="ignore", invalid="ignore"):
            q = np.sqrt(self.pair[:, 0] / self.pair[:, 1])
        return np.where(np.isfinite(q), q, _UNKNOWN)

    def sums(self) -> tuple[Complexes, Floats]:
        """Return the sums (2,) and the rms sums (2,) of the changes by class."""
        mine = class_of(self.source) == np.arange(2)[:, None]
        return (mine * self.change).sum(axis=1), np.sqrt((mine * np.abs(self.change) ** 2).sum(axis=1))


class MapCells:
    """Map cells that are or may become detections: `place` (c, 3), each range [m], rate [m/s] and amplitude; `level`
    (c,), the sum of paths there; `left` (c,), that of deep tubes that are never traced again; `tolerance` (c,), by
    which share of its amplitude a level may be wrong."""

    def __init__(self, place: Floats, level: Complexes, tolerance_db: float) -> None:
        self.place, self.level = place, level
        self.left, self._least = np.zeros(len(place), complex), 0.0
        self.tolerance = np.full(len(place), 1.0 - 10.0 ** (-tolerance_db / 20.0))
        self._changes = [_Changes(np.zeros(0, np.int64), np.zeros(0, complex), np.zeros((2, 2))) for _ in place]

    def __len__(self) -> int:
        return len(self.place)

    def loosened(self, spread_db: Floats) -> int:
        """Let levels be wrong by what displaced bodies move them, (c,) [dB], where that is more; return how many."""
        speckle = 1.0 - 10.0 ** (-spread_db / 20.0)
        count = int((speckle > self.tolerance).sum())
        self.tolerance = np.maximum(self.tolerance, speckle)
        return count

    def spare(self, least: float) -> None:
        """Let levels below an amplitude, from which on detections come, be wrong by what keeps them from one."""
        self._least = least

    @property
    def allowed(self) -> Floats:
        """By which share of its amplitude (c,) a level may be wrong: the tolerance, or what a weak one lacks."""
        return np.maximum(self.tolerance, self._least / np.maximum(np.abs(self.level), 1e-300) - 1.0)

    def changed(self, i: int, source: Sources, by: Complexes) -> None:
        """Note by what sources (s,), in order, changed cell i."""
        self.level[i] += by.sum()
        self._changes[i].add(source, by, _NOTHING * self.tolerance[i] * abs(self.level[i]))

    @property
    def slowness(self) -> Floats:
        """By what factor (c, 2) the rest of a series of changes exceeds COVER times its last one, 1 to _SLOWEST.

        Changes that shrink by q a step add up to q / (1 - q) times the last one; of a single change q is not known.
        """
        q = np.minimum(np.array([c.ratio for c in self._changes]).reshape(-1, 2), 0.99)
        return np.asarray(np.clip(q / (1.0 - q) / COVER, 1.0, _SLOWEST))

    @property
    def doubt(self) -> Floats:
        """What may be wrong of each level (c,), as an amplitude: the sum of the last changes and of what was never cut,
        or, where that cancels, their rms sum."""
        slow, found = self.slowness, np.zeros(len(self))
        for i, changes in enumerate(self._changes):
            whole, rms = changes.sums()
            sizes = (
                abs((slow[i] * whole).sum() + self.left[i]),
                float(np.hypot(np.hypot(*(slow[i] * rms)), abs(self.left[i]))),
            )
            found[i] = COVER * max(sizes)
        return found

    @property
    def change(self) -> Floats:
        """By how much (c, 2) shallow and deep tubes changed each level last, rms sums."""
        return np.array([c.sums()[1] for c in self._changes]).reshape(-1, 2)

    @property
    def open(self) -> Bools:
        """Which classes of tubes (c, 2) must be refined."""
        level, tolerance = np.maximum(np.abs(self.level), 1e-300), self.allowed
        over = self.doubt / level > tolerance
        share = COVER * self.slowness * self.change / level[:, None]
        largest = share >= share.max(axis=1, keepdims=True)
        return np.asarray(over[:, None] & ((share > _EITHER * tolerance[:, None]) | largest) & (share > 0.0))

    def wanted(self, i: int) -> Classes:
        """Return the sources whose last changes keep cell i open, shallow and deep: all but the weakest, as long as
        neither their sum nor their rms sum exceeds a share of the tolerance."""
        known, limit = self._changes[i], _REST * self.allowed[i] * abs(self.level[i])
        classes = class_of(known.source)
        found = [_but_weakest(known.source[classes == j], known.change[classes == j], limit, True) for j in (0, 1)]
        return found[0], found[1]


def class_of(source: Sources) -> NDArray[np.int64]:
    """Return 1 (n,) for sources of deep tubes, 0 for others."""
    return (depth_of(source) >= DEEP).astype(np.int64)


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
