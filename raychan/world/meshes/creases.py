"""Folds of a mesh that may be edges of the body or part of a smooth surface, and the other surfaces it may stand for.

A mesh does not say which of its folds are edges. Those under the crease angle are taken as smooth, and corner normals
are estimated over them. For the stated error of a cross-section the alternatives are computed as well: other normals,
uncertain smooth folds as edges, and uncertain edges as smooth folds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.fold_shapes import bends, edge_lengths, outward
from raychan.geometry.triangles import planes_of
from raychan.world.meshes.mesh import Mesh, crease_angle
from raychan.world.meshes.tessellation import rounded
from raychan.world.meshes.topology import point_numbers
from raychan.world.meshes.vertex_normals import components, folds, smoothed

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_EVEN = 0.0  # power of the distance in the alternative fit of normals: all neighbours weigh alike
_BEND = 1e-5  # rad: folds below it are flat
# Shares trade missed edges (a stated error too small) against smooth bodies stated too uncertain; chosen on the shapes
# of tests/truth/shapes.py, single values not measured.
_WIDE = 0.5  # of the crease angle: mean folds above this may be edges
_STRIPS = 0.125  # of the crease angle: the same on singly curved patches, as prisms and cones are
_ONE_WAY = 0.02  # of a patch's bending: with more across it, the patch is doubly curved
_UNEVEN = 0.17  # difference over sum of the heights of two facets about an edge: with more, no regular tessellation
_FEW = 4
"""Folds, or vertices within a doubly curved patch: fewer are no evidence of a tessellation. Four small folds about one
vertex are what hulls of some points have by chance."""
_ROUND = 3  # bent folds about a vertex where a surface is doubly curved: two are a ridge that runs through it


@dataclass(frozen=True, eq=False)
class Alternatives:
    """Corner normals (f, 3, 3) of the other surfaces that a mesh with estimated normals may stand for; None where they
    equal the mesh's own."""

    fitted: Floats | None = None
    """By another fit, where no fold is uncertain."""
    creased: Floats | None = None
    """With the uncertain smooth folds as edges."""
    rounded: Floats | None = None
    """With those folds above the crease angle as smooth that look like a tessellation."""
    regular: Bools | None = None
    """Facets (f,) of smooth patches that are a regular tessellation: finer ones come nearer to a smooth surface, which
    those of a convex hull of points do not. None where no fold is smooth."""
    checked: Bools | None = None
    """Facets (f,) whose curved surface was checked against that of a finer mesh; None where there is no finer one."""


def alternatives(mesh: Mesh, told: bool = False) -> Alternatives:
    """Return the other surfaces that a mesh may stand for; told: its crease angle is the caller's word on which folds
    are edges, so that a smooth surface is near its facets, however irregular they are.

    Smooth folds may be edges on patches that turn by more than half the crease angle from facet to facet (an eighth on
    singly curved ones: a prism of 36 sides is as plausible as a cylinder), and where the facets are no regular
    tessellation: facets of grids, subdivided solids and sections are alike on both sides of an edge, those of a convex
    hull of points are not. Folds above the crease angle may be smooth where they look like a tessellation (see
    world.tessellation).
    """
    name = f"alternatives {told}"
    if name not in mesh.memo:
        mesh.memo[name] = _alternatives(mesh, told)
    found: Alternatives = mesh.memo[name]
    return found


