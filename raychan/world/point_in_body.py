"""Point-in-body test: whether a point is outside a surface, inside it, on it, or in the plane of a facet."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.closed_surfaces import clearance, winding
from raychan.geometry.triangles import planes_of

Floats = NDArray[np.float64]

_ON = 1e-6  # m: a point nearer to a facet than this is on it
_WHOLE = 0.01  # deviation of a winding number from an integer: in an open body it is no integer


class Place(IntEnum):
    """Position of a point relative to a surface."""

    OUTSIDE = 0
    INSIDE = 1
    ON = 2


def place_of(corners: Floats, point: Floats) -> Place:
    """Return the position of a point (3,) [m] relative to a surface of facets (n, 3, 3) [m]; an open one has no
    inside."""
    point = np.asarray(point, float)
    if not len(corners):
        return Place.OUTSIDE
    low, high = corners.min(axis=(0, 1)) - _ON, corners.max(axis=(0, 1)) + _ON
    if (point < low).any() or (point > high).any():
        return Place.OUTSIDE
    v = np.ascontiguousarray(corners)
    if clearance(v, point) <= _ON:
        return Place.ON
    turns = winding(v, point)
    return Place.INSIDE if abs(turns) > 0.5 and abs(turns - round(turns)) < _WHOLE else Place.OUTSIDE


def in_plane_of(corners: Floats, point: Floats) -> int:
    """Return the number of facets, of (n, 3, 3) [m], whose plane contains a point (3,) [m]: it sees them edge-on."""
    normal, area = planes_of(np.ascontiguousarray(corners))
    off = np.asarray(point, float) - corners[:, 0]
    height = np.abs(np.einsum("ij,ij->i", off, normal))
    return int(((height <= 1e-12 * np.linalg.norm(off, axis=1)) & (area > 0.0)).sum())


def refuse_within(corners: Floats, point: Floats, what: str) -> None:
    """Raise ValueError where a point (3,) [m], called `what`, is inside a surface of facets (n, 3, 3) [m] or on it."""
    place = place_of(corners, point)
    if place != Place.OUTSIDE:
        where = "inside" if place == Place.INSIDE else "on"
        at = ", ".join(f"{x:.6g}" for x in point)
        raise ValueError(f"{what} at ({at}) m is {where} the mesh: must be outside")
