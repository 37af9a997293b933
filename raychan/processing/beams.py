"""A bank of beams over the receivers, and the false alarms of their strongest.

Each beam adds the receivers in phase for one direction. A lone path reads its received power in its own beam, and noise
that is each receiver's own is lower by the number of receivers: 64 of them see 9 dB more than 8.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from raychan.parallel import parallel_for
from raychan.radar.aperture import Aperture
from raychan.radar.windows import window

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

PER_BEAM = 2
"""Beams per beam width: an echo between two of them reads at most 0.9 dB (a plane array 1.8 dB) low in the detector's
test, before its direction is refined; three would read 0.4 dB low and take half as much time again (closed form:
sinc(1/4), sinc(1/6))."""
_CHUNK = 1 << 18  # beam values made at a time by each thread, some 4 MB: larger arrays are slower


@dataclass(frozen=True, eq=False)
class BeamBank:
    """Beams of an aperture, PER_BEAM to a beam width. Args: taper, name of a window over the rows along y and z."""

    aperture: Aperture
    taper: str = "rect"

    @cached_property
    def weight(self) -> Floats:
        """Weights (a,) of the elements, of sum 1. Raises: ValueError for a taper over elements off a lattice."""
        out = np.ones(len(self.aperture.elements))
        if self.taper == "rect":
            return out / len(out)
        if self.aperture.table is None:
            raise ValueError(f"beam_window = {self.taper!r}: the elements must be a uniform line or rectangle")
        for axis, index in enumerate(self.aperture.index.T):
            out = out * window(self.taper, self.aperture.table.shape[axis])[index]
        return out / out.sum()

    @cached_property
    def directions(self) -> Floats:
        """Cosines (b, 2) along y and z of the beams; of a deep array at equal angles."""
        return self.aperture.spread(PER_BEAM) if self.aperture.deep else self.aperture.grid(PER_BEAM).points

    @cached_property
    def rows(self) -> NDArray[np.complex64]:
        """What the receivers are multiplied by (b, a) for each beam."""
        return (self.weight * self.aperture.steering(self.directions).conj()).astype(np.complex64)

    @property
    def noise_gain(self) -> float:
        """Noise power of a beam over that of one receiver: 1 / a without taper."""
        return float((self.weight**2).sum())

    def strongest(self, spectrum: Complexes) -> tuple[Floats, Ints]:
        """Return the power of the strongest beam in each cell (v, r) of a spectrum (a, v, r), and which it is."""
        count, rates, ranges = spectrum.shape
        power, beam = np.empty((rates, ranges)), np.empty((rates, ranges), np.int64)
        rows = max(1, _CHUNK // max(1, ranges * len(self.rows)))
        columns = np.ascontiguousarray(self.rows.T)

        def some(chunks: slice) -> None:
            for at in (slice(k * rows, (k + 1) * rows) for k in range(chunks.start, chunks.stop)):
                wave = spectrum[:, at].reshape(count, -1).T @ columns
                level = wave.real**2 + wave.imag**2
                best = level.argmax(axis=1)
                beam[at] = best.reshape(-1, ranges)
                power[at] = np.take_along_axis(level, best[:, None], axis=1).reshape(-1, ranges)

        parallel_for(-(-rates // rows), some, 2)
        return power, beam

    def towards(self, spectrum: Complexes, cells: Ints) -> Ints:
        """Return which beam (c,) is strongest in cells (c, 2) of a spectrum (a, v, r)."""
        return np.asarray(np.abs(self.rows @ spectrum[:, cells[:, 0], cells[:, 1]]).argmax(axis=0), np.int64)

    def single(self, pfa: float) -> float:
        """Return the false alarm probability of each beam for which that of the strongest in a cell is `pfa`.

        At most the sum over beams less that of pairs of neighbours that alarm together (Hunter 1976; the pairs form a
        tree); exceeded together with the probability of two correlated Rayleigh waves (Schwartz, Bennett and Stein
        1966, eq. 10-10-8). A CFAR of few training cells is a little safer.
        """
        pairs = self._pairs

        def excess(log_single: float) -> float:
            single = float(np.exp(log_single))
            union = len(self.directions) * single - single * float(_together(single, pairs).sum())
            return float(np.log(union / pfa))

        if not len(pairs):
            return pfa
        return float(np.exp(brentq(excess, np.log(pfa / len(self.directions)) - 1e-9, np.log(pfa))))

    @cached_property
    def _pairs(self) -> Floats:
        """Correlations (b - 1,) of the noise of neighbours, along a tree over all beams."""
        if self.aperture.deep:
            return self._alike(np.array(list(pairwise(range(len(self.directions))))))
        grid = self.aperture.grid(PER_BEAM)
        place = np.full(grid.visible.shape, -1)
        place[grid.visible] = np.arange(len(self.directions))
        found = []
        for k in range(len(grid.w)):
            along = place[:, k][place[:, k] >= 0]
            found += list(pairwise(along))
        across = place[len(grid.u) // 2]
        found += [(across[k], across[k + 1]) for k in range(len(grid.w) - 1) if min(across[k : k + 2]) >= 0]
        return self._alike(np.array(found).reshape(-1, 2))

    def _alike(self, pairs: Ints) -> Floats:
        """Return the correlations (p,) of the noise of pairs (p, 2) of beams."""
        if not len(pairs):
            return np.zeros(0)
        one, other = pairs.T
        return np.asarray(np.abs((self.rows[one] * self.rows[other].conj()).sum(axis=1)) / self.noise_gain)


def _together(single: float, correlation: Floats) -> Floats:
    """Return the probability (n,) that noise of given correlations exceeds a level in the second beam, given that it
    does in the first, which it does with probability `single`."""
    from scipy.stats import ncx2  # takes long to import, and a single receiver needs none of it

    rho = np.minimum(correlation.astype(np.float64), 1.0 - 1e-9)
    level = -np.log(single)
    a2 = 2.0 * level / (1.0 - rho**2)
    # Marcum's Q1(x, y) is the tail of a noncentral chi-square of two degrees: sf(y^2, 2, x^2).
    q_ab = ncx2.sf(rho**2 * a2, 2, a2)
    q_ba = ncx2.sf(a2, 2, rho**2 * a2)
    # P(either) = single (1 + Q1(a, b) - Q1(b, a)), P(both) = 2 single - P(either).
    return np.asarray(np.clip(1.0 - q_ab + q_ba, 0.0, 1.0))
