"""The echoes within one cell of a map: how many, from which directions, how strong, and each one's own peak.

Directions are sought for one echo, then for one more as long as the strongest beam of what is left exceeds the
detector's threshold. Each echo then has a beam of its own, with nulls towards the others of the cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.doa import amplitudes, estimate
from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_MOST = 8  # echoes in a cell
_FLOOR = 1e-4  # of a cell's strongest echo: what a wave that is no plane one to rounding and side lobes leaves
_APART = 0.05  # beam widths: nearer echoes share their power at the noise's whim (not measured)
_UNTOLD = 0.01  # of an echo's power: waves that were not told apart, weaker than this, move its level by 0.9 dB at most
_SAFETY = 4.0  # on the power that a plane wave cannot fit (not measured)


@dataclass(frozen=True, eq=False)
class Scan:
    """How directions are sought."""

    aperture: Aperture
    method: str
    range_resolution: float
    """[m]"""

    def misfit(self, directions: Floats, distances: Floats) -> Floats:
        """Return the share of echoes' power (n,) that one plane wave in one range cell cannot fit, an upper estimate.

        Args: directions, cosines (n, 2); distances (n,) [m].
        Two causes: the element farthest out sees the echo earlier by x range cells, on the slope of the window's
        response (at most 2 x of the amplitude); and the wave is curved, by the phase k D^2 / 8 r at the rim, of
        whose power 4/45 is left by the best plane (integral of the parabola less its mean).
        """
        extent = np.ptp(self.aperture.elements, axis=0)
        early = 0.25 * (np.abs(directions) @ extent[1:]) / self.range_resolution
        bend = 2.0 * np.pi / self.aperture.wavelength * float(extent @ extent) / (8.0 * np.maximum(distances, 1e-3))
        return np.asarray(np.minimum(1.0, _FLOOR + _SAFETY * ((2.0 * early) ** 2 / 3.0 + 4.0 / 45.0 * bend**2)))

    def conventional(self, direction: Floats) -> Complexes:
        """Return the weights (s, a) of beams towards cosines (2,) and half a beam width to all sides of it."""
        axes = [(0.0, -0.5 * w, 0.5 * w) if np.isfinite(w) else (0.0,) for w in self.aperture.beamwidth]
        shifts = np.stack([x.ravel() for x in np.meshgrid(*axes)], axis=1)
        return np.asarray(self.aperture.steering(direction + shifts).conj() / len(self.aperture.elements))

    def through(self, weights: Complexes, directions: Floats, distances: Floats) -> Floats:
        """Return the greatest power that beams of weights (s, a) let through of echoes (n,), over that in their own."""
        share = (np.abs(weights @ self.aperture.steering(directions).T) ** 2).max(axis=0)
        return np.maximum(share, self.misfit(directions, distances))


@dataclass(frozen=True, eq=False)
class CellEchoes:
    """Echoes in one cell, strongest first."""

    direction: Floats
    """Cosines (k, 2) along y and z."""
    power: Floats
    """(k,) [W]"""
    weights: Complexes
    """Beams (k, a): times the cell's snapshot (a,) the echoes' waves."""
    rest: float = 0.0
    """Power [W] of the strongest beam of what they leave: more than noise where two echoes were not told apart."""
    least: float = 0.0
    """Power [W] below which what they leave is noise, or what of the strongest is no plane wave."""

    @property
    def noise_gain(self) -> Floats:
        """Noise power in each beam (k,) over that of one receiver."""
        return np.asarray((np.abs(self.weights) ** 2).sum(axis=1))

    def unsure(self, aperture: Aperture) -> NDArray[np.bool_]:
        """Return which directions (k,) may be wrong by more than a beam width: where side lobes are high, those of sums
        of waves that were not told apart."""
        untold = aperture.table is None and self.rest > self.least
        return np.asarray(untold & (self.rest > _UNTOLD * self.power))


def echoes_in(snapshot: Complexes, scan: Scan, least: float, distance: float) -> CellEchoes:
    """Return the echoes of a cell's snapshot (a,).

    Args: least, power [W] below which a beam is noise; distance [m] of the cell. Two echoes are told apart where both
    exceed `least` in their beams and the misfit of the stronger; by Bartlett's beams only a beam width apart.
    """
    data = snapshot[None, :].astype(np.complex128)
    aperture = scan.aperture
    found = _told(data, aperture, estimate(data, aperture, "bartlett", 1))
    least = max(least, float(scan.misfit(found.direction[:1], np.array([distance]))[0] * found.power[0]))
    count = len(aperture.elements)
    for k in range(1, min(_MOST, count // 2) + 1):
        rest = data - amplitudes(data, aperture, found.direction) @ aperture.steering(found.direction)
        found = replace(
            found, least=least, rest=float(_told(rest, aperture, estimate(rest, aperture, "bartlett", 1)).power[0])
        )
        if found.rest <= least or k == min(_MOST, count // 2):
            break
        directions = estimate(data, aperture, scan.method, k + 1)
        if len(directions) <= k or _nearest(directions, aperture) < (1.0 if scan.method == "bartlett" else _APART):
            break
        more = _told(data, aperture, directions)
        if (more.power <= least * count * more.noise_gain).any():
            break
        found = more
    return found


def _told(data: Complexes, aperture: Aperture, directions: Floats) -> CellEchoes:
    """Return the echoes from directions (k, 2) in a snapshot (1, a), by least squares."""
    weights = np.linalg.pinv(aperture.steering(directions)).T
    power = np.abs(weights @ data[0]) ** 2
    order = np.argsort(-power, kind="stable")
    return CellEchoes(directions[order], power[order], weights[order])


def _nearest(directions: Floats, aperture: Aperture) -> float:
    """Return the least distance of two directions (k, 2), in beam widths."""
    apart = aperture.apart(directions[:, None], directions[None])
    return float(apart[np.triu_indices(len(apart), 1)].min())
