"""Map cells that are or may become detections: their levels, what launches changed of these, and what feeds them."""

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

_SHALLOW = 0.5  # of the tolerance, as an amplitude: so much shallow tubes may bring that are not traced again
_DEEP = 0.3  # of the tolerance, as an amplitude: so much the deep tubes left uncut may bring
_EITHER = 0.5  # of the tolerance: a class of tubes whose change takes more of it is refined further
_UNKNOWN = 0.757
"""Factor by which changes are taken to shrink a step where there was one only. COVER, chosen for launches a factor 3
apart, covers errors that fall with the size to the power of 0.40 or faster; for steps of a factor 2 that is 2^-0.40."""
_QUIET = 0.87  # of the least detection: noise of its cell raises a level by more (1.2 dB) once in 40 times
_SLOWEST = 3.0  # factor on a last change: beyond, the error is as good as unknown


@dataclass
class MapCells:
    """Map cells that are or may become detections: `place` (c, 3), each range [m], rate [m/s] and amplitude; `level`
    (c,), the sum of paths there; `change` (c, 2), by which shallow and deep tubes changed it last, and `before` (c, 2)
    the time before that (infinite: there was none)."""

    place: Floats
    level: Complexes
    change: Floats
    before: Floats
    tolerance: Floats
    """Relative amplitude (c,) by which the level may be wrong."""
    least: float = 0.0
    """Amplitude of the weakest level of which a detection may come."""

    @staticmethod
    def of(place: Floats, level: Complexes, tolerance_db: float) -> MapCells:
        """Return cells that no launch has changed yet."""
        n = len(place)
        tolerance = np.full(n, 1.0 - 10.0 ** (-tolerance_db / 20.0))
        return MapCells(place, level, np.zeros((n, 2)), np.full((n, 2), np.inf), tolerance)

    def changed(self, by: Complexes, wanted: Bools) -> None:
        """Note changes (c, 2); wanted (c, 2) which were asked for, others being by the way."""
        size = np.abs(by)
        self.level += by.sum(axis=1)
        self.before = np.where(wanted, np.where(self.change > 0.0, self.change, np.inf), self.before)
        self.change = np.where(wanted, size, np.hypot(self.change, size))

    def loosened(self, spread_db: Floats) -> int:
        """Let levels be wrong by what displaced bodies move them, (c,) [dB], where that is more; return how many."""
        speckle = 1.0 - 10.0 ** (-spread_db / 20.0)
        count = int((speckle > self.tolerance).sum())
        self.tolerance = np.maximum(self.tolerance, speckle)
        return count

    def spare(self, least: float) -> None:
        """Let levels below an amplitude, that of the least detection, be wrong by what keeps them from becoming one."""
        self.least = _QUIET * least

    @property
    def allowed(self) -> Floats:
        """Relative amplitude (c,) by which the level may be wrong: the tolerance, or what a weak one lacks."""
        return np.maximum(self.tolerance, self.least / np.maximum(np.abs(self.level), 1e-300) - 1.0)

    @property
    def slowness(self) -> Floats:
        """By what factor (c, 2) the rest of a series of changes exceeds COVER times its last one, 1 to _SLOWEST.

        Changes that shrink by q a step add up to q / (1 - q) times the last one; of a single change q is not known.
        """
        q = np.where(np.isinf(self.before), _UNKNOWN, np.minimum(self.change / self.before, 0.99))
        return np.asarray(np.clip(q / (1.0 - q) / COVER, 1.0, _SLOWEST))

    @property
    def open(self) -> Bools:
        """Which classes of tubes (c, 2) must be refined."""
        tolerance = self.allowed[:, None]
        share = COVER * self.slowness * self.change / np.maximum(np.abs(self.level), 1e-300)[:, None]
        over = np.hypot(share[:, 0], share[:, 1]) > tolerance[:, 0]
        largest = share >= share.max(axis=1, keepdims=True)
        return np.asarray(over[:, None] & ((share > _EITHER * tolerance) | largest) & (share > 0.0))


def feeding_sources(source: Sources, sums: Complexes, tolerance: float) -> tuple[Sources, Sources]:
    """Return the shallow and the deep sources that a cell's level depends on, of sums (s,) of its paths by source.

    The weakest are left out: of the deep, as long as neither their sum nor their rms sum exceeds a share of the
    tolerance; of the shallow, which the first launch has cut, as long as their rms sum does not.
    """
    level, found = abs(sums.sum()), []
    deep = depth_of(source) >= DEEP
    for mine, limit in ((~deep & (source != EXACT), _SHALLOW * tolerance), (deep, _DEEP * tolerance)):
        rows = np.flatnonzero(mine & (sums != 0.0))
        rows = rows[np.argsort(np.abs(sums[rows]), kind="stable")]
        small = np.sqrt(np.cumsum(np.abs(sums[rows]) ** 2)) <= limit * level
        if mine is deep:
            small &= np.abs(np.cumsum(sums[rows])) <= limit * level
        keep = int(np.flatnonzero(small).max(initial=-1)) + 1
        found.append(source[rows[keep:]])
    return found[0], found[1]
