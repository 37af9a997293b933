"""How directions are sought in a map's cells: of which waves, and what of these no plane or spherical one fits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.processing.near_field import NearAperture
from raychan.radar.aperture import Aperture
from raychan.radar.measured import beside_line

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_FLOOR = 1e-4  # of a cell's strongest echo: what a wave that is no plane one to rounding and side lobes leaves
_TELLS = 0.5
"""Of the least power of an echo: curvature that leaves less is not looked at. With 0.1 as many of 109 near pairs are
found, and a 2 x 8 array over clutter takes 18 s in place of 15 (27 with 0)."""
_AWAY = (1.0, 2.0)
"""Times a cell's distance: from there waves come of what scatters, and of what mirrors the radar."""
_OFF, _OFF_CELLS = 0.02, 0.05  # of the distance, and range cells: by which a source may stand off it (not measured)
_SAFETY = 4.0  # on the power of a bent or uneven wave that a plane one cannot fit (not measured)


@dataclass(frozen=True, eq=False)
class Scan:
    """How directions are sought."""

    aperture: Aperture
    method: str
    range_resolution: float
    """[m]"""
    parts: tuple[Floats, ...] = ()
    """Places (a, 3) [m] of each element's receiver and transmitter, by which waves are curved; none: all are plane."""
    known: bool = False
    """Whether waves are curved as the aperture takes them to be."""
    beyond: float = np.inf
    """By how much [m] farther than shown an echo may be, folded into the map."""

    def fronts(self, distance: float, noise: float) -> list[Scan]:
        """Return how directions in a cell at a distance [m] are sought: in the near field as of spherical waves from
        there, as of mirrors from twice as far, from where the cell's range is folded from, and last as of plane waves.
        Args: noise, share of the cell's power below which an echo is none: what curvature leaves far below it tells
        nothing.

        Only beams fit spherical waves: where these matter other methods seek plane waves beside them."""
        if not self.parts or distance <= 0.0:
            return [self]
        least = max(_FLOOR, _TELLS * noise)
        if self._curved(distance) <= least:
            return [self]
        own, away, beyond = self.aperture, [x * distance for x in _AWAY], distance + self.beyond
        near = [NearAperture.of(own, self.parts, x) for x in away + [beyond] * bool(self._curved(beyond) > least)]
        beams = replace(self, method="bartlett", known=True)
        return [*(replace(beams, aperture=x) for x in near), replace(self, known=True)]

    def _curved(self, distance: Any) -> Any:
        """Return the share of echoes' power (n,), at distances (n,) [m], that is no plane wave as theirs is curved, an
        upper estimate; of those known to be curved so but for some."""
        extent = np.ptp(self.aperture.elements, axis=0)
        bend = 2.0 * np.pi / self.aperture.wavelength * float(extent @ extent) / (8.0 * np.maximum(distance, 1e-3))
        if self.known:
            bend = bend * np.minimum(1.0, _OFF + _OFF_CELLS * self.range_resolution / distance)
        return _SAFETY * 4.0 / 45.0 * bend**2

    def misfit(self, directions: Floats, distances: Floats) -> Floats:
        """Return the share of echoes' power (n,) that one plane wave in one range cell cannot fit, an upper estimate.

        Args: directions, cosines (n, 2); distances (n,) [m].
        Three causes: the element farthest out sees the echo earlier by x range cells, on the slope of the window's
        response (at most 2 x of the amplitude; of 300 lone echoes none leaves over an eighth of that power); and the
        wave is curved, by the phase k D^2 / 8 r at the rim, of whose power 4/45 is left by the best plane (integral of
        the parabola less its mean); and of a line that spreads a little beside itself beams are those of a straight
        one.
        """
        extent = np.ptp(self.aperture.elements, axis=0)
        early = 0.25 * (np.abs(directions) @ extent[1:]) / self.range_resolution
        # Elements nearer to the source hold more of its wave.
        uneven = self.known * 0.5 * (np.abs(directions) @ extent[1:]) / np.maximum(distances, 1e-3)
        share = _FLOOR + self._beside + ((2.0 * early) ** 2 + _SAFETY * uneven**2) / 3.0 + self._curved(distances)
        return np.asarray(np.minimum(1.0, share))

    @cached_property
    def _beside(self) -> float:
        """Share of an echo's power that a beam reads, at most, of what places beside a line make of its wave."""
        scans, places = self.aperture.scans, self.aperture.elements[:, 1:] / self.aperture.wavelength
        if sum(scans) != 1:
            return 0.0
        axis = 0 if scans[0] else 1
        return beside_line(places[:, axis], places[:, 1 - axis], 1.0 / float(self.aperture.beamwidth[axis]))

    def conventional(self, direction: Floats) -> Complexes:
        """Return the weights (s, a) of beams towards cosines (2,) and half a beam width to all sides of it."""
        axes = [(0.0, -0.5 * w, 0.5 * w) if np.isfinite(w) else (0.0,) for w in self.aperture.beamwidth]
        shifts = np.stack([x.ravel() for x in np.meshgrid(*axes)], axis=1)
        return np.asarray(self.aperture.steering(direction + shifts).conj() / len(self.aperture.elements))


def through(weights: Complexes, waves: Complexes) -> Floats:
    """Return the greatest power (n,) that beams of weights (b, a) let through of echoes, over that in their own.

    Args: waves (h, n, a) of the echoes in the antennas that the beams weigh, each in parts that may be in phase."""
    return np.asarray(np.abs(weights @ waves.transpose(0, 2, 1)).sum(axis=0).max(axis=0) ** 2)
