"""What a mesh leaves open: which of its folds are edges of the body, and where the smooth surface behind it turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.world.mesh import Mesh, crease_angle
from raychan.world.smoothing import components, folds, smoothed

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_EVEN = 0.0  # power of the distance in the other fit: neighbours far and near weigh alike
_BEND = 1e-5  # rad: less is flat
_WIDE = 0.5  # of the crease angle: folds between it and the crease angle itself may be edges
_STRIPS = 0.125  # of the crease angle: the same where the surface bends one way only, as prisms and cones do
_ONE_WAY = 0.02  # of a patch's bending: as much across, and it bends both ways
_UNEVEN = 0.17  # of facets about an edge: how far their heights may differ, over their sum
_FEW = 4  # folds: fewer tell nothing of a tessellation


@dataclass(frozen=True, eq=False)
class Readings:
    """Other readings of a mesh whose corner normals were estimated.

    Fields: fitted (f, 3, 3) corner normals by another fit where no fold is doubtful, creased those with the doubtful
    folds as edges; None where they would be the same.
    """

    fitted: Floats | None = None
    creased: Floats | None = None


def readings(mesh: Mesh) -> Readings:
    """Return what else a mesh may stand for.

    Folds may be edges on patches that turn by more than half the crease angle from facet to facet (an eighth where
    they bend one way only: a prism of 36 sides is a body of its own as much as a cylinder), and where the facets are
    no tessellation of a smooth surface: those of grids, of subdivided solids and of sections are alike on both sides
    of an edge, those of a hull around points are not.
    """
    if "readings" not in mesh.kept:
        mesh.kept["readings"] = _found(mesh)
    found: Readings = mesh.kept["readings"]
    return found


def _found(mesh: Mesh) -> Readings:
    pair, _, doubt = _folds(mesh)
    if mesh.crease_deg is None or not len(pair):
        return Readings()
    fitted = smoothed(mesh.vertices, mesh.faces, pair, _EVEN)
    # Where the folds themselves are in doubt, that is told by the other reading.
    fitted[pair[doubt] // 3] = mesh.normals[pair[doubt] // 3]
    creased = smoothed(mesh.vertices, mesh.faces, pair[~doubt]) if doubt.any() else None
    return Readings(fitted if np.abs(fitted - mesh.normals).max() > _BEND else None, creased)


def folds_told(mesh: Mesh, key: str) -> str:
    """Return a sentence about folds that were taken for smooth and may be edges, and the key that decides; else ''."""
    _, fold, doubt = _folds(mesh)
    if not doubt.any():
        return ""
    smooth, largest = int((fold > _BEND).sum()), float(np.degrees(fold.max()))
    return (
        f"{smooth} folds of up to {largest:.3g} deg are taken for smooth; {int(doubt.sum())} of them may be edges: "
        f"{key} decides"
    )


def _folds(mesh: Mesh) -> tuple[Ints, Floats, Bools]:
    """Return the soft edges of a mesh as half edges (e, 2), their folds (e,) [rad] and which of them may be edges."""
    pair, fold = soft_folds(mesh)
    bent = fold > _BEND
    if not bent.any():
        return pair[:0], fold[:0], bent[:0]
    return pair, fold, bent & _doubted(mesh, pair, np.where(bent, fold, 0.0))


def soft_folds(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) over which a mesh was smoothed, and their folds (e,) [rad]."""
    pair = mesh.joints.pair
    corner = mesh.faces.astype(np.int64).ravel()
    opposed = corner[pair[:, 0]] != corner[pair[:, 1]]
    fold = folds(mesh.vertices, mesh.faces, pair)
    soft = opposed & (fold < crease_angle(mesh.crease_deg or 0.0))
    return pair[soft], fold[soft]


def _doubted(mesh: Mesh, pair: Ints, fold: Floats) -> Bools:
    """Return which soft edges (e,) are of a patch that folds by much or whose facets are uneven, both in the mean over
    its edges by how much it bends there."""
    one, other = pair.T
    span = _spans(mesh, pair)
    weight = fold * np.linalg.norm(span, axis=1)
    # Heights over one edge go by the areas.
    a, b = mesh.areas[one // 3], mesh.areas[other // 3]
    of_facet = components(pair // 3, len(mesh.faces))
    patch, crease = of_facet[one // 3], crease_angle(mesh.crease_deg or 0.0)

    def mean(x: Floats) -> Floats:
        return np.asarray(np.bincount(patch, weight * x) / np.maximum(np.bincount(patch, weight), 1e-300))

    wide = crease * np.where(_one_way(mesh, pair, fold, of_facet)[: patch.max() + 1], _STRIPS, _WIDE)
    doubtful = (mean(np.abs(a - b) / (a + b)) > _UNEVEN) | (mean(fold) > wide) | (np.bincount(patch, fold > 0.0) < _FEW)
    return np.asarray(doubtful[patch])


def _one_way(mesh: Mesh, pair: Ints, fold: Floats, patch: NDArray[np.int64]) -> Bools:
    """Return which patches bend one way only, facet for facet, given the patch (f,) of each facet.

    A facet bends across each of its edges by the fold times the edge's length; the tensor of that has one direction.
    Source: Cohen-Steiner, Morvan, Restricted Delaunay triangulations and normal cycle, 2003.
    """
    span = _spans(mesh, pair)
    length = np.linalg.norm(span, axis=1)
    along = span / np.maximum(length, 1e-300)[:, None]
    tensor = np.zeros((len(mesh.faces), 3, 3))
    for half in pair.T:
        corners = mesh.corners[half // 3]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        across = np.cross(along, normal / np.linalg.norm(normal, axis=1, keepdims=True))
        np.add.at(tensor, half // 3, (fold * length)[:, None, None] * across[:, :, None] * across[:, None, :])
    bends = np.linalg.eigvalsh(tensor)
    most, least = (np.bincount(patch, bends[:, i]) for i in (2, 1))
    return np.asarray(least < _ONE_WAY * most)


def _spans(mesh: Mesh, pair: Ints) -> Floats:
    """Return the vectors (e, 3) [m] along edges."""
    v, corner, one = mesh.vertices, mesh.faces.ravel(), pair[:, 0]
    return np.asarray(v[corner[np.where(one % 3 == 2, one - 2, one + 1)]] - v[corner[one]])
