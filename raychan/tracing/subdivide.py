"""Cut: tubes divided in halves, or along the edge that runs through them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.tracing.legs import Leg
from raychan.tracing.subdivide_kernels import (
    half_weights,
    later_parts,
    line_weights,
    longest_edges,
    on_first,
    sound_parts,
)
from raychan.tracing.tubes import CENTRE, Tubes, first_rays
from raychan.world.geometry import Geometry

Floats = NDArray[np.float64]
Rows = NDArray[np.signedinteger]


def halves(
    geometry: Geometry, leg: Leg, tubes: Tubes, rows: Rows, edge: Rows, first: bool, jitter: float = 0.0
) -> Tubes:
    """Return both halves of the tubes `rows` (m,), cut from the middle of edge 0, 1 or 2 (m,) to the corner
    opposite."""
    return _parts(geometry, leg, tubes, np.concatenate([rows, rows]), half_weights(edge, jitter), first, 2 * len(rows))[
        0
    ]


def divide(
    geometry: Geometry, leg: Leg, tubes: Tubes, rows: Rows, side: Floats, first: bool, jitter: float
) -> tuple[Tubes, Rows]:
    """Cut the tubes `rows` (m,) along the edge that runs through them, or in half; return the parts and the row of
    each.

    Args: side (n, 3) of all tubes, signed distances [m] of the corners from that edge; zeros: none is known.
    """
    known = side[rows].any(axis=1)
    blunt, sharp = rows[~known], rows[known]
    parent = np.concatenate([blunt, blunt, sharp, sharp, sharp])
    half = half_weights(longest_edges(tubes.points[blunt]), jitter)
    return _parts(geometry, leg, tubes, parent, np.concatenate([half, line_weights(side[sharp])]), first, len(half))


def _parts(
    geometry: Geometry, leg: Leg, tubes: Tubes, parent: Rows, weights: Floats, first: bool, many: int
) -> tuple[Tubes, Rows]:
    """Return part tubes whose corner i is the mean of the parent's corners by weights[:, i] (m, 3, 3), and the parent
    (m,) of each; but for the first `many` only those that have an area.

    On the first surface (`first`) their rays are computed anew on the true surface.
    """
    n, facet = len(parent), tubes.facet[parent]
    bary = on_first(weights, parent, tubes.bary) if first else np.empty((n, 0, 3))
    if first:
        points, k, length, normals = first_rays(geometry, leg, facet, bary)
        spread = leg.spread(length[:, CENTRE])
    else:
        points, k, normals, length = np.empty((n, 4, 3)), np.empty((n, 4, 3)), np.empty((n, 4, 3)), np.empty((n, 4))
        later_parts(weights, parent, tubes.points, tubes.k, tubes.length, tubes.normals, points, k, length, normals)
        spread = tubes.spread[parent]
    parts = Tubes(
        points=points,
        k=k,
        length=length,
        normals=normals,
        facet=facet,
        spread=spread,
        bary=bary,
        **{name: getattr(tubes, name).take(parent) for name in _KEPT},
        history=tubes.history,
    )
    sound = sound_parts(points, many)
    return (parts, parent) if len(sound) == n else (parts.take(sound), parent[sound])


_KEPT = "strength", "flat", "slots", "bounces", "caustics", "last"
