"""Folds above the crease angle that look like a curved surface tessellated into flat facets, and may be smooth.

Everywhere: pair (e, 2) half edges of both sides of an edge; fold (e,) [rad], positive where the facets bend outward.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.world.meshes.topology import MeshTopology, point_numbers
from raychan.world.meshes.vertex_normals import components

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]
Bools = NDArray[np.bool_]

BAND = 2.05
"""Times the crease angle: larger folds are always edges. With 20 deg a cylinder of nine sections (folds of 40 deg) may
be smooth, a prism of eight sides (45 deg) has edges."""
_MOST = np.radians(41.0)  # for any crease angle: square, hexagonal and octagonal bars have edges
# Shares as in world.creases; single values not measured.
_ALONE = 0.75  # of a panel's bending across a fold: with more, the curvature does not continue to the next panel
_UNEVEN = 0.17  # difference over sum of the widths of two panels about a fold: with more, no regular tessellation
_FEW = 4  # folds: fewer are no evidence of a tessellation


def band(crease: float) -> tuple[float, float]:
    """Return the least and largest fold [rad] above the crease angle [rad] that may be smooth."""
    return crease, min(BAND * crease, _MOST)


def rounded(topology: MeshTopology, corners: Floats, pair: Ints, fold: Floats, crease: float) -> Bools:
    """Return which edges (e,) above the crease angle [rad] may be smooth.

    Such folds continue from panel to panel in the same sense and by similar angles, four or more of them, and the
    panels are of similar width, as sections of a cylinder or rings of a globe, or each like the next along a ring, as
    at the tip of a long ellipsoid; not two sheets that meet at a ridge, a chamfer, or the facets of a convex hull of
    points. Args: corners (f, 3, 3) [m] of the facets."""
    low, high = band(crease)
    among = (np.abs(fold) >= low) & (np.abs(fold) < high)
    found = np.zeros(len(pair), bool)
    if not among.any():
        return found
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    panel = _panels(topology, pair, fold, low)
    length, across = _across(corners, pair)
    whole_panel = np.asarray(np.bincount(panel, area), float)
    uneven = np.minimum(_apart(area, pair // 3), _apart(whole_panel, panel[pair // 3]))
    near = np.abs(fold) < high
    ring = _along(point_numbers(corners.reshape(-1, 3)), pair, panel[pair // 3], whole_panel, fold, among, near)
    uneven = np.minimum(uneven, ring)
    for sense in (1.0, -1.0):
        bend = np.where(np.abs(fold) < high, np.maximum(sense * fold, 0.0), 0.0) * length
        these = among & (sense * fold > 0.0)
        alone = _alone(panel[pair // 3], bend, across)
        linked = these | (np.abs(fold) < low)
        patch = components(pair[linked] // 3, len(corners))[pair[:, 0] // 3]
        weight = np.where(these, bend, 0.0)
        size = int(patch.max()) + 1
        whole = np.maximum(np.bincount(patch, weight, size), 1e-300)
        goes_on = np.bincount(patch, weight * (alone < _ALONE), size) / whole > 0.5
        even = np.bincount(patch, weight * uneven, size) / whole < _UNEVEN
        many = _pairs(panel[pair[these] // 3], patch[these], size) >= _FEW
        found |= these & (goes_on & even & many)[patch]
    return found


def _panels(topology: MeshTopology, pair: Ints, fold: Floats, low: float) -> Ints:
    """Return the panel number (f,) of each facet: the facets of one plane, or two facets that bend least towards each
    other, the halves of a quadrilateral that is not plane."""
    facet, n = pair // 3, len(topology.plane)
    single = np.bincount(topology.plane)[topology.plane] == 1
    usable = np.flatnonzero((np.abs(fold) < low) & single[facet].all(axis=1))
    order = usable[np.argsort(np.abs(fold[usable]), kind="stable")]
    least = np.full(n, -1)
    # The last value written counts: going backwards, that is the least fold.
    for side in (0, 1):
        back = order[::-1]
        here = facet[back, side]
        rival = least[here]
        better = (rival < 0) | (np.abs(fold[back]) <= np.abs(fold[rival]))
        least[here[better]] = back[better]
    halves = order[(least[facet[order, 0]] == order) & (least[facet[order, 1]] == order)]
    by_plane = np.unique(topology.plane, return_index=True)[1][topology.plane]
    links = np.concatenate([np.stack([np.arange(n), by_plane], axis=1), facet[halves]])
    return components(links, n)


def _across(corners: Floats, pair: Ints) -> tuple[Floats, Floats]:
    """Return the lengths (e,) [m] of edges and the directions (e, 2, 3) across them in both facets."""
    facet, k = pair // 3, pair % 3
    one = corners[facet[:, 0], k[:, 0]]
    span = corners[facet[:, 0], (k[:, 0] + 1) % 3] - one
    length = np.linalg.norm(span, axis=1)
    along = span / np.maximum(length, 1e-300)[:, None]
    c = corners[facet]
    normal = np.cross(c[:, :, 1] - c[:, :, 0], c[:, :, 2] - c[:, :, 0])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return length, np.cross(along[:, None], normal)


def _alone(panel: Ints, bend: Floats, across: Floats) -> Floats:
    """Return the share (e,) that each fold has of its panels' (e, 2) bending in that direction, on the side where it is
    less: 1 where the curvature ends at the fold, a half on a strip of equal folds."""
    n = int(panel.max()) + 1
    key = np.unique(np.sort(panel, axis=1) @ np.array([n, 1]), return_inverse=True)[1].ravel()
    tensors = bend[:, None, None, None] * across[..., :, None] * across[..., None, :]
    share, whole = np.ones(len(panel)), np.zeros((n, 3, 3))
    np.add.at(whole, panel, tensors)
    for side in (0, 1):
        own = np.zeros((int(key.max()) + 1, 3, 3))
        np.add.at(own, key, tensors[:, side])
        way = across[:, side]
        mine, all_ = (np.einsum("ei,eij,ej->e", way, t, way) for t in (own[key], whole[panel[:, side]]))
        share = np.minimum(share, mine / np.maximum(all_, 1e-300))
    return share


def _along(point: Ints, pair: Ints, panel: Ints, size: Floats, fold: Floats, among: Bools, near: Bools) -> Floats:
    """Return how much each fold (e,) of `among` and its panels (e, 2) differ from the next along a ring: the largest
    difference over sum of both folds and of both panels' sizes, for the more alike of its two neighbours; 1 where
    there is none.

    The next fold begins where this one ends, between two other panels, each of them beside one of this fold's across
    a fold of `near` (e,). Args: point (h,) the number of each half edge's first point.
    """
    rows = np.flatnonzero(among)
    half = pair[rows, 0]
    ends = np.stack([point[half], point[half - half % 3 + (half + 1) % 3]], axis=1).ravel()
    owner = np.repeat(np.arange(len(rows)), 2)
    order = np.argsort(ends, kind="stable")
    least = np.ones(len(fold))
    beside = np.unique(np.sort(panel[near], axis=1) @ np.array([len(size), 1]))
    for step in range(1, int(np.unique(ends, return_counts=True)[1].max())):
        same = np.flatnonzero(ends[order[:-step]] == ends[order[step:]])
        one, other = rows[owner[order[same]]], rows[owner[order[same + step]]]
        for turn in (1, -1):
            a, b = panel[one], panel[other][:, ::turn]
            sides = np.sort(np.stack([a, b], axis=2), axis=2)
            next_ = (a != b).all(axis=1) & np.isin(sides @ np.array([len(size), 1]), beside).all(axis=1)
            off = np.abs(fold[one] - fold[other]) / (np.abs(fold[one]) + np.abs(fold[other]))
            for k in (0, 1):
                off = np.maximum(off, _apart(size, np.stack([a[:, k], b[:, k]], axis=1)))
            for these in (one, other):
                np.minimum.at(least, these[next_], off[next_])
    return least


def _apart(size: Floats, both: Ints) -> Floats:
    """Return difference over sum (e,) of the sizes of two things (e, 2)."""
    a, b = size[both[:, 0]], size[both[:, 1]]
    return np.asarray(np.abs(a - b) / np.maximum(a + b, 1e-300))


def _pairs(panel: Ints, patch: Ints, n: int) -> Ints:
    """Return the number of different pairs of panels (e, 2) in each of n patches."""
    rows = np.unique(np.column_stack([patch, np.sort(panel, axis=1)]), axis=0)
    return np.bincount(rows[:, 0], minlength=n)
