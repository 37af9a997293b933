"""Ways to point targets over the edges of wedges: once in, out, or both, by the law of edge diffraction."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from raychan.em.diffraction import edge_point
from raychan.records import DIFFRACT, POINT, DiffractedRoutes, Points
from raychan.tracing.point_targets import bistatic_sigma
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]

_LONGEST_DETOUR = 2.0  # m beyond the straight line
_SHORTEST = 10.0  # wavelengths: an edge shorter than this is not a wedge to the wave
_STRAIGHT = np.zeros(3), np.zeros((2, 3)), 0.0


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
    """Return the leg over wedge w, None where its edge is missed, hidden or too far off."""
    start, stop = geometry.wedge[w]
    size = float(np.linalg.norm(stop - start))
    edge = (stop - start) / size
    at = edge_point(tuple(end), tuple(point), tuple(start), tuple(edge))
    if not 0.0 < at < size:
        return None
    spot = start + at * edge
    near, far = float(np.linalg.norm(spot - end)), float(np.linalg.norm(point - spot))
    if near + far - np.linalg.norm(point - end) > _LONGEST_DETOUR:
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
