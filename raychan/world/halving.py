"""Halving: the edges of facets halved on the cubic curves through their corner normals, one facet into four.

Everywhere: v, n (f, 3, 3) corners [m] and corner normals of facets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.world.topology import point_numbers

Floats = NDArray[np.float64]

_STEEP = 0.25  # of an edge's square: a tangent that has less of it along the edge stands at more than 60 deg to it
_AT = (0.25, 0.5, 0.75)  # of an edge: where curves are compared


def halved(v: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Return the corners and corner normals (4 f, 3, 3) of facets through the middles of cubic edges; the quarters of
    facet i are rows i, f + i, 2 f + i and 3 f + i.

    Facets of one edge share its middle, the mean of theirs. Source: Vlachos et al., Curved PN triangles, 2001, sec. 3.
    """
    p, q = _tangents(v, n)
    after, turned = np.roll(v, -1, axis=1), np.roll(n, -1, axis=1)
    middle = _shared(v, _cubic(v, after, p, q, 0.5))
    along = 1.5 * (after - v) - 0.25 * (p + q)
    normal = n + turned
    normal -= along * (_dot(normal, along) / np.maximum(_dot(along, along), 1e-300))[..., None]
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-300)
    corners = [np.stack([v[:, k], middle[:, k], middle[:, k - 1]], axis=1) for k in range(3)]
    normals = [np.stack([n[:, k], normal[:, k], normal[:, k - 1]], axis=1) for k in range(3)]
    return np.concatenate([*corners, middle]), np.concatenate([*normals, normal])


def cubic_off(v: Floats, n: Floats, bulge: Floats) -> Floats:
    """Return how far (f,) [m] the cubic edges of facets stand off the quadratic ones, which bulge by (f, 3, 3) [m]."""
    p, q = _tangents(v, n)
    after, turned = np.roll(v, -1, axis=1), np.roll(n, -1, axis=1)
    most = np.zeros(len(v))
    for t in _AT:
        apart = _cubic(v, after, p, q, t) - ((1.0 - t) * v + t * after - t * (1.0 - t) * bulge)
        along = after - v - (1.0 - 2.0 * t) * bulge
        # Within the surface both are one and the same.
        up = (1.0 - t) * n + t * turned
        up -= along * (_dot(up, along) / np.maximum(_dot(along, along), 1e-300))[..., None]
        size = np.maximum(np.linalg.norm(up, axis=2), 1e-300)
        most = np.maximum(most, (np.abs(_dot(apart, up)) / size).max(axis=1, initial=0.0))
    return most


def _tangents(v: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Return the edges (f, 3, 3) [m] as they lie in the tangent planes of their starts and of their ends, as far along
    the edge as it is itself: a parabola's are so."""
    edge = np.roll(v, -1, axis=1) - v
    squared = np.maximum(_dot(edge, edge), 1e-300)
    found = []
    for normal in (n, np.roll(n, -1, axis=1)):
        flat = edge - normal * _dot(edge, normal)[..., None]
        found.append(flat / np.maximum(_dot(flat, edge) / squared, _STEEP)[..., None])
    return found[0], found[1]


def _cubic(a: Floats, b: Floats, p: Floats, q: Floats, t: float) -> Floats:
    """Return the points at t of curves from a to b with tangents p and q there (Hermite)."""
    s = 1.0 - t
    return np.asarray(s * s * (1.0 + 2.0 * t) * a + t * t * (3.0 - 2.0 * t) * b + s * s * t * p - t * t * s * q)


def _shared(v: Floats, middle: Floats) -> Floats:
    """Return the middles of edges, those of one edge at their mean."""
    ends = point_numbers(v.reshape(-1, 3)).reshape(-1, 3)
    after = np.roll(ends, -1, axis=1)
    edge = np.unique(
        np.stack([np.minimum(ends, after), np.maximum(ends, after)], -1).reshape(-1, 2), axis=0, return_inverse=True
    )[1].ravel()
    count = np.bincount(edge)
    mean = np.stack([np.bincount(edge, x) / count for x in middle.reshape(-1, 3).T], axis=1)
    return np.asarray(mean[edge].reshape(middle.shape))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("fki,fki->fk", a, b))
