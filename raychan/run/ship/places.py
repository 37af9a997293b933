"""Where the scanner of a ship cannot be, and a voyage takes it all the same: within bodies, and under waves."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from raychan.sensors.sea import Waves
from raychan.world.body import Body
from raychan.world.point_in_body import Place, place_of, within

UNDER_WATER = "under water"
"""Where a scanner is whose beams start under a wave; bodies are told by their names."""


def lost_in(place: NDArray[np.float64], time: float, bodies: Iterable[Body], sea: Waves | None) -> str:
    """Return in which closed body a place (3,) [m] lies at a time [s], or that it lies under water; '' for neither.

    Args: sea whose time 0 is this time, None without waves.
    """
    for body in bodies:
        mesh, local = body.geometry, body.motion.to_body(place, time)
        if within(mesh.bounds, local) and place_of(mesh.corners, local) == Place.INSIDE:
            return body.name
    if sea is not None and float(sea.height(place[0], place[1])) > place[2]:
        return UNDER_WATER
    return ""


class LostScans:
    """The scans of a voyage that began where no scanner can be: how many, and when first, by the place."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[int, float]] = {}

    def add(self, where: str, time: float) -> None:
        """Take a scan that began at a time [s] in what `lost_in` says."""
        if where:
            count, first = self._found.get(where, (0, time))
            self._found[where] = count + 1, first

    @property
    def summary(self) -> dict[str, dict[str, float]]:
        """What summary.json holds."""
        return {where: {"scans": count, "first_s": first} for where, (count, first) in self._found.items()}


def lost_lines(found: dict[str, dict[str, float]], scans: int) -> list[str]:
    """Return a line for each place where scans began, of the scans of a voyage, as `LostScans.summary` tells them."""
    said = []
    for where, one in found.items():
        what = "under waves" if where == UNDER_WATER else f"inside '{where}' (nothing stops the ship)"
        count, first = int(one["scans"]), one["first_s"]
        said.append(f"{count:,} of {scans:,} scans begin {what}, the first at {first:.2f} s: their ranges mean nothing")
    return said
