"""Subdivision of curved facets: each into four, with edge midpoints on the cubic curves that fit the corner normals (PN
triangles). It shows how much the quadratic patches of the simulation deviate from a smoother surface.

Everywhere: v, n (f, 3, 3) corners [m] and corner normals of facets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.world.meshes.topology import point_numbers

Floats = NDArray[np.float64]

_STEEP = 0.25  # least part of a tangent along its edge, of the edge squared: below, they differ by more than 60 deg
_ALIKE = 1e-12  # m: midpoints that differ less are one
_ONE = 1.0 - np.cos(np.radians(10.0))  # surfaces that meet at less count as one: their line of meeting is ill defined
_AT = (0.25, 0.5, 0.75)  # points of an edge, as shares of it, at which the curves are compared


def halved(v: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Return the corners and corner normals (4 f, 3, 3) of facets through the middles of cubic edges; the quarters of
    facet i are rows i, f + i, 2 f + i and 3 f + i.

    Facets of one edge share its middle. Source: Vlachos et al., Curved PN triangles, 2001, sec. 3.
    """
    p, q = _tangents(v, n)
    after, turned = np.roll(v, -1, axis=1), np.roll(n, -1, axis=1)
    middle = _cubic(v, after, p, q, 0.5)
    along = 1.5 * (after - v) - 0.25 * (p + q)
    normal = n + turned
    normal -= along * (_dot(normal, along) / np.maximum(_dot(along, along), 1e-300))[..., None]
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-300)
    middle = _shared(v, middle, normal)
    corners = [np.stack([v[:, k], middle[:, k], middle[:, k - 1]], axis=1) for k in range(3)]
    normals = [np.stack([n[:, k], normal[:, k], normal[:, k - 1]], axis=1) for k in range(3)]
    return np.concatenate([*corners, middle]), np.concatenate([*normals, normal])


def cubic_off(v: Floats, n: Floats, bulge: Floats) -> Floats:
    """Return the largest distance (f,) [m] of the cubic edges of facets from the quadratic ones, whose edge curvature
    is bulge (f, 3, 3) [m]."""
    p, q = _tangents(v, n)
    after, turned = np.roll(v, -1, axis=1), np.roll(n, -1, axis=1)
    most = np.zeros(len(v))
    for t in _AT:
        apart = _cubic(v, after, p, q, t) - ((1.0 - t) * v + t * after - t * (1.0 - t) * bulge)
        along = after - v - (1.0 - 2.0 * t) * bulge
        # Deviation along the surface does not count: only the part along the normal.
        up = (1.0 - t) * n + t * turned
        up -= along * (_dot(up, along) / np.maximum(_dot(along, along), 1e-300))[..., None]
        size = np.maximum(np.linalg.norm(up, axis=2), 1e-300)
        most = np.maximum(most, (np.abs(_dot(apart, up)) / size).max(axis=1, initial=0.0))
    return most


def _tangents(v: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Return the edges (f, 3, 3) [m] projected into the tangent planes at their starts and at their ends, scaled to the
    same length along the edge, as the tangents of a parabola have."""
    edge = np.roll(v, -1, axis=1) - v
    squared = np.maximum(_dot(edge, edge), 1e-300)
    found = []
    for normal in (n, np.roll(n, -1, axis=1)):
        flat = edge - normal * _dot(edge, normal)[..., None]
        found.append(flat / np.maximum(_dot(flat, edge) / squared, _STEEP)[..., None])
    return found[0], found[1]


def _cubic(a: Floats, b: Floats, p: Floats, q: Floats, t: float) -> Floats:
    """Return the points at parameter t of cubic Hermite curves from a to b with tangents p and q."""
    s = 1.0 - t
    return np.asarray(s * s * (1.0 + 2.0 * t) * a + t * t * (3.0 - 2.0 * t) * b + s * s * t * p - t * t * s * q)


def _shared(v: Floats, middle: Floats, normal: Floats) -> Floats:
    """Return the edge midpoints, one for all facets that share an edge, given theirs and the surface normals there.

    Where surfaces meet at an angle, their common edge lies on both: its midpoint is the nearest one to the mean of
    theirs that has each surface's height above the chord. The rim of a flat lid follows the round side.
    """
    ends = point_numbers(v.reshape(-1, 3)).reshape(-1, 3)
    after = np.roll(ends, -1, axis=1)
    edge = np.unique(
        np.stack([np.minimum(ends, after), np.maximum(ends, after)], -1).reshape(-1, 2), axis=0, return_inverse=True
    )[1].ravel()
    count, up = np.bincount(edge), normal.reshape(-1, 3)
    mean = np.stack([np.bincount(edge, x) / count for x in middle.reshape(-1, 3).T], axis=1)
    short = np.einsum("hi,hi->h", up, middle.reshape(-1, 3) - mean[edge])
    parted = np.unique(edge[np.abs(short) > _ALIKE])
    if len(parted):
        row = np.full(len(count), -1)
        row[parted] = np.arange(len(parted))
        these = row[edge] >= 0
        at, planes, lack = row[edge[these]], np.zeros((len(parted), 3, 3)), np.zeros((len(parted), 3))
        np.add.at(planes, at, up[these][:, :, None] * up[these][:, None, :])
        np.add.at(lack, at, up[these] * short[these][:, None])
        size, axes = np.linalg.eigh(planes)
        part = np.einsum("eij,ei->ej", axes, lack) * np.where(size > _ONE, 1.0 / np.maximum(size, _ONE), 0.0)
        mean[parted] += np.einsum("eij,ej->ei", axes, part)
    return np.asarray(mean[edge].reshape(middle.shape))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("fki,fki->fk", a, b))
