"""Antennas: complex field patterns by direction.

Every antenna has one method, field(direction): unit vectors (n, 3) in its own frame (boresight +x, y left, z up) to
(n, 2) complex sqrt(gain) along theta-hat (V) and phi-hat (H). Gain is power gain over an isotropic radiator, losses in.
Those below take lists and a single direction (3,), too, as (1, 3), and refuse vectors that are not of length 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.polynomial.chebyshev import chebval
from numpy.typing import ArrayLike, NDArray

from raychan.limits import LOSS_DB
from raychan.radar.declared import check_declared, check_type, finite, reals
from raychan.radar.spherical_vectors import cosine_power
from raychan.radar.windows import check_window, window
from raychan.scalars import is_one_of, meant, shown
from raychan.units import undb

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_NOT_UNIT = 1e-3  # of a squared length: a direction of float32 is off by 1e-6
_LONGEST = 1000  # elements of a row, whose pattern is integrated over the sphere; not measured
POLARIZATIONS = ("V", "H")


@runtime_checkable
class Antenna(Protocol):
    """An antenna, by its pattern: any class with this method is one."""

    def field(self, direction: Floats) -> Complexes:
        """Return sqrt(gain) along theta-hat and phi-hat (n, 2) of unit directions (n, 3)."""
        ...


def polarized(size: NDArray[np.generic], polarization: str) -> Complexes:
    """Return fields (n, 2) of given size (n,) along V or H."""
    out = np.zeros((len(size), 2), np.complex128)
    out[:, POLARIZATIONS.index(polarization)] = size
    return out


def directions(given: ArrayLike) -> Floats:
    """Return unit directions (n, 3). Raises: ValueError for another shape or length."""
    found = given if isinstance(given, np.ndarray) and given.dtype == np.float64 else reals("direction", given)
    if found.ndim == 1:
        found = found[None]
    if found.ndim != 2 or found.shape[1] != 3:
        raise ValueError(f"direction of shape {found.shape}: unit vectors of shape (n, 3) are wanted")
    square = np.einsum("nc,nc->n", found, found)
    off = (np.abs(square - 1.0) > _NOT_UNIT) & (square > 0.0)  # a path of no length has no direction
    if off.any():
        row = int(np.flatnonzero(off)[0])
        size = float(np.linalg.norm(found[row]))
        raise ValueError(f"direction[{row}] = {found[row].tolist()}: of length 1 is wanted, not {size:g}")
    return found


def check(polarization: str, loss_db: float = 0.0, **positive: float) -> None:
    """Raise ValueError on a polarisation other than V or H, a loss beyond limits, or another figure not positive."""
    if not is_one_of(polarization, POLARIZATIONS):
        raise ValueError(f"polarization = {shown(polarization)}: must be V or H{meant(polarization, POLARIZATIONS)}")
    LOSS_DB.check("loss_db", finite("loss_db", loss_db))
    for name, value in positive.items():
        if finite(name, value) <= 0.0:
            raise ValueError(f"{name} = {value!r}: must be positive and finite")


@dataclass(frozen=True)
class IsotropicAntenna:
    """Gain 1 everywhere, or, if `front`, gain 2 ahead of the plane x = 0 and none behind.

    Args: polarization V or H; front; loss_db [dB], below 0 where a published gain is above this pattern's.
    """

    polarization: str = "V"
    front: bool = False
    loss_db: float = 0.0

    def __post_init__(self) -> None:
        check(self.polarization, self.loss_db)
        check_type("front", self.front, bool)
        check_declared(IsotropicAntenna, vars(self))

    def field(self, direction: ArrayLike) -> Complexes:
        """Return sqrt(gain) along theta-hat and phi-hat (n, 2) of unit directions (n, 3)."""
        direction = directions(direction)
        gain = float(undb(-self.loss_db)) * (2.0 * (direction[:, 0] >= 0.0) if self.front else np.ones(len(direction)))
        return polarized(np.sqrt(gain), self.polarization)


@dataclass(frozen=True)
class Repolarized:
    """Another antenna's pattern with another polarisation: V or H alone, or "cross", V and H exchanged."""

    antenna: Antenna
    polarization: str

    def field(self, direction: Floats) -> Complexes:
        """Return sqrt(gain) along theta-hat and phi-hat (n, 2) of unit directions (n, 3)."""
        given = self.antenna.field(direction)
        if self.polarization == "cross":
            return np.asarray(given[:, ::-1])
        out = np.zeros_like(given)
        # One of both is zero where the antenna has one polarisation.
        out[:, POLARIZATIONS.index(self.polarization)] = given.sum(axis=1)
        return out


