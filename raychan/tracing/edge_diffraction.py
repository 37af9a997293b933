"""Paths to point targets by single diffraction at a wedge on the leg in, out, or both (UTD)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.em.diffraction import diffract, edge_point
from raychan.em.fresnel import coefficients
from raychan.records import DIFFRACT, POINT, Paths, Points
from raychan.tracing.legs import Leg
from raychan.tracing.point_targets import bistatic_sigma
from raychan.units import C0
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_LONGEST_DETOUR = 2.0  # m beyond the straight line: longer ones diffract into deep shadow; not measured
_SHORTEST = 10.0  # wavelengths: a shorter edge does not act as an infinite wedge; not measured


@dataclass(frozen=True)
class PointLeg:
    """A leg between an end and a point: the field there (3,) per unit wave [1/m], with its phase; its length [m]; unit
    directions of travel at the end and at the point; where it meets a wedge, and a facet of that (-1: straight)."""

    field: Complexes
    length: float
    leaves: Floats
    arrives: Floats
    spot: Floats
    facet: int


def point_legs(
    geometry: Geometry, end: Floats, point: Floats, body: int, field_of: Callable[[Floats], Any], k: float
) -> list[PointLeg]:
    """Return the straight leg, where nothing blocks it, and those over one wedge each.

    Args: end, point (3,) [m]; body in which the point lies; field_of directions (n, 3) -> antenna vectors (n, 3); k
    [rad/m].
    Source: Keller 1962 (law of edge diffraction); Kouyoumjian and Pathak 1974.
    """
    found = []
    gap = float(np.linalg.norm(point - end))
    straight = (point - end) / gap
    if _free(geometry, end, point, -1, body):
        wave = np.asarray(field_of(straight[None]))[0] / gap * np.exp(-1j * k * gap)
        found.append(PointLeg(wave, gap, straight, straight, point, -1))
    for w in _candidates(geometry, end, point, body, gap, k):
        way = _over(geometry, w, end, point, body, field_of, k)
        if way is not None:
            found.append(way)
    return found


def _candidates(geometry: Geometry, end: Floats, point: Floats, body: int, gap: float, k: float) -> NDArray[np.int64]:
    """Return the wedges that are long enough, near enough to the straight line, and not of the target's own body."""
    a, b = geometry.wedge[:, 0], geometry.wedge[:, 1]
    size = np.linalg.norm(b - a, axis=1)
    middle = 0.5 * (a + b)
    detour = np.linalg.norm(middle - end, axis=1) + np.linalg.norm(middle - point, axis=1) - gap - size
    own = geometry.facets.body[geometry.wedge_facet[:, 0]] == body
    return np.flatnonzero((size * k > 2.0 * np.pi * _SHORTEST) & (detour < _LONGEST_DETOUR) & ~own)


def _over(
    geometry: Geometry, w: int, end: Floats, point: Floats, body: int, field_of: Callable[[Floats], Any], k: float
) -> PointLeg | None:
    """Return the leg over wedge w, None where it has no point of diffraction or is blocked."""
    start, stop = geometry.wedge[w]
    size = float(np.linalg.norm(stop - start))
    edge = (stop - start) / size
    at = edge_point(tuple(end), tuple(point), tuple(start), tuple(edge))
    if not 0.0 < at < size:
        return None
    spot = start + at * edge
    s_in, s_out = float(np.linalg.norm(spot - end)), float(np.linalg.norm(point - spot))
    if s_in + s_out - np.linalg.norm(point - end) > _LONGEST_DETOUR:
        return None
    face, other = (int(f) for f in geometry.wedge_facet[w])
    k_in, k_out = (spot - end) / s_in, (point - spot) / s_out
    normal = geometry.normal[face]
    # Shadow rays aim a little above both faces, which the diffracted rays themselves may graze.
    lift = 1e-4 * (normal + geometry.normal[other])
    if not (_free(geometry, end, spot + lift, face, -1) and _free(geometry, point, spot + lift, face, body)):
        return None
    e = np.asarray(field_of(k_in[None]))[0] / s_in * np.exp(-1j * k * s_in)
    r_0, r_n = (_reflection(geometry, f, k_in, k_out, k) for f in (face, other))
    field: Any = tuple(complex(x) for x in e)
    vector = diffract(
        field,
        tuple(k_in),
        tuple(k_out),
        tuple(edge),
        tuple(normal),
        float(geometry.wedge_n[w]),
        k,
        s_in,
        s_out,
        r_0,
        r_n,
    )
    wave = np.array(vector) * np.exp(-1j * k * s_out)
    return PointLeg(wave, s_in + s_out, k_in, k_out, spot, face)


