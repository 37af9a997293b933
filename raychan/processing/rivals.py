"""Whether the directions of a cell's echoes are sure: other sets of waves that explain as much of it.

With few elements to an echo, or elements on no lattice, sets of waves that are none of the true ones may leave as
little of a cell as the noise asks for. What a set leaves is held against noise and against what of its waves is no
plane one; the sets that a joint search finds tell which of its directions others do without.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from raychan.processing.joint_search import FEW, Complexes, candidates, explained
from raychan.processing.spectra import squared
from raychan.processing.staggered import CLEAR
from raychan.processing.twins import nearest_boresight
from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_SURE = 1.0 - 1e-4  # of cells with no more waves than found leave less than is held for noise (not measured)
_LIKELY = 0.99
"""Of cells: noise leaves less of the true waves. Of 60 pairs on 6 places 6 right ones are marked, with 0.999 14."""
_MOVED = 0.1  # beam widths: a direction that another set moves less is the same (not measured)
_CHANCE = 0.04  # of wrong sets that leave less than a multiple of what is left: those that leave less (not measured)
_EVEN = 1.0  # times the noise: of sets that differ less that nearest boresight is as good


def searched(aperture: Aperture, count: int) -> bool:
    """Return whether sets of so many waves are sought over all directions, not one wave after the other."""
    few = all(aperture.scans) and len(aperture.elements) <= FEW * count
    return few or (any(aperture.scans) and aperture.table is None)


def nearest(directions: Floats, aperture: Aperture) -> float:
    """Return the least distance of two directions (k, 2), in beam widths; infinite of one."""
    apart = aperture.apart(directions[:, None], directions[None])
    return float(apart[np.triu_indices(len(apart), 1)].min(initial=np.inf))


@dataclass(frozen=True, eq=False)
class Judge:
    """Judges sets of waves of a cell."""

    data: Complexes
    """(1, a) what the elements hold."""
    aperture: Aperture
    noise: float
    """[W] of one element."""
    misfit: float
    """[W] in all elements that may be no plane wave."""
    apart: float
    """Beam widths: waves are told apart that are farther from each other."""

    def left(self, at: Floats) -> float:
        """Return the power in all elements of what waves from cosines (k, 2) leave."""
        return float(squared(self.data).sum()) - explained(self.data, self.aperture, at)

    def better(self, at: Floats, most: int) -> Floats:
        """Return the cosines (k, 2) of a set of waves that explains more than one given, of one wave more, at most so
        many, where more than noise is left; those given where there is none."""
        count, own = len(at), self.aperture
        if count > 1 and searched(own, count):
            best = self._best(count)
            if self._told(best) and self.left(best) < self.left(at) - _EVEN * self.noise:
                at = best
        if not self._hides(at) or not searched(own, count + 1) or count + 1 > most:
            return at
        more = self._best(count + 1)
        return more if self._told(more) and not self._hides(more) else at

    def open(self, at: Floats, some: bool) -> Bools:
        """Return which of cosines (k, 2) other sets lack that explain as much, or, where waves leave more than noise, a
        set that leaves none or those that leave little more; some, whether any of them is open otherwise."""
        count, own = len(at), self.aperture
        out = np.zeros(count, bool)
        hides = self._hides(at)
        if count > 1 and (searched(own, count) or (some and hides)):
            sets, left = candidates(self.data, own, count)
            rest = self.left(at)
            within = min(rest + CLEAR * self.noise, self._noise(count, _LIKELY)) + self.misfit
            if hides:
                # Sets by chance that leave less than x times the data are as x^(free / 2).
                within = max(within, rest * _CHANCE ** (-2.0 / max(self._free(count), 1)))
            out |= self._lacked(at, sets[left < within])
        if hides and (searched(own, count + 1) or some) and not self._hides(more := self._best(count + 1)):
            out |= self._lacked(at, more[None])
        return out

    def _free(self, count: int) -> int:
        """Return how many real numbers of the data so many waves leave free."""
        return 2 * self.data.shape[1] - count * (2 + sum(self.aperture.scans))

    def _hides(self, at: Floats) -> bool:
        """Return whether waves leave more than noise and what of them is no plane wave, or nothing is left to tell."""
        if self._free(len(at)) <= 0:
            return True
        return self.left(at) > self._noise(len(at), _SURE) + self.misfit

    def _noise(self, count: int, share: float) -> float:
        """Return the power in all elements below which waves, so many, leave noise in such a share of cases."""
        return self.noise * float(gammaincinv(0.5 * max(self._free(count), 1), share))

    def _told(self, at: Floats) -> bool:
        """Return whether all waves of a set (k, 2) are told apart."""
        return len(at) > 0 and nearest(at, self.aperture) >= self.apart

    def _best(self, count: int) -> Floats:
        """Return the cosines (k, 2) of the set of so many waves that explains most; none where there is none."""
        if self._free(count) <= 0:
            return np.zeros((0, 2))
        sets, _ = candidates(self.data, self.aperture, count)
        return nearest_boresight(self.aperture, sets[0]) if len(sets) else np.zeros((0, 2))

    def _lacked(self, at: Floats, sets: Floats) -> Bools:
        """Return which of cosines (k, 2) any of sets (s, m, 2) lacks."""
        if not len(sets):
            return np.zeros(len(at), bool)
        other = nearest_boresight(self.aperture, sets.reshape(-1, 2)).reshape(sets.shape)
        apart = self.aperture.apart(at[None, :, None], other[:, None])
        return np.asarray((apart.min(axis=2) > _MOVED).any(axis=0))
