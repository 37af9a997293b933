"""Spheres inside closed bodies: what lies in the shadow of one is hidden by the body, so it can be culled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from raychan.geometry.closed_surfaces import clearance, crossed_cells, winding

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

LEAST = 0.28  # m: radius under which a sphere hides too little to be searched; not measured
_MOST = 8  # spheres of one body; not measured
_LEAST_SHARE = 0.3  # of the largest sphere's radius, the smallest; not measured
_CELLS = 24  # along the longest side of the grid in which spheres are searched; not measured
_TRIES = 3 * _MOST  # places tried; not measured
_WINDING_ERROR = 0.01  # of a winding number from a whole one: facets that disagree on what is outside have more
_INNER = 0.999  # of the distance to the nearest facet: rounding of a ray must not pass between


def inner_spheres_of(v: Floats) -> tuple[Floats, Floats]:
    """Return centres (k, 3) [m] and radii (k,) [m] of spheres inside a closed surface, the largest first.

    Every ray from outside that enters one meets a facet: no sphere holds a facet, and the surface winds about each.

    Args: v (n, 3, 3) corners [m] of the surface's facets: each edge belongs to two.
    """
    none = np.zeros((0, 3)), np.zeros(0)
    if not len(v):
        return none
    low, high = v.min(axis=(0, 1)), v.max(axis=(0, 1))
    if float((high - low).min()) < 2.0 * LEAST:
        return none
    cell = float((high - low).max()) / _CELLS
    # A layer of cells all around, so that the outside is one piece.
    low = low - 1.5 * cell
    shape = np.ceil((high - low) / cell).astype(np.int64) + 2
    free = ~crossed_cells(v, low, cell, shape)
    piece = label(free)[0]
    free &= piece != piece[0, 0, 0]
    # From a cell's centre to the nearest crossed cell's is at most this much more than to the facet in it.
    room = cell * (distance_transform_edt(free) - 0.5 * math.sqrt(3.0))
    centres, radii, inside, tries = list[Floats](), list[float](), dict[int, bool](), 0
    for at in np.argsort(-room, axis=None, kind="stable"):
        i, j, k = np.unravel_index(at, room.shape)
        if (
            len(radii) == _MOST
            or tries == _TRIES
            or room[i, j, k] < max(0.5 * LEAST, _LEAST_SHARE * max(radii, default=0.0))
        ):
            break
        centre = low + cell * (np.array([i, j, k]) + 0.5)
        if any(np.linalg.norm(centre - c) < r for c, r in zip(centres, radii, strict=True)):
            continue
        number = int(piece[i, j, k])
        if number not in inside:
            turns = winding(v, centre)
            inside[number] = abs(turns) > 0.5 and abs(turns - round(turns)) < _WINDING_ERROR
        tries += 1
        radius = _INNER * float(clearance(v, centre)) if inside[number] else 0.0
        if radius >= LEAST:
            centres.append(centre)
            radii.append(radius)
    if not radii:
        return none
    order = np.argsort(-np.array(radii), kind="stable")
    return np.array(centres)[order], np.array(radii)[order]
