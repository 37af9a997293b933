"""Legs that may carry anything: those of which each mirror is seen from the one before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import MIRROR
from raychan.tracing.legs import Leg
from raychan.tracing.mirrors import Mirror
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Chain = tuple[Mirror, ...]

_APART = 0.15  # m between points of a mirror: below a Fresnel zone at street distances (0.2 m at 20 m, 77 GHz)
_LEAST, _MOST = 64, 2000  # points of a mirror, for small and for large ones: rays against gaps missed; not measured
_SLACK = 1e-6  # m


def lit_legs(geometry: Geometry, legs: list[Leg], layers: int) -> Bools:
    """Return which legs (n,) may carry anything: those of which each mirror is seen from the one before, at one of
    many points on it. The ground always is.

    Args: legs of one end, shorter ones first, as `legs_over` gives them; layers that a stretch may pass. An estimate: a
    mirror seen only through a gap narrower than its points are apart is missed.
    """
    number: dict[Chain, int] = {leg.mirrors: i for i, leg in enumerate(legs)}
    found = np.ones(len(legs), bool)
    points: dict[int, tuple[Floats, Ints]] = {}
    for i, leg in enumerate(legs):
        if not leg.mirrors:
            continue
        last, before = leg.mirrors[-1], number.get(leg.mirrors[:-1])
        if before is None or geometry.facets.role[last.body] == MIRROR:
            found[i] = before is None or found[before]
            continue
        if found[before] and last.facet not in points:
            points[last.facet] = _points_on(geometry, last.facet)
        found[i] = found[before] and _seen(geometry, legs[before], *points[last.facet], layers)
    return found


def _seen(geometry: Geometry, leg: Leg, points: Floats, facet: Ints, layers: int) -> bool:
    return bool(leg.visible(geometry, points, facet, np.full(len(points), _SLACK), layers).seen.any())


def _points_on(geometry: Geometry, facet: int) -> tuple[Floats, Ints]:
    """Return points (n, 3) [m] spread over the plane of a facet, and their facets (n,)."""
    rows = np.flatnonzero(geometry.plane == geometry.plane[facet])
    area = np.cumsum(geometry.area[rows])
    count = int(np.clip(area[-1] / _APART**2, _LEAST, _MOST))
    rng = np.random.default_rng(0)
    own = rows[np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])]
    u = np.sort(rng.random((count, 2)), axis=1)
    share = np.stack([u[:, 0], u[:, 1] - u[:, 0], 1.0 - u[:, 1]], axis=1)
    return np.einsum("nc,nci->ni", share, geometry.facets.vertices[own]), own.astype(np.int32)
