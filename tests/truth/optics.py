"""Geometrical optics of spheres: a narrow bundle of rays is reflected from one to the next, each by its own formula."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Floats = NDArray[np.float64]
Sphere = tuple[Floats, float]
"""Centre (3,) [m] and radius [m]."""

_TURN = 1e-6  # rad between rays of a bundle


def unit(v: Floats) -> Floats:
    """Return a vector of length one."""
    return v / np.linalg.norm(v)


def shortest_way(end: Floats, spheres: Sequence[Sphere]) -> tuple[Floats, float]:
    """Return the first point (3,) [m] of the shortest way from an end over points of spheres and back, and its length
    [m]: by Fermat the way of a ray that they reflect."""

    def points(angles: Floats) -> list[Floats]:
        way = [end]
        for (centre, radius), (turn, up) in zip(spheres, angles.reshape(-1, 2), strict=True):
            normal = np.array([np.cos(turn) * np.cos(up), np.sin(turn) * np.cos(up), np.sin(up)])
            way.append(centre + radius * normal)
        return [*way, end]

    def length(angles: Floats) -> float:
        return float(np.linalg.norm(np.diff(points(angles), axis=0), axis=1).sum())

    centres = [end, *(centre for centre, _ in spheres), end]
    normals = [unit(unit(a - b) + unit(c - b)) for a, b, c in zip(centres, centres[1:], centres[2:], strict=False)]
    begin = np.concatenate([[np.arctan2(n[1], n[0]), np.arcsin(n[2])] for n in normals])
    found = minimize(length, begin, method="BFGS", options={"gtol": 1e-13})
    return points(found.x)[1], float(found.fun)


def field_back(end: Floats, towards: Floats, spheres: Sequence[Sphere]) -> float:
    """Return the field [1/m] that comes back to an end which sends 1 V/m at 1 m into direction `towards` (3,), over
    perfectly conducting spheres in order: the root of the solid angle of a bundle over its area."""
    across = unit(np.cross(towards, [0.3, 0.5, 0.8]))
    up = np.cross(towards, across)

    def reflected(direction: Floats) -> tuple[Floats, Floats]:
        place = end
        for centre, radius in spheres:
            from_centre = place - centre
            along = from_centre @ direction
            ahead = -along - np.sqrt(along**2 - from_centre @ from_centre + radius**2)
            place = place + ahead * direction
            normal = (place - centre) / radius
            direction = direction - 2.0 * (direction @ normal) * normal
        return place, direction

    _, back = reflected(towards)
    corners = []
    for turn in (across, -across, up, -up):
        place, direction = reflected(unit(towards + _TURN * turn))
        corners.append(place + ((end - place) @ back) / (direction @ back) * direction)
    area = np.linalg.norm(np.cross(corners[0] - corners[1], corners[2] - corners[3]))
    return float(2.0 * _TURN / np.sqrt(area))
