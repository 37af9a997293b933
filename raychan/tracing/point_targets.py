"""Routes over targets given by their RCS: points seen over every pair of legs in and out, and over the edges of wedges,
once in, out, or both, by the law of edge diffraction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.records import DIFFRACT, POINT, DiffractedRoutes, Points, Routes
from raychan.tracing.legs import Leg, View
from raychan.tracing.routes import Interactions, ray_routes
from raychan.vectors import Vec, cross, dot
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]

_LONGEST_DETOUR = 2.0  # m beyond the straight line
_SHORTEST = 10.0  # wavelengths: an edge shorter than this is not a wedge to the wave
_STRAIGHT = np.zeros(3), np.zeros((2, 3)), 0.0


def point_routes(
    geometry: Geometry, points: Points, legs_in: list[Leg], legs_out: list[Leg], bounces: int, slots: int, layers: int
) -> Routes | None:
    """Return the routes over point targets with at most `bounces` interactions, None where there are none.

    Args: legs_in, legs_out legs, the direct one first; slots for interactions; layers that a stretch may pass.
    """
    if not len(points.body):
        return None
    seen_in = [_see(geometry, points, leg, layers) for leg in legs_in]
    seen_out = seen_in if legs_out == legs_in else [_see(geometry, points, leg, layers) for leg in legs_out]
    mirrors, back = np.array([len(out.mirrors) for out in legs_out]), np.array([s.seen for s in seen_out])
    found = []
    for leg, seen in zip(legs_in, seen_in, strict=True):
        both = seen.seen & back & (len(leg.mirrors) + mirrors < bounces)[:, None]
        for j, p in np.argwhere(both).tolist():
            found.append(_route(geometry, points, p, leg, legs_out[j], seen, seen_out[j], slots))
    if not found:
        return None
    tx, rx = legs_in[0].end, legs_out[0].end
    columns = {key: np.array([r[key] for r in found]) for key in found[0]}
    rows = Interactions(*(columns.pop(name) for name in Interactions._fields))
    return ray_routes(tx, rx, rows, columns.pop("length"), **columns)


def _see(geometry: Geometry, points: Points, leg: Leg, layers: int) -> View:
    """Return how the points are seen over a leg; their own bodies do not hide them."""
    n = len(points.body)
    none = np.full(n, -1, np.int32)
    return leg.visible(geometry, points.position, none, np.full(n, 1e-6), layers, points.body)


def _route(geometry, points, p, leg, out, seen_in, seen_out, slots):  # type: ignore[no-untyped-def]
    """Return the columns of `Routes` for point p over a leg in and a leg out."""
    at = points.position[p]
    (k_in, l_in), (k_out, l_out) = leg.rays(at[None]), out.rays(at[None])

    before, after = leg.stops(geometry, seen_in, p, at), out.stops(geometry, seen_out, p, at)[::-1]
    scatter = len(before)
    stops = [*before, (at, np.zeros(3), -1, int(POINT)), *after]
    vertices, normals, facets, kinds = map(list, zip(*stops, strict=True))
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
        "length": length,
        "spread_in": 1.0 / l_in[0],
        "spread_out": 1.0 / l_out[0],
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


@dataclass(frozen=True)
class WedgeLeg:
    """A leg between the radar and a point target: straight (`faces` -1), or over one wedge at `spot`."""

    near: float
    far: float
    leaves: Floats
    arrives: Floats
    spot: Floats
    faces: tuple[int, int]
    edge: Floats
    normals: Floats
    wedge_n: float

    @property
    def over(self) -> bool:
        """Whether it runs over a wedge."""
        return self.faces[0] >= 0


def wedge_legs(geometry: Geometry, end: Floats, point: Floats, body: int, k: float) -> list[WedgeLeg]:
    """Return the straight leg, where it is free, and those over one wedge each.

    Args: end, point (3,) [m]; body in which the point stands; k wavenumber [rad/m].
    Source: Keller 1962 (law of edge diffraction).
    """
    found = []
    gap = float(np.linalg.norm(point - end))
    straight = (point - end) / gap
    if _free(geometry, end, point, -1, body):
        found.append(WedgeLeg(gap, 0.0, straight, straight, point, (-1, -1), *_STRAIGHT))
    for w in _candidates(geometry, end, point, body, gap, k):
        leg = _over(geometry, w, end, point, body)
        if leg is not None:
            found.append(leg)
    return found


def _candidates(geometry: Geometry, end: Floats, point: Floats, body: int, gap: float, k: float) -> NDArray[np.int64]:
    """Return wedges long enough, near enough to the straight line, and not of the target's own body."""
    a, b = geometry.wedge[:, 0], geometry.wedge[:, 1]
    size = np.linalg.norm(b - a, axis=1)
    middle = 0.5 * (a + b)
    detour = np.linalg.norm(middle - end, axis=1) + np.linalg.norm(middle - point, axis=1) - gap - size
    own = geometry.facets.body[geometry.wedge_facet[:, 0]] == body
    return np.flatnonzero((size * k > 2.0 * np.pi * _SHORTEST) & (detour < _LONGEST_DETOUR) & ~own)


