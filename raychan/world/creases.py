"""What a mesh leaves open: which of its folds are edges of the body, and where the smooth surface behind it turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raychan.world.mesh import Mesh, crease_angle
from raychan.world.tessellation import rounded
from raychan.world.vertex_normals import components, folds, smoothed

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
    folds as edges, rounded those with the folds above the crease angle smooth that look like a tessellation's; None
    where they would be the same.
    """

    fitted: Floats | None = None
    creased: Floats | None = None
    rounded: Floats | None = None


def readings(mesh: Mesh) -> Readings:
    """Return what else a mesh may stand for.

    Folds may be edges on patches that turn by more than half the crease angle from facet to facet (an eighth where
    they bend one way only: a prism of 36 sides is a body of its own as much as a cylinder), and where the facets are
    no tessellation of a smooth surface: those of grids, of subdivided solids and of sections are alike on both sides
    of an edge, those of a hull around points are not. Folds above the crease angle may be smooth where they look like
    a tessellation (see `tessellation`).
    """
    if "readings" not in mesh.kept:
        mesh.kept["readings"] = _found(mesh)
    found: Readings = mesh.kept["readings"]
    return found


def _found(mesh: Mesh) -> Readings:
    if mesh.crease_deg is None:
        return Readings()
    pair, _, doubt = _folds(mesh)
    hard, _ = _hard_folds(mesh)
    round_ = smoothed(mesh.vertices, mesh.faces, np.concatenate([_soft_folds(mesh)[0], hard])) if len(hard) else None
    if not len(pair):
        return Readings(rounded=round_)
    fitted = smoothed(mesh.vertices, mesh.faces, pair, _EVEN)
    # Where the folds themselves are in doubt, that is told by the other reading.
    fitted[pair[doubt] // 3] = mesh.normals[pair[doubt] // 3]
    creased = smoothed(mesh.vertices, mesh.faces, pair[~doubt]) if doubt.any() else None
    return Readings(fitted if np.abs(fitted - mesh.normals).max() > _BEND else None, creased, round_)


def folds_told(mesh: Mesh, key: str) -> str:
    """Return a sentence about folds that were taken for smooth and may be edges, or for edges and may be smooth, and
    the key that decides; else ''."""
    _, fold, doubt = _folds(mesh)
    _, hard = _hard_folds(mesh)
    said = []
    if doubt.any():
        smooth, largest = int((fold > _BEND).sum()), float(np.degrees(fold.max()))
        said.append(
            f"{smooth} folds of up to {largest:.3g} deg are taken for smooth; {int(doubt.sum())} of them may be edges"
        )
    if len(hard):
        low, high = np.degrees([hard.min(), hard.max()])
        span = f"{low:.4g}" if high - low < 0.01 else f"{low:.4g} to {high:.4g}"
        said.append(f"{len(hard)} folds of {span} deg are taken for edges and may be a curved surface")
    return f"{'; '.join(said)}: {key} decides" if said else ""


def _folds(mesh: Mesh) -> tuple[Ints, Floats, Bools]:
    """Return the soft edges of a mesh as half edges (e, 2), their folds (e,) [rad] and which of them may be edges."""
    pair, fold = _soft_folds(mesh)
    bent = fold > _BEND
    if not bent.any():
        return pair[:0], fold[:0], bent[:0]
    return pair, fold, bent & _doubted(mesh, pair, np.where(bent, fold, 0.0))


def _soft_folds(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) over which a mesh was smoothed, and their folds (e,) [rad]."""
    pair, fold = _all_folds(mesh)
    soft = fold < crease_angle(mesh.crease_deg or 0.0)
    return pair[soft], fold[soft]


def _hard_folds(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) of folds above the crease angle that may be smooth, and these folds (e,) [rad]."""
    pair, fold = _all_folds(mesh)
    if not mesh.crease_deg or not len(pair):
        return pair[:0], fold[:0]
    smooth = rounded(mesh.topology, mesh.corners, pair, _outward(mesh, pair) * fold, crease_angle(mesh.crease_deg))
    return pair[smooth], fold[smooth]


def _all_folds(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) that two facets walk in opposite ways, and their folds (e,) [rad]."""
    pair = mesh.topology.pair
    corner = mesh.faces.astype(np.int64).ravel()
    pair = pair[corner[pair[:, 0]] != corner[pair[:, 1]]]
    return pair, folds(mesh.vertices, mesh.faces, pair)


def _outward(mesh: Mesh, pair: Ints) -> Floats:
    """Return 1 (e,) where the facets of a pair bend away from the side they face, -1 where towards it."""
    c, (one, other) = mesh.corners, pair.T
    a = c[one // 3]
    normal = np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0])
    tip = c[other // 3, (other % 3 + 2) % 3] - c[other // 3, other % 3]
    return np.where(np.einsum("ij,ij->i", normal, tip) > 0.0, -1.0, 1.0)


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
