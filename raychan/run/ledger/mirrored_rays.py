"""Rays that follow waves over the surfaces of a scene as over plane mirrors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.records import LAYER
from raychan.tracing.tubes import unit
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RAYS = 6_000  # at most, of all groups as many; the rest of a group counts as these do (not measured)
_MOST = 4 * RAYS  # parts of rays that thin layers split, at most; of more some (not measured)
NARROW = 0.01  # rad between normals or to the receiver that counts as none (not measured)
_LAYERS = 8  # that a ray passes at most; not measured
_START = 1e-3  # m from which hits count: places of paths are rounded


@dataclass(frozen=True)
class Followed:
    """Rays over mirrors: which (m,) met as many as asked for, again for each of its ways; where, with which normals
    (m, b, 3), of which facets (m, b), and whither they leave (m, 3)."""

    row: Ints
    at: Floats
    normal: Floats
    facet: NDArray[np.int32]
    leaves: Floats


def followed(geometry: Geometry, start: Floats, towards: Floats, bounces: int, split: int) -> Followed:
    """Return how rays from a point (3,), or points (m, 3), to points (m, 3) run over as many mirrors: what meets a thin
    layer goes on, and at the first `split` bounces is mirrored, too."""
    row, facet = np.arange(len(towards)), np.full(len(towards), -1, np.int32)
    begin, leaves = np.array(np.broadcast_to(start, towards.shape)), unit(towards - start)
    at, normals = np.zeros((2, len(towards), bounces, 3))
    facets = np.zeros((len(towards), bounces), np.int32)
    for k in range(bounces):
        ray, facet, reach = _met(geometry, begin, leaves, facet, k < split)
        every = max(-(-len(ray) // _MOST), 1)
        ray, facet, reach = ray[::every], facet[::every], reach[::every]
        row, at, normals, facets = row[ray], at[ray], normals[ray], facets[ray]
        begin, normal = begin[ray] + reach[:, None] * leaves[ray], geometry.normal[facet]
        leaves = leaves[ray] - 2.0 * np.einsum("ij,ij->i", leaves[ray], normal)[:, None] * normal
        at[:, k], normals[:, k], facets[:, k] = begin, normal, facet
    return Followed(row, at, normals, facets, leaves)


def _met(
    geometry: Geometry, start: Floats, way: Floats, facet: NDArray[np.int32], split: bool
) -> tuple[Ints, NDArray[np.int32], Floats]:
    """Return which of some rays (m,), beyond the facets (m,) that they leave, meet which facets at which distance [m]:
    each the first opaque one, and if `split` the thin layers before it, of which most passes."""
    thin = _thin(geometry)
    ray, hit, reach = np.arange(len(start)), facet, np.zeros(len(start))
    found: list[tuple[Ints, NDArray[np.int32], Floats]] = []
    for _ in range(_LAYERS + 1):
        hit, more = geometry.cast(start[ray] + reach[:, None] * way[ray], way[ray], hit, np.full(len(ray), _START))
        met = hit >= 0
        ray, hit, reach = ray[met], hit[met], reach[met] + more[met]
        on = thin[hit]
        counts = np.full(len(ray), True) if split else ~on
        found.append((ray[counts], hit[counts], reach[counts]))
        ray, hit, reach = ray[on], hit[on], reach[on]
        if not len(ray):
            break
    rays, facets, distances = (np.concatenate(x) for x in zip(*found, strict=True))
    return rays, facets, distances


def _thin(geometry: Geometry) -> NDArray[np.bool_]:
    """Return which facets (n,) are thin layers."""
    f = geometry.facets
    return np.asarray((f.materials.kind == LAYER)[f.material])


def meets(geometry: Geometry, rays: Followed, end: Floats, slack: Floats) -> NDArray[np.bool_]:
    """Return which rays leave towards a point (3,) that nothing hides, to within angles (m,) [rad]."""
    towards = end - rays.at[:, -1]
    far = np.linalg.norm(towards, axis=1)
    towards = unit(towards)
    near = np.flatnonzero(np.linalg.norm(rays.leaves - towards, axis=1) < slack)
    ray, _, reach = _met(geometry, rays.at[near, -1], towards[near], rays.facet[near, -1], False)
    out = np.zeros(len(far), bool)
    out[near] = True
    out[near[ray[reach < far[near[ray]]]]] = False
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