def _reflection(geometry: Geometry, facet: int, k_in: Floats, k_out: Floats, k: float) -> tuple[complex, complex]:
    """Return (R_s, R_p) of a face at the steeper of both rays' angles (after Luebbers 1984)."""
    m = geometry.facets.materials
    row = geometry.facets.material[facet]
    normal = geometry.normal[facet]
    cosine = max(abs(float(k_in @ normal)), abs(float(k_out @ normal)))
    c = coefficients(m.kind[row], complex(m.eps[row]), m.thickness[row], m.roughness[row], cosine, k)
    return c[0], c[1]


def _free(geometry: Geometry, start: Floats, stop: Floats, facet: int, body: int) -> bool:
    """Tell whether nothing blocks the line from start to stop (3,) [m], on a facet or in a body (-1: none)."""
    gap = float(np.linalg.norm(stop - start))
    d = ((stop - start) / gap)[None]
    inside = np.array([body]) if body >= 0 else None
    near, none = np.array([2e-4]), np.array([-1], np.int32)
    target = np.array([facet], np.int32)
    reached, _, _ = geometry.walk(start[None], d, np.array([gap]), near, none, target, 0, inside)
    return bool(reached[0])


def diffracted_paths(
    geometry: Geometry, points: Points, radar: Any, frequency: float, slots: int, legs: list[Leg]
) -> list[Paths]:
    """Return the paths to point targets over at least one wedge; one leg of each may be straight.

    Args: frequency [Hz]; slots for interactions; legs the mirror-free one first (its end is the radar).
    """
    k = 2.0 * np.pi * frequency / C0
    end, f = np.asarray(legs[0].end, float), geometry.facets
    out: list[Paths] = []
    for p in range(len(points.body)):
        at, body = points.position[p], int(points.body[p])
        there = point_legs(geometry, end, at, body, radar.tx_field, k)
        back = point_legs(geometry, end, at, body, radar.rx_field, k)
        rows = [(i, o) for i, o in product(there, back) if i.facet >= 0 or o.facet >= 0]
        if not rows:
            continue
        n = len(rows)
        body_of, part_of = np.full((n, slots), -1), np.full((n, slots), -1)
        kinds, vertices = np.zeros((n, slots), np.int8), np.broadcast_to(end, (n, slots, 3)).copy()
        amplitude, rate, length = np.zeros(n, complex), np.zeros(n), np.zeros(n)
        away, look = np.zeros((n, 3)), np.zeros((n, 3))
        for r, (i, o) in enumerate(rows):
            chain = [(x.facet, x.spot, DIFFRACT) for x in (i,) if x.facet >= 0]
            chain += [(-1, at, POINT)] + [(x.facet, x.spot, DIFFRACT) for x in (o,) if x.facet >= 0]
            speed = [np.asarray(radar.velocity)]
            for c, (facet, spot, kind) in enumerate(chain):
                body_of[r, c] = f.body[facet] if facet >= 0 else body
                part_of[r, c] = f.part[facet] if facet >= 0 else -1
                kinds[r, c], vertices[r, c] = kind, spot
                speed.append(f.velocity[body_of[r, c]] if facet >= 0 else points.velocity[p])
            speed.append(np.asarray(radar.velocity))
            stops = [end, *(c[1] for c in chain), end]
            steps = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(stops)]
            rate[r] = 0.5 * sum(float((speed[j + 1] - speed[j]) @ d) for j, d in enumerate(steps))
            sigma = bistatic_sigma(points, p, -i.arrives, -o.arrives)
            amplitude[r] = 0.5 / k * np.sqrt(sigma / (4.0 * np.pi)) * (i.field @ o.field)
            length[r], away[r], look[r] = i.length + o.length, i.leaves, o.leaves
        out.append(
            Paths.of(
                delay=length / C0,
                amplitude=amplitude,
                rate=rate,
                departure=away,
                arrival=look,
                body=body_of.astype(np.int16),
                part=part_of.astype(np.int16),
                kind=kinds,
                vertices=vertices.astype(np.float32),
                body_names=f.body_names,
                part_names=f.part_names,
                tx=end,
                rx=end,
            )
        )
    return out
