"""Rays that follow waves over the surfaces of a scene as over plane mirrors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import LAYER
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RAYS = 6_000  # at most, of all groups as many; the rest of a group counts as these do (not measured)
NARROW = 0.01  # rad between normals or to the receiver that counts as none (not measured)
_LAYERS = 8  # that a ray passes at most; not measured
_START = 1e-3  # m from which hits count: places of paths are rounded


@dataclass(frozen=True)
class Followed:
    """Rays over mirrors: which (m,) met as many as asked for; where, with which normals (m, b, 3), of which facets
    (m, b), and whither they leave (m, 3)."""

    row: Ints
    at: Floats
    normal: Floats
    facet: NDArray[np.int32]
    leaves: Floats


def followed(geometry: Geometry, start: Floats, towards: Floats, bounces: int) -> Followed:
    """Return how rays from a point (3,), or points (m, 3), to points (m, 3) run over as many mirrors."""
    row, facet = np.arange(len(towards)), np.full(len(towards), -1, np.int32)
    begin, leaves = np.array(np.broadcast_to(start, towards.shape)), unit(towards - start)
    at, normals = np.zeros((2, len(towards), bounces, 3))
    facets = np.zeros((len(towards), bounces), np.int32)
    for k in range(bounces):
        facet, reach = _cast(geometry, begin[row], leaves[row], facet)
        met = facet >= 0
        row, facet = row[met], facet[met]
        begin[row] += reach[met, None] * leaves[row]
        normal = geometry.normal[facet]
        leaves[row] -= 2.0 * np.einsum("ij,ij->i", leaves[row], normal)[:, None] * normal
        at[row, k], normals[row, k], facets[row, k] = begin[row], normal, facet
    return Followed(row, at[row], normals[row], facets[row], leaves[row])


def _cast(geometry: Geometry, start: Floats, way: Floats, facet: NDArray[np.int32]) -> tuple[NDArray[np.int32], Floats]:
    """Return which facets (m,) rays meet beyond the ones that they leave, and at which distance (m,) [m]: straight
    through thin layers, of which most passes."""
    f = geometry.facets
    thin = (f.materials.kind == LAYER)[f.material]
    hit, reach = geometry.cast(start, way, facet, np.full(len(start), _START))
    for _ in range(_LAYERS):
        on = np.flatnonzero((hit >= 0) & thin[hit])
        if not len(on):
            break
        then = start[on] + reach[on, None] * way[on]
        hit[on], more = geometry.cast(then, way[on], hit[on], np.full(len(on), _START))
        reach[on] += more
    return hit, reach


def meets(geometry: Geometry, rays: Followed, end: Floats, slack: Floats) -> NDArray[np.bool_]:
    """Return which rays leave towards a point (3,) that nothing hides, to within angles (m,) [rad]."""
    towards = end - rays.at[:, -1]
    far = np.linalg.norm(towards, axis=1)
    towards = unit(towards)
    near = np.flatnonzero(np.linalg.norm(rays.leaves - towards, axis=1) < slack)
    hits = _cast(geometry, rays.at[near, -1], towards[near], rays.facet[near, -1])[1]
    out = np.zeros(len(far), bool)
    out[near] = hits > far[near]
    return out


def of_each(group: Ints) -> Ints:
    """Return rows of groups (n,), numbered from 0, of all groups as many and at most RAYS."""
    count = np.bincount(group)
    # Small numbers sort several times as fast.
    rows = np.argsort(group.astype(np.min_scalar_type(len(count))), kind="stable")
    place = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
    groups = max(int(np.count_nonzero(count)), 1)
    every = np.repeat(-(-count // max(RAYS // groups, 1)), count)
    return rows[place % every == 0]


def unit(v: Floats) -> Floats:
    """Return vectors (m, 3) of length 1; those of none stay."""
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1), 1e-300)[:, None])
