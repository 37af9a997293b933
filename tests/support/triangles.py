"""Points on triangles and on the curved patches behind them."""

from __future__ import annotations

import numpy as np


def nodes(panels=40, order=8):
    """Points (n, 3) barycentric and weights (n,) of a product rule on the triangle; weights sum to one."""
    x, w = np.polynomial.legendre.leggauss(order)
    start = np.arange(panels)[:, None]
    t, wt = ((start + 0.5 + 0.5 * x) / panels).ravel(), np.tile(0.5 * w / panels, panels)
    s, v = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    # Duffy: a square onto the triangle, with the width of its rows as weight.
    return np.column_stack([1 - s, s * (1 - v), s * v]), 2 * s * np.outer(wt, wt).ravel()


def on_patch(geometry, bary):
    """Points (n, m, 3) of the true surface at barycentric coordinates (m, 3) of every facet."""
    flat = np.einsum("mi,nij->nmj", bary, geometry.facets.vertices)
    return flat - np.einsum("me,nej->nmj", bary * np.roll(bary, -1, axis=1), geometry.edge_curvature)
