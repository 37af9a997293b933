"""Geometrical optics: specular points of single reflections, where the surface normal points to the radar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.world.ray_caster import RayCaster

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class SpecularPoints:
    """Visible specular points: `point` (n, 3) [m], `facet` (n,), scattered `field` (n,) [1/m] for unit field at 1 m."""

    point: Floats
    facet: NDArray[np.int64]
    field: Complexes


def specular_points(tracer: RayCaster, end: Floats, wavenumber: float) -> SpecularPoints:
    """Return the specular points of conducting bodies that a radar at `end` (3,) [m] sees.

    The stationary-phase value of physical optics: 1 / (2 r^2 sqrt|det H|), H the curvature of the path's length over
    the surface, found from how normals and lines of sight turn from corner to corner of a facet.
    Source: stationary phase, Born and Wolf, Principles of Optics, 1999, app. III.3.
    """
    f = tracer.facets
    v = f.vertices
    sight = end - v
    sight = sight / np.linalg.norm(sight, axis=2)[..., None]
    off = f.normals - sight
    a, b = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    x = a / np.linalg.norm(a, axis=1)[:, None]
    y = np.cross(tracer.normal, x)
    c = np.stack([np.einsum("nij,nj->ni", off, x), np.einsum("nij,nj->ni", off, y)], axis=2)
    turn = np.stack([c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]], axis=2)
    det = np.linalg.det(turn)
    facing = np.einsum("ij,ij->i", tracer.normal, sight.mean(axis=1)) > 0.5
    rows = np.flatnonzero((np.abs(det) > 1e-30) & facing)
    if not len(rows):
        return SpecularPoints(np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0, complex))
    st = np.linalg.solve(turn[rows], -c[rows, 0][..., None])[..., 0]
    # Half-open intervals, so that a point on the edge of two facets counts once.
    inside = (st[:, 0] >= 0.0) & (st[:, 1] >= 0.0) & (st.sum(axis=1) < 1.0)
    rows, st = rows[inside], st[inside]
    point = v[rows, 0] + st[:, :1] * a[rows] + st[:, 1:] * b[rows]
    d = point - end
    r = np.linalg.norm(d, axis=1)
    d = d / r[:, None]
    hit, t = tracer.cast(np.tile(end, (len(d), 1)), d, np.full(len(d), -1, np.int32))
    seen = (hit >= 0) & (np.abs(t - r) < 1e-3)
    rows, point, r = rows[seen], point[seen], r[seen]
    moves = np.stack(
        [np.stack([np.einsum("ij,ij->i", s[rows], w[rows]) for s in (a, b)], axis=1) for w in (x, y)], axis=1
    )
    bend = turn[rows] @ np.linalg.inv(moves)
    bends = np.linalg.det(bend)
    valley = np.trace(bend, axis1=1, axis2=2) < 0.0
    sign = np.where(bends < 0.0, -1j, np.where(valley, 1.0, -1.0))
    field = sign * np.exp(-2j * wavenumber * r) / (2.0 * r**2 * np.sqrt(np.abs(bends)))
    return SpecularPoints(point, rows, field)
