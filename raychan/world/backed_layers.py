"""Thin layers that lie on an opaque surface: of two surfaces in one place only the opaque one counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_TURN = 1e-5  # difference of unit normals up to which facets count as parallel


def backed(v: Floats, normal: Floats, area: Floats, layer: Bools, touch: float) -> Bools:
    """Return which facets (n,) are thin layers with an opaque facet in their plane and at their place.

    Args: v (n, 3, 3) [m] corners about an origin nearby; their normal (n, 3) and area (n,); layer (n,) which facets let
    waves through; touch [m] distance within which surfaces lie on each other.
    """
    out = np.zeros(len(v), bool)
    rows, solid = np.flatnonzero(layer & (area > 0.0)), np.flatnonzero(~layer & (area > 0.0))
    if not len(rows):
        return out
    low, high = v[rows].min(axis=1) - touch, v[rows].max(axis=1) + touch
    inside = (v[solid].max(axis=1) >= low.min(axis=0)) & (v[solid].min(axis=1) <= high.max(axis=0))
    solid = solid[inside.all(axis=1)]
    if not len(solid):
        return out
    # Planes as points: normal (of either sign) and height, scaled so that `touch` counts as much as `_TURN`.
    scale = _TURN / touch
    height = np.einsum("ij,ij->i", normal, v.mean(axis=1)) * scale
    plane = np.column_stack([normal, height])
    tree = cKDTree(np.concatenate([plane[solid], -plane[solid]]))
    near = cKDTree(plane[rows]).sparse_distance_matrix(tree, 2.0 * _TURN, output_type="coo_matrix")
    a, b = near.row, solid[near.col % len(solid)]
    meet = (v[b].min(axis=1) <= high[a]).all(axis=1) & (v[b].max(axis=1) >= low[a]).all(axis=1)
    out[rows[a[meet]]] = True
    return out
