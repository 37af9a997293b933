"""Point-in-body test: whether a point is outside a surface, inside it, on it, or in the plane of a facet; and what of
the surface is nearest to it."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.closed_surfaces import clearance, winding

Floats = NDArray[np.float64]

_ON = 1e-6  # m: a point nearer to a facet than this is on it
_EDGE_ON = 1e-12  # of its distance: a point nearer to the plane of a facet lies in it
_MAY_BE = 1e-11  # of the largest coordinates: a height that may be less than that, rounding included
_WHOLE = 0.01  # deviation of a winding number from an integer: in an open body it is no integer


class Place(IntEnum):
    """Position of a point relative to a surface."""

    OUTSIDE = 0
    INSIDE = 1
    ON = 2


def within(bounds: Floats, point: Floats) -> bool:
    """Return whether a point (3,) [m] is within bounds (2, 3) [m], or on them."""
    return bool((point >= bounds[0] - _ON).all() and (point <= bounds[1] + _ON).all())


def place_of(corners: Floats, point: Floats) -> Place:
    """Return the position of a point (3,) [m] relative to a surface of facets (n, 3, 3) [m]; an open one has no
    inside."""
    point = np.asarray(point, float)
    if not len(corners):
        return Place.OUTSIDE
    if not within(np.array([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))]), point):
        return Place.OUTSIDE
    v = np.ascontiguousarray(corners)
    if clearance(v, point) <= _ON:
        return Place.ON
    turns = winding(v, point)
    return Place.INSIDE if abs(turns) > 0.5 and abs(turns - round(turns)) < _WHOLE else Place.OUTSIDE


def nearest_on(corners: Floats, point: Floats) -> Floats:
    """Return the point (3,) [m] of facets (n, 3, 3) [m] that is nearest to a point (3,) [m]."""
    from trimesh.triangles import closest_point

    middle = corners.mean(axis=1)
    far, size = np.linalg.norm(middle - point, axis=1), np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    near = corners[far - size <= (far + size).min()]
    found = closest_point(near, np.broadcast_to(point, (len(near), 3)))
    return np.asarray(found[np.argmin(np.linalg.norm(found - point, axis=1))])


def in_plane_of(planes: tuple[Floats, Floats, Floats], point: Floats) -> int:
    """Return the number of facets whose plane contains a point (3,) [m]: it sees them edge-on.

    Args: planes, a corner (n, 3) [m] of each facet, its unit normal (n, 3), zero where it has no area, and how far
    along it the plane lies from the origin (n,) [m].
    """
    first, normal, level = planes
    point = np.asarray(point, float)
    # Few facets are left whose height is needed free of the rounding of large coordinates.
    largest = np.abs(point).max() + np.abs(first).max(initial=0.0)
    near = np.flatnonzero(np.abs(normal @ point - level) <= _MAY_BE * largest)
    off, normal = point - first[near], normal[near]
    height = np.abs(np.einsum("ij,ij->i", off, normal))
    return int(((height <= _EDGE_ON * np.linalg.norm(off, axis=1)) & normal.any(axis=1)).sum())


def refuse_within(corners: Floats, point: Floats, what: str) -> None:
    """Raise ValueError where a point (3,) [m], called `what`, is inside a surface of facets (n, 3, 3) [m] or on it."""
    place = place_of(corners, point)
    if place != Place.OUTSIDE:
        where = "inside" if place == Place.INSIDE else "on"
        at = ", ".join(f"{x:.6g}" for x in point)
        raise ValueError(f"{what} at ({at}) m is {where} the mesh: must be outside")
