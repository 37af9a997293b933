"""Plane mirrors of a scene, and the legs over them by image points (image method)."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from raychan.radar.beam_table import Beam
from raychan.records import BLOCKER, MIRROR
from raychan.tracing.cache import cache_of
from raychan.tracing.legs import Leg, Mirror
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_LEAST_AREA = 0.5  # m^2 of a mirror; at street distances smaller faces lie within a few Fresnel zones
_MOST = 24  # mirrors kept as seen from one end: bounds the number of legs; not measured


def planes_that_mirror(geometry: Geometry, end: Floats) -> list[Mirror]:
    """Return the mirrors that `end` (3,) [m] could use: ground planes, and the plane faces of at least half a square
    metre that look largest from there. Smaller faces only scatter."""
    f = geometry.facets
    if not len(f.vertices):
        return []
    usable = ~geometry.curved & (f.role[f.body] != BLOCKER)
    area = np.bincount(geometry.plane, weights=np.where(usable, geometry.area, 0.0))
    largest = np.full(len(area), -1, np.int64)
    order = np.argsort(geometry.area, kind="stable")
    largest[geometry.plane[order]] = order
    found: list[tuple[float, Mirror]] = []
    for plane in np.flatnonzero(area >= _LEAST_AREA):
        facet = int(largest[plane])
        body = int(f.body[facet])
        height = float((end - geometry.first[facet]) @ geometry.normal[facet])
        if height < 0.0 and not geometry.both_sides[facet]:
            continue
        mirror = Mirror.of(geometry, facet, 1.0 if height >= 0.0 else -1.0)
        view = area[plane] * abs(height) / np.linalg.norm(end - mirror.centre) ** 3
        found.append((np.inf if f.role[body] == MIRROR else view, mirror))
    found.sort(key=lambda pair: -pair[0])
    return [m for _, m in found[:_MOST]]


def legs_over(geometry: Geometry, end: Floats, bounces: int, beam: Beam | None = None) -> list[Leg]:
    """Return the legs from `end` (3,) [m], whose antenna has a `beam`, over at most `bounces` mirrors, the direct one
    first."""
    direct = Leg(end=np.asarray(end, float), beam=beam)
    legs = [direct]
    if bounces < 1:
        return legs
    mirrors = planes_that_mirror(geometry, direct.end)
    everything = mirrors if bounces < 2 else _both_sides(geometry, mirrors)
    for count in range(1, bounces + 1):
        for chain in permutations(everything, count):
            if _possible(direct.end, chain):
                legs.append(Leg(end=direct.end, mirrors=chain, beam=beam))
    return legs


def _both_sides(geometry: Geometry, mirrors: list[Mirror]) -> list[Mirror]:
    """Return the mirrors, and the backs of those that reflect on both sides: a second mirror may be met from behind."""
    backs = [m.turned() for m in mirrors if geometry.both_sides[m.facet]]
    return mirrors + [m for m in backs if geometry.facets.role[m.body] != MIRROR]


def _possible(end: Floats, chain: tuple[Mirror, ...]) -> bool:
    """Tell whether every image lies in front of the mirror it is mirrored at."""
    x = end
    for m in chain:
        if (x - m.point) @ m.normal <= 1e-9:
            return False
        x = m.image(x)
    return True


def reachable(geometry: Geometry, leg: Leg) -> Bools:
    """Return which pieces (p,) a leg can reach: in front of its last mirror, over the circle about each mirror."""

    def found() -> Bools:
        ok = np.ones(len(geometry.piece_role), bool)
        if leg.mirrors:
            ok = leg.may_reach(*geometry.piece_spheres)
            ok[leg.pieces(geometry)[-1]] = False
        return ok

    return cache_of(geometry).by_leg("reachable pieces", leg, found)
