"""The field of a radar in each direction, from a table: tubes are launched where its antennas look."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from raychan.poses import direction
from raychan.radar.beam_kernels import fields_towards

Floats = NDArray[np.float64]

_NARROW = 0.5  # rad: what is seen under a larger angle is not looked at
_CELL = 1.5 * np.pi / 180.0  # rad: no farther off are the corners of a direction's cell of the table
_ALIKE = 1e-3  # of the peak: directions in which a field is as strong; not measured
_TURNS = 8  # cuts through the peak in which its width is measured
_STEPS = 180  # of elevation, and half of those of azimuth: no beam of use is narrower than a few of them


class Beam:
    """The field of the stronger of a radar's two antennas in each direction, relative to its strongest."""

    def __init__(self, radar: Any) -> None:
        azimuth = np.linspace(-np.pi, np.pi, 2 * _STEPS + 1)
        elevation = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _STEPS + 1)
        look = direction(*(x.ravel() for x in np.meshgrid(azimuth, elevation)))
        shape = len(elevation), len(azimuth)
        sizes = [np.linalg.norm(f(look), axis=1).reshape(shape) for f in (radar.tx_field, radar.rx_field)]
        self.bend = sum(_bend(f, look, s.ravel()) for f, s in zip((radar.tx_field, radar.rx_field), sizes, strict=True))
        """Second derivative [1/rad^2], at its peak, of the product of both antennas' fields, over the peak."""
        self.table = np.maximum.reduce([s / max(s.max(), 1e-300) for s in sizes])
        self._look = look
        self.ends: Floats = getattr(radar, "gain_ends", np.zeros((0, 3)))
        """Normals (k, 3) of the planes through an antenna behind which its gain ends at once."""

    def __call__(self, look: Floats) -> Floats:
        """Return the relative field (n,) in unit directions (n, 3), world axes, away from the radar."""
        found: Floats = fields_towards(np.ascontiguousarray(look), self.table)
        return found

    def outside_beam(self, look: Floats, around: Floats) -> NDArray[np.bool_]:
        """Tell about which unit directions (n, 3) the field is zero everywhere within angles (n,) [rad]."""
        out = np.zeros(len(look), bool)
        if self._lit is None:
            return out
        # Where there is some field itself, nothing needs to be searched.
        rows = np.flatnonzero(around < _NARROW)
        rows = rows[self(look[rows]) == 0.0]
        if len(rows):
            reach = 2.0 * np.sin(0.5 * (around[rows] + _CELL))
            # Without a bound the tree is searched through and through for what lies opposite.
            out[rows] = self._lit.query(look[rows], distance_upper_bound=reach.max() + 1e-6)[0] > reach
        return out

    @cached_property
    def _lit(self) -> Any:
        """The directions of the table in which there is some field, as a tree; None where that is all of them."""
        some = self.table.ravel() > 0.0
        return None if some.all() else cKDTree(self._look[some])


def _bend(field: Callable[[Floats], Any], look: Floats, size: Floats) -> float:
    """Return the second derivative [1/rad^2] of an antenna's field at its peak over the peak: that of a Gauss curve as
    wide at half the power, where it is narrowest; 0 of one that falls nowhere.

    Args: field; its size (n,) in unit directions look (n, 3), as close to each other as those of the table.
    """
    # Of a field that is alike in many directions the one in the middle of them.
    some = look[size >= (1.0 - _ALIKE) * size.max()]
    peak = some[np.argmax(some @ some.mean(axis=0))]
    side = np.cross(peak, np.eye(3)[np.argmin(np.abs(peak))])
    side /= np.linalg.norm(side)
    turn, off = np.arange(2 * _TURNS) * np.pi / _TURNS, np.linspace(0.0, 0.5 * np.pi, 2 * _STEPS + 1)
    across = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(peak, side)
    rays = np.cos(off)[:, None] * peak + np.sin(off)[:, None] * across[:, None]
    power = np.linalg.norm(field(rays.reshape(-1, 3)), axis=1).reshape(rays.shape[:2]) ** 2
    falls = power < 0.5 * power[:, :1]
    reach = np.where(falls.any(axis=1), off[np.argmax(falls, axis=1)], np.inf)
    width = float((reach[:_TURNS] + reach[_TURNS:]).min())
    return 4.0 * math.log(2.0) / width**2


def beam_of(radar: Any) -> Beam:
    """Return the beam of a radar, cached with the radar if it has a cache."""
    kept: dict[Any, Beam] = getattr(radar, "kept", {})
    if Beam not in kept:
        kept[Beam] = Beam(radar)
    return kept[Beam]