def _over(geometry: Geometry, w: int, end: Floats, point: Floats, body: int) -> WedgeLeg | None:
    """Return the leg over wedge w, None where its edge is missed, hidden, too far off or at an end."""
    start, stop = geometry.wedge[w]
    size = float(np.linalg.norm(stop - start))
    edge = (stop - start) / size
    at = edge_point(tuple(end), tuple(point), tuple(start), tuple(edge))
    if not 0.0 < at < size:
        return None
    spot = start + at * edge
    near, far = float(np.linalg.norm(spot - end)), float(np.linalg.norm(point - spot))
    # To or from an end on the edge itself a ray has no direction, and no detour over the straight leg.
    if not near or not far or near + far - np.linalg.norm(point - end) > _LONGEST_DETOUR:
        return None
    face, other = (int(f) for f in geometry.wedge_facet[w])
    # Both ends see the edge from the open side of one of its faces; the rays themselves graze those faces.
    normals = geometry.normal[[face, other]]
    lift = 1e-4 * (normals[0] + normals[1])
    if not (_free(geometry, end, spot + lift, face, -1) and _free(geometry, point, spot + lift, face, body)):
        return None
    leaves, arrives = (spot - end) / near, (point - spot) / far
    return WedgeLeg(near, far, leaves, arrives, spot, (face, other), edge, normals, float(geometry.wedge_n[w]))


def _free(geometry: Geometry, start: Floats, stop: Floats, facet: int, body: int) -> bool:
    gap = float(np.linalg.norm(stop - start))
    d = ((stop - start) / gap)[None]
    inside = np.array([body]) if body >= 0 else None
    near, none = np.array([2e-4]), np.array([-1], np.int32)
    target = np.array([facet], np.int32)
    reached, _, _ = geometry.walk(start[None], d, np.array([gap]), near, none, target, 0, inside)
    return bool(reached[0])


@njit(cache=True)
def edge_point(tx: Vec, rx: Vec, origin: Vec, edge: Vec) -> float:
    """Return the point of diffraction along an edge [m from origin]: the shortest path over the line.

    Source: Keller (1962), J. Opt. Soc. Am. 52(2): equal angles of both rays to the edge.
    """
    a = (tx[0] - origin[0], tx[1] - origin[1], tx[2] - origin[2])
    b = (rx[0] - origin[0], rx[1] - origin[1], rx[2] - origin[2])
    along_a, along_b = dot(a, edge), dot(b, edge)
    off_a, off_b = cross(a, edge), cross(b, edge)
    far_a, far_b = math.sqrt(dot(off_a, off_a)), math.sqrt(dot(off_b, off_b))
    if far_a + far_b == 0.0:
        return 0.5 * (along_a + along_b)
    return (along_a * far_b + along_b * far_a) / (far_a + far_b)


def diffracted_routes(geometry: Geometry, points: Points, end: Floats, k: float, slots: int) -> DiffractedRoutes | None:
    """Return the routes from the radar at `end` (3,) [m] to point targets and back over at least one wedge.

    Each pair of legs is a route; one leg of it may be straight. None where there is no such route.
    """
    pairs: list[tuple[int, WedgeLeg, WedgeLeg]] = []
    for p in range(len(points.body)):
        legs = wedge_legs(geometry, end, points.position[p], int(points.body[p]), k)
        pairs += [(p, i, o) for i, o in product(legs, legs) if i.over or o.over]
    if not pairs:
        return None
    n, f = len(pairs), geometry.facets
    body, part = np.full((n, slots), -1), np.full((n, slots), -1)
    kind, vertices = np.zeros((n, slots), np.int8), np.broadcast_to(end, (n, slots, 3)).copy()
    for r, (p, i, o) in enumerate(pairs):
        stops = [(i.faces[0], i.spot, DIFFRACT)] if i.over else []
        stops += [(-1, points.position[p], POINT)] + ([(o.faces[0], o.spot, DIFFRACT)] if o.over else [])
        for c, (facet, spot, what) in enumerate(stops):
            body[r, c] = f.body[facet] if facet >= 0 else points.body[p]
            part[r, c] = f.part[facet] if facet >= 0 else -1
            kind[r, c], vertices[r, c] = what, spot
    of = [p for p, _, _ in pairs]
    both = [(i, o) for _, i, o in pairs]
    columns = {
        name: np.array([[getattr(leg, name) for leg in legs] for legs in both])
        for name in ("leaves", "arrives", "near", "far", "faces", "edge", "normals", "wedge_n")
    }
    sigma = np.array([bistatic_sigma(points, p, -i.arrives, -o.arrives) for p, i, o in pairs])
    return DiffractedRoutes(
        end=end,
        vertices=vertices,
        body=body,
        part=part,
        kind=kind,
        target=points.position[of],
        target_velocity=points.velocity[of],
        sigma=sigma,
        **columns,
    )
