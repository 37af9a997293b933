"""Routes over targets given by their RCS: points seen over every pair of legs in and out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.records import POINT, REFLECT, TRANSMIT, Points, Routes
from raychan.tracing.legs import Leg, View
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]


def point_routes(
    geometry: Geometry, points: Points, ways_in: list[Leg], ways_out: list[Leg], bounces: int, slots: int, layers: int
) -> Routes | None:
    """Return the routes over point targets with at most `bounces` interactions, None where there are none.

    Args: ways_in, ways_out legs, the direct one first; slots for interactions; layers that a stretch may pass.
    """
    if not len(points.body):
        return None
    seen_in = [_see(geometry, points, leg, layers) for leg in ways_in]
    seen_out = seen_in if ways_out == ways_in else [_see(geometry, points, leg, layers) for leg in ways_out]
    rows = []
    for i, leg in enumerate(ways_in):
        for j, out in enumerate(ways_out):
            if len(leg.mirrors) + len(out.mirrors) + 1 > bounces:
                continue
            for p in np.flatnonzero(seen_in[i].seen & seen_out[j].seen):
                rows.append(_route(geometry, points, int(p), leg, out, seen_in[i], seen_out[j], slots))
    if not rows:
        return None
    tx, rx = ways_in[0].end, ways_out[0].end
    columns = {key: np.array([r[key] for r in rows]) for key in rows[0]}
    return Routes(tx=tx, rx=rx, far=False, **columns)


def _see(geometry: Geometry, points: Points, leg: Leg, layers: int) -> View:
    """Return how the points are seen over a leg; their own bodies do not hide them."""
    n = len(points.body)
    none = np.full(n, -1, np.int32)
    return leg.visible(geometry, points.position, none, np.full(n, 1e-6), layers, points.body)


def _route(geometry, points, p, leg, out, seen_in, seen_out, slots):  # type: ignore[no-untyped-def]
    """Return the columns of `Routes` for point p over a leg in and a leg out."""
    at = points.position[p]
    (k_in, l_in), (k_out, l_out) = leg.rays(at[None]), out.rays(at[None])
    vertices, normals, facets, kinds = [], [], [], []

    def add(vertex, normal, facet, kind):  # type: ignore[no-untyped-def]
        vertices.append(vertex)
        normals.append(normal)
        facets.append(facet)
        kinds.append(kind)

    def add_way(way, seen, k):  # type: ignore[no-untyped-def]
        for m, spot in zip(way.mirrors, seen.corners[p], strict=True):
            add(spot, m.normal, m.facet, REFLECT)
        for facet in seen.passed[p]:
            if facet >= 0:
                t = geometry.distance(np.array([facet]), at[None], k)
                add(at + t[0] * k[0], geometry.normal[facet], facet, TRANSMIT)

    add_way(leg, seen_in, k_in)
    scatter = len(vertices)
    add(at, np.zeros(3), -1, POINT)
    head = len(vertices)
    add_way(out, seen_out, k_out)
    for column in (vertices, normals, facets, kinds):
        column[head:] = column[head:][::-1]
    used, free = len(vertices), slots - len(vertices)
    body = [int(geometry.facets.body[f]) if f >= 0 else int(points.body[p]) for f in facets]
    length = float(l_in[0] + l_out[0])
    return {
        "vertices": np.array(vertices + [out.end] * free),
        "normals": np.array(normals + [np.zeros(3)] * free),
        "facet": np.array(facets + [-1] * free, np.int32),
        "body": np.array(body + [-1] * free, np.int16),
        "kind": np.array(kinds + [0] * free, np.int8)[: max(used, slots)],
        "scatter": np.int8(scatter),
        "points": np.zeros((6, 3)),
        "lengths": np.full(6, length),
        "length": length,
        "taper": np.ones(3),
        "area": 0.0,
        "spread_in": 1.0 / l_in[0],
        "spread_out": 1.0 / l_out[0],
        "caustics": np.int8(0),
        "sigma": bistatic_sigma(points, p, -k_in[0], -k_out[0]),
    }


def bistatic_sigma(points: Points, p: int, towards_tx: Floats, towards_rx: Floats) -> float:
    """Return the RCS [m^2] of point p between two directions: the geometric mean of its monostatic values there.

    Exact where both directions agree, and reciprocal; a table of monostatic values determines no more.
    """
    out = 1.0
    for d in (towards_tx, towards_rx):
        azimuth = np.arctan2(d[1], d[0]) - points.heading[p]
        azimuth = (azimuth + np.pi) % (2.0 * np.pi) - np.pi
        out *= np.interp(azimuth, points.azimuth, points.sigma[p], period=2.0 * np.pi)
    return float(np.sqrt(out))
