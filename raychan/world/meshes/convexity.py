"""Whether a mesh is convex, but for what a file's rounding makes of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_EXACT = 1e-9  # of 1 m and the size: what double precision makes of the heights of flat faces
_ROUNDED = 5e-7  # of the largest coordinates: what single precision does. Seven roundings of 6e-8 are 4.2e-7; higher
# edges are grooves. Of a hollow as wide as this allows, hulls differ by more than the skin of that thickness.
_MOST = 200_000  # points of which a hull is computed: about a second


def convex(height: float, bounds: Floats, whole: Callable[[], tuple[Floats, NDArray[np.signedinteger]]]) -> bool:
    """Return whether a closed mesh of one piece is convex, by how far facets rise over their neighbours' planes at most
    [m], lowest and highest corner (2, 3) [m], and what gives its points (k, 3) [m] and faces (m, 3).

    Flat and singly curved faces of a file in single precision rise by its rounding: there the convex hull tells whether
    there is more to it, as the many low edges of a fine hollow.
    """
    if height < _EXACT * (1.0 + float(np.linalg.norm(bounds[1] - bounds[0]))):
        return True
    skin = _ROUNDED * float(np.abs(bounds).max())
    if height > skin:
        return False
    points, faces = whole()
    if len(points) > _MOST:
        return False
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    a, b, c = np.moveaxis(points[faces] - points.mean(axis=0), 1, 0)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    return bool(abs(hull.volume - volume) <= skin * hull.area)
