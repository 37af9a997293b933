"""Whether a mesh is convex, but for what a file's rounding makes of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger]

_EXACT = 1e-9  # of 1 m and the size: what double precision makes of the heights of flat faces
_ROUNDED = 5e-7  # of the largest coordinates: what single precision does; seven roundings of 6e-8 are 4.2e-7
_DEEPEST = 2e-6  # m: at 77 GHz, 20 degrees off a face of 0.2 m, a groove of 2 to 7 um brings 0.03 to 0.09 dB
_MOST = 200_000  # points of which a hull is computed: bounds time; not measured
_NEAR = 2  # points of the hull about each corner, on whose facets a face may lie: more find more convex; not measured
_PAIRS = 2_000_000  # of faces and facets of the hull at once: bounds memory


def convex(height: float, bounds: Floats, whole: Callable[[], tuple[Floats, Ints]]) -> bool:
    """Return whether a closed mesh of one piece is convex, by how far facets rise over their neighbours' planes at most
    [m], lowest and highest corner (2, 3) [m], and what gives its points (k, 3) [m] and faces (m, 3).

    Flat and singly curved faces of a file in single precision rise by its rounding: there all faces must lie as near
    to the convex hull, since a fine hollow has low edges however deep it is.
    """
    size = bounds[1] - bounds[0]
    if height < _EXACT * (1.0 + float(np.linalg.norm(size))):
        return True
    skin = min(_ROUNDED * float(np.abs(bounds).max()), _DEEPEST)
    if height > skin or size.min() <= skin:
        return False
    points, faces = whole()
    return len(points) <= _MOST and _depth(points, faces) <= skin


def _depth(points: Floats, faces: Ints) -> float:
    """Return how deep [m] the middles of faces (m, 3) lie under the convex hull of their points (k, 3), no less than
    they do: under the nearest plane of those at the points of the hull about their corners.

    Corners of a face whose middle is within d of a plane of the hull are within 3 d of it.
    """
    from scipy.spatial import ConvexHull, QhullError, cKDTree

    try:
        hull = ConvexHull(points)
    except QhullError:
        return float("inf")
    near = min(_NEAR, len(hull.vertices))
    beside = hull.vertices[cKDTree(points[hull.vertices]).query(points, near)[1].reshape(-1, near)]
    corners = hull.simplices.ravel()
    facet, degree = np.argsort(corners, kind="stable") // 3, np.bincount(corners, minlength=len(points))
    first, deepest = np.cumsum(degree) - degree, 0.0
    about, middle = beside[faces].reshape(len(faces), -1), points[faces].mean(axis=1)
    for rows in np.array_split(np.arange(len(faces)), int(degree[about].sum()) // _PAIRS + 1):
        count = degree[about[rows]].ravel()
        begin = np.cumsum(count) - count
        plane = hull.equations[facet[np.repeat(first[about[rows]].ravel() - begin, count) + np.arange(count.sum())]]
        each = count.reshape(len(rows), -1).sum(axis=1)
        under = -np.einsum("ij,ij->i", plane[:, :3], np.repeat(middle[rows], each, axis=0)) - plane[:, 3]
        deepest = max(deepest, float(np.minimum.reduceat(under, np.cumsum(each) - each).max(initial=0.0)))
    return deepest
