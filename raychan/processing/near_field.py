"""An array that sees waves as from sources so far away: phases are those of spherical waves, not of plane ones.

Each transmitter and each receiver is nearer to a source by its own way. Beyond some times 2 D^2 / wavelength these are
what a plane wave has; nearer, plane waves explain no echo, and their best beam may look anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import Aperture

Floats = NDArray[np.float64]
Complexes = NDArray[np.complexfloating[Any, Any]]

_SHARED = ("scans", "places", "index", "pitch", "period", "beamwidth", "depth", "deep", "table", "spreads")


@dataclass(frozen=True, eq=False, kw_only=True)
class NearAperture(Aperture):
    """The elements of a `far` aperture before sources at a distance [m] from the phase centre."""

    far: Aperture
    """What the same elements are to plane waves."""
    parts: tuple[Floats, ...]
    """Places (a, 3) [m] whose sums are the elements: of each one's receiver, and of its transmitter."""
    distance: float

    @classmethod
    def of(cls, far: Aperture, parts: tuple[Floats, ...], distance: float) -> NearAperture:
        """Return an aperture as sources at a distance [m] see it; args as the fields."""
        return cls(far.elements, far.wavelength, far.axes, far=far, parts=parts, distance=distance)

    def __post_init__(self) -> None:
        self.__dict__.update({name: getattr(self.far, name) for name in _SHARED})
        # No two directions look quite alike: their waves are not equally curved.
        self.__dict__.update(wraps=(False, False), skewed=np.zeros((0, 2)))

    def steering(self, cosines: Floats) -> Complexes:
        """Return the phasors (n, a) that spherical waves from cosines (n, 2) have at the elements."""
        u, w = np.asarray(cosines, np.float64).T
        ahead = np.sqrt(np.maximum(1.0 - u**2 - w**2, 0.0))
        look, nearer = np.stack([ahead, u, w], axis=1), np.zeros((len(u), len(self.elements)))
        for places in self.parts:
            over = 2.0 * self.distance * (look @ places.T) - (places**2).sum(axis=1)
            nearer += over / (self.distance + np.sqrt(np.maximum(self.distance**2 - over, 0.0)))
        return np.asarray(np.exp(2j * np.pi / self.wavelength * nearer))


def parts_of(elements: Floats, senders: Floats | None) -> tuple[Floats, ...]:
    """Return the parts of virtual elements (t * a, 3) [m], by transmitter, of transmitters (t, 3) [m]."""
    if senders is None:
        return (elements,)
    sent = np.repeat(senders, len(elements) // len(senders), axis=0)
    # One transmitter turns all elements alike.
    return (elements - sent, sent) if len(senders) > 1 else (elements - sent,)