@dataclass(frozen=True)
class CosineAntenna:
    """A patch: gain falls as cos^p of the angle off boresight, p by the half-power widths; nothing behind.

    Args: hpbw_h_deg, hpbw_v_deg half-power beam widths [deg] in the horizontal and the vertical plane; polarization V
    or H; loss_db [dB], below 0 where a published gain is above this pattern's. Between the two planes p follows the
    direction's angle about the boresight, so that there is no seam.
    Raises: ValueError for widths not between 0 and 180 deg.
    """

    hpbw_h_deg: float
    hpbw_v_deg: float
    polarization: str = "V"
    loss_db: float = 0.0

    def __post_init__(self) -> None:
        check(self.polarization, self.loss_db, hpbw_h_deg=self.hpbw_h_deg, hpbw_v_deg=self.hpbw_v_deg)
        check_declared(CosineAntenna, vars(self))
        for name in ("hpbw_h_deg", "hpbw_v_deg"):
            if getattr(self, name) >= 180.0:
                wide = f"{name} = {getattr(self, name):g} deg"
                raise ValueError(f"a half-power beam width of a cosine pattern must be below 180 deg: {wide}")

    def shape(self, direction: Floats) -> Floats:
        """Return the power pattern (n,), 1 at its peak."""
        exponents = (
            math.log(0.5) / math.log(math.cos(math.radians(0.5 * w))) for w in (self.hpbw_h_deg, self.hpbw_v_deg)
        )
        found: Floats = cosine_power(np.asarray(direction, float), *exponents)
        return found

    @cached_property
    def peak_gain(self) -> float:
        """Gain at boresight, losses in."""
        return float(undb(-self.loss_db)) / mean_over_sphere(self.shape, 1.0)

    def field(self, direction: ArrayLike) -> Complexes:
        """Return sqrt(gain) along theta-hat and phi-hat (n, 2) of unit directions (n, 3)."""
        return polarized(np.sqrt(self.peak_gain * self.shape(directions(direction))), self.polarization)


@dataclass(frozen=True)
class ArrayAntenna:
    """A plane of ny by nz equal elements in phase, its gain from the integral of the pattern over the sphere.

    Args: ny, nz elements; spacing_y, spacing_z [wavelengths]; taper_y, taper_z names of windows; element, by default
    isotropic ahead; loss_db [dB], below 0 where a published gain is above this pattern's. The pattern is element times
    array factor, without coupling.
    Raises: ValueError for an unknown window or a number that is not positive.
    """

    ny: int
    nz: int
    spacing_y: float
    spacing_z: float
    taper_y: str = "rect"
    taper_z: str = "rect"
    element: Antenna = field(default_factory=lambda: IsotropicAntenna(front=True))
    loss_db: float = 0.0

    def __post_init__(self) -> None:
        check("V", self.loss_db, ny=self.ny, nz=self.nz, spacing_y=self.spacing_y, spacing_z=self.spacing_z)
        check_declared(ArrayAntenna, vars(self))
        if max(self.ny, self.nz) > _LONGEST:
            raise ValueError(f"ny, nz = {self.ny!r}, {self.nz!r}: at most {_LONGEST} elements a row")
        check_window("taper_y", self.taper_y)
        check_window("taper_z", self.taper_z)

    @cached_property
    def _series(self) -> tuple[Floats, Floats]:
        # Element i sits at (i - (n-1)/2) d, and cos(2 pi d u (i - (n-1)/2)) is the Chebyshev polynomial of degree
        # |2i - (n-1)| in cos(pi d u): the array factor is one series, summed by Clenshaw.
        made = []
        for n, taper in ((self.ny, self.taper_y), (self.nz, self.taper_z)):
            series = np.zeros(n)
            weights = window(taper, n)
            np.add.at(series, np.abs(2 * np.arange(n) - (n - 1)), weights / weights.sum())
            made.append(series)
        return made[0], made[1]

    def _unscaled(self, direction: Floats) -> Complexes:
        y, z = self._series
        factor = chebval(np.cos(np.pi * self.spacing_y * direction[:, 1]), y)
        factor *= chebval(np.cos(np.pi * self.spacing_z * direction[:, 2]), z)
        return np.asarray(self.element.field(direction) * factor[:, None])

    @cached_property
    def _scale(self) -> float:
        extent = max(self.ny * self.spacing_y, self.nz * self.spacing_z)
        power = mean_over_sphere(lambda d: (np.abs(self._unscaled(d)) ** 2).sum(axis=1), extent)
        return math.sqrt(float(undb(-self.loss_db)) / power)

    def field(self, direction: ArrayLike) -> Complexes:
        """Return sqrt(gain) along theta-hat and phi-hat (n, 2) of unit directions (n, 3)."""
        return self._unscaled(directions(direction)) * self._scale


def mean_over_sphere(power: Callable[[Floats], Floats], extent: float) -> float:
    """Return the mean over all directions of a power pattern: a function of unit vectors (n, 3) to (n,).

    Args: extent of the antenna in wavelengths, which sets how fine the pattern is. Gauss-Legendre in the cosine of the
    angle off boresight, half sphere by half sphere (a pattern may jump at the plane x = 0), trapezoid around it.
    """
    n = int(48 + 8 * extent)
    knots, weights = np.polynomial.legendre.leggauss(n)
    around = 2.0 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
    total = 0.0
    for side in (-1.0, 1.0):
        x = np.repeat(0.5 * (knots + side), 2 * n)
        off = np.sqrt(1.0 - x**2)
        d = np.stack([x, off * np.tile(np.cos(around), n), off * np.tile(np.sin(around), n)], axis=1)
        total += float(power(d).reshape(n, -1).mean(axis=1) @ weights) / 4.0
    return total
