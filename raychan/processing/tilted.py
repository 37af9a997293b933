"""Arrays in a plane that is tilted, or nearly in one: which directions ahead look alike to them.

Seen from the plane of its elements such an array is flat: directions look alike a grating lobe away in their cosines
along the plane, on either side of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from raychan.radar.aperture import ALIKE, SAME_EDGE, Aperture
from raychan.radar.measured import SAME

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_KEPT = 8  # planes kept for the next frames of a sequence
_BATCH = 1 << 20  # directions times grating lobes at once


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane that fits elements best; of one angle, in the plane in which it is taken."""

    axes: Floats
    """(3, 3) its normal and two axes along it, in the antenna's frame."""
    own: Aperture
    """The elements as they stand along it, taken for flat."""
    off: float
    """[wavelengths] over which elements stand off it."""

    @property
    def exact(self) -> bool:
        """Whether the elements lie in it."""
        return self.off <= SAME

    def along(self, cosines: Floats) -> Floats:
        """Return the cosines (n, 2) along the plane of directions ahead (n, 2)."""
        return np.asarray(looks(cosines) @ self.axes[1:].T * self.own.scans)

    def mirrored(self, cosines: Floats) -> tuple[Floats, Bools]:
        """Return the mirror images (n, 2) of directions about the plane, and which of them are ahead."""
        look = looks(cosines)
        look = look - 2.0 * np.outer(look @ self.axes[0], self.axes[0])
        return look[:, 1:], look[:, 0] > 0.0

    def alike(self, cosines: Floats, lobes: Floats) -> tuple[Floats, Floats]:
        """Return directions (n, l, 2, 3) grating lobes (l, 2) away from others (n, 2), on both sides of the plane, and
        their cosines (n, l, 2) along it: beyond 1 these are those of no wave, and the direction is the nearest."""
        at = self.along(cosines)[:, None] + lobes
        size = np.linalg.norm(at, axis=-1, keepdims=True)
        flat = at / np.maximum(size, 1.0)
        up = np.sqrt(np.maximum(1.0 - size**2, 0.0)) * np.array([1.0, -1.0])
        return up[..., None] * self.axes[0] + (flat @ self.axes[1:])[:, :, None], at

    def nearest_boresight(self, cosines: Floats) -> Floats:
        """Return, of all directions ahead quite like others (n, 2), those nearest boresight."""
        found, lobes = self.own.lobes, np.zeros((1, 2))
        lobes = np.concatenate([lobes, found.at[found.lost <= ALIKE]])
        out = np.array(cosines)
        for some in np.array_split(np.arange(len(out)), -(-len(out) * len(lobes) // _BATCH) or 1):
            look, at = self.alike(out[some], lobes)
            real = (at**2).sum(axis=-1) <= 1.0
            look = np.where(real[..., None, None], look, -1.0).reshape(len(some), -1, 3)
            best = look[np.arange(len(some)), look[..., 0].argmax(axis=1)]
            nearer = (best[:, 0] > 0.0) & ((best[:, 1:] ** 2).sum(axis=1) < (out[some] ** 2).sum(axis=1) - SAME_EDGE)
            out[some] = np.where(nearer[:, None], best[:, 1:], out[some])
        return out


def plane_of(aperture: Aperture) -> Plane:
    """Return the plane that fits the elements of an array that measures directions."""
    return _fitted(aperture.elements.tobytes(), aperture.wavelength, aperture.scans)


@lru_cache(maxsize=_KEPT)
def _fitted(elements: bytes, wavelength: float, scans: tuple[bool, bool]) -> Plane:
    """Return what `plane_of` does, by the bytes of the elements (a, 3) [m]."""
    places = np.frombuffer(elements).reshape(-1, 3)
    rows = np.array([0, *(1 + np.flatnonzero(scans))])
    around = (places - places.mean(axis=0))[:, rows]
    axes = np.zeros((3, 3))
    axes[: len(rows), rows] = np.linalg.eigh(around.T @ around)[1].T
    if not all(scans):
        axes[2, 2 if scans[0] else 1] = 1.0
    own = places @ axes.T * [0.0, 1.0, float(all(scans))]
    off = float(np.ptp(around @ axes[0, rows])) / wavelength
    return Plane(axes, Aperture(own, wavelength, (True, all(scans))), off)


def looks(cosines: Floats) -> Floats:
    """Return unit vectors (n, 3) ahead by their cosines (n, 2)."""
    ahead = np.sqrt(np.maximum(1.0 - (cosines**2).sum(axis=1), 0.0))
    return np.column_stack([ahead, cosines])