def _alternatives(mesh: Mesh, told: bool) -> Alternatives:
    if mesh.crease_deg is None:
        return Alternatives()
    pair, _, uncertain = _folds(mesh)
    hard, _ = _uncertain_edges(mesh)
    round_ = smoothed(mesh.vertices, mesh.faces, np.concatenate([_smooth_folds(mesh)[0], hard])) if len(hard) else None
    if not len(pair):
        return Alternatives(rounded=round_)
    fitted = smoothed(mesh.vertices, mesh.faces, pair, _EVEN)
    if not told:
        # At uncertain folds `creased` is the alternative.
        fitted[pair[uncertain] // 3] = mesh.normals[pair[uncertain] // 3]
    creased = smoothed(mesh.vertices, mesh.faces, pair[~uncertain]) if uncertain.any() else None
    return Alternatives(
        fitted=fitted if np.abs(fitted - mesh.normals).max() > _BEND else None,
        creased=creased,
        rounded=round_,
        regular=np.ones(len(mesh.faces), bool) if told else _regular(mesh),
    )


def uncertain_folds(mesh: Mesh, key: str) -> str:
    """Return a sentence on folds that were taken as smooth and may be edges, or as edges and may be smooth, with the
    key that decides; '' if there are none."""
    _, fold, uncertain = _folds(mesh)
    _, hard = _uncertain_edges(mesh)
    said = []
    if uncertain.any():
        smooth, largest = int((fold > _BEND).sum()), float(np.degrees(fold.max()))
        edges = int(uncertain.sum())
        said.append(f"{smooth} folds of up to {largest:.3g} deg are taken for smooth; {edges} of them may be edges")
    if len(hard):
        low, high = np.degrees([hard.min(), hard.max()])
        span = f"{low:.4g}" if high - low < 0.01 else f"{low:.4g} to {high:.4g}"
        said.append(f"{len(hard)} folds of {span} deg are taken for edges and may be a curved surface")
    return f"{'; '.join(said)}: {key} decides" if said else ""


def uncertain_facets(mesh: Mesh) -> Bools:
    """Return which facets (f,) are beside folds that were taken as smooth and may be edges, or as edges and may be
    smooth: their surface is not known well enough to be simplified."""
    found = np.zeros(len(mesh.faces), bool)
    if mesh.crease_deg is not None:
        pair, _, uncertain = _folds(mesh)
        found[pair[uncertain] // 3] = True
        found[_uncertain_edges(mesh)[0] // 3] = True
    return found


class _Folds(NamedTuple):
    """Folds of a mesh that are smooth and those above the crease angle that may be: half edges (e, 2) and angles (e,)
    [rad]; which of the smooth ones may be edges, None where none is bent."""

    smooth: Ints
    fold: Floats
    uncertain: Bools | None
    hard: Ints
    hard_fold: Floats


def _kept_folds(mesh: Mesh) -> _Folds:
    """Return the folds of a mesh, kept with it."""
    if "folds" not in mesh.memo:
        pair, fold = _all_folds(mesh)
        crease = crease_angle(mesh.crease_deg or 0.0)
        soft, hard = fold < crease, np.zeros(len(pair), bool)
        if mesh.crease_deg and len(pair):
            hard = rounded(mesh.topology, mesh.corners, pair, outward(*_facets(mesh), pair) * fold, crease)
        one, its = pair[soft], fold[soft]
        bent = its > _BEND
        uncertain = bent & _may_be_edges(mesh, one, np.where(bent, its, 0.0)) if bent.any() else None
        mesh.memo["folds"] = _Folds(one, its, uncertain, pair[hard], fold[hard])
    found: _Folds = mesh.memo["folds"]
    return found


def _folds(mesh: Mesh) -> tuple[Ints, Floats, Bools]:
    """Return the smooth folds of a mesh as half edges (e, 2), their angles (e,) [rad] and which of them may be edges;
    none where none is bent."""
    pair, fold, uncertain, _, _ = _kept_folds(mesh)
    return (pair[:0], fold[:0], np.zeros(0, bool)) if uncertain is None else (pair, fold, uncertain)


def _smooth_folds(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) over which a mesh was smoothed, and their angles (e,) [rad]."""
    return _kept_folds(mesh)[:2]


def _uncertain_edges(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) of folds above the crease angle that may be smooth, and their angles (e,) [rad]."""
    return _kept_folds(mesh)[3:]


def _all_folds(mesh: Mesh) -> tuple[Ints, Floats]:
    """Return the half edges (e, 2) that two facets share in opposite directions, and their folds (e,) [rad]."""
    pair = mesh.topology.pair
    corner = mesh.faces.astype(np.int64).ravel()
    pair = pair[corner[pair[:, 0]] != corner[pair[:, 1]]]
    return pair, folds(mesh.vertices, mesh.faces, pair)


def _regular(mesh: Mesh) -> Bools:
    """Return which facets (f,) are of smooth patches whose facets are even, as those of a regular tessellation are."""
    pair, fold = _smooth_folds(mesh)
    patch = components(pair // 3, len(mesh.faces))
    weight = np.where(fold > _BEND, fold, 0.0) * edge_lengths(mesh.vertices, mesh.faces, pair)
    whole, uneven = (np.bincount(patch[pair[:, 0] // 3], w, len(patch)) for w in (weight, weight * _uneven(mesh, pair)))
    return np.asarray((whole > 0.0) & (uneven <= _UNEVEN * whole))[patch]


def _uneven(mesh: Mesh, pair: Ints) -> Floats:
    """Return difference over sum (e,) of the heights of both facets over their shared edge, which are as the areas."""
    a, b = mesh.areas[pair.T // 3]
    return np.asarray(np.abs(a - b) / (a + b))


def _may_be_edges(mesh: Mesh, pair: Ints, fold: Floats) -> Bools:
    """Return which smooth folds (e,) may be edges: those of patches that fold strongly or whose facets are uneven, in
    the mean over the patch weighted by fold times length, and those of patches that are too small to tell: of few
    folds, or, where they are doubly curved, with few vertices that smooth folds surround."""
    one, weight = pair[:, 0], fold * edge_lengths(mesh.vertices, mesh.faces, pair)
    of_facet = components(pair // 3, len(mesh.faces))
    patch, crease = of_facet[one // 3], crease_angle(mesh.crease_deg or 0.0)

    def mean(x: Floats) -> Floats:
        return np.asarray(np.bincount(patch, weight * x) / np.maximum(np.bincount(patch, weight), 1e-300))

    one_way = _one_way(mesh, pair, fold, of_facet)[: patch.max() + 1]
    wide = crease * np.where(one_way, _STRIPS, _WIDE)
    uncertain = (mean(_uneven(mesh, pair)) > _UNEVEN) | (mean(fold) > wide) | (np.bincount(patch, fold > 0.0) < _FEW)
    uncertain |= ~one_way & (_within(mesh, pair, fold, of_facet)[: patch.max() + 1] < _FEW)
    return np.asarray(uncertain[patch])


def _within(mesh: Mesh, pair: Ints, fold: Floats, patch: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many vertices of each patch lie within it, where it is doubly curved: smooth folds lie between all
    facets about them, three of them bent at least. Args: as for `_one_way`."""
    point = point_numbers(mesh.vertices)[mesh.faces].ravel()
    one = pair[:, 0]
    ends = np.concatenate([point[one], point[np.where(one % 3 == 2, one - 2, one + 1)]])
    n = int(point.max()) + 1
    surrounded = (np.bincount(ends, minlength=n) == np.bincount(point, minlength=n)) & (
        np.bincount(ends, np.tile(fold > 0.0, 2), n) >= _ROUND
    )
    of_point = np.zeros(n, np.int64)
    of_point[point] = np.repeat(patch, 3)
    return np.bincount(of_point[surrounded], minlength=int(patch.max()) + 1)


def _one_way(mesh: Mesh, pair: Ints, fold: Floats, patch: NDArray[np.int64]) -> Bools:
    """Return which patches are singly curved, given the folds (e,) [rad] of edges and the patch (f,) of each facet."""
    most, least = (np.bincount(patch, x) for x in bends(*_facets(mesh), pair, fold))
    return np.asarray(least < _ONE_WAY * most)


def _facets(mesh: Mesh) -> tuple[Floats, Ints, Floats]:
    """Return vertices, faces and their unit normals (f, 3)."""
    return mesh.vertices, mesh.faces, planes_of(mesh.corners)[0]
