"""Triangle meshes of bodies: vertices welded, degenerate faces dropped, faces wound outward, and the corner normals of
the surface that the mesh stands for."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import planes_of
from raychan.world.errors import SceneError
from raychan.world.meshes import degenerate_faces
from raychan.world.meshes.inner_spheres import inner_spheres_of
from raychan.world.meshes.merge_coplanar import merge_flat
from raychan.world.meshes.pieces import edges, pieces
from raychan.world.meshes.scene_topology import closed_pieces
from raychan.world.meshes.topology import MeshTopology, mesh_topology, point_numbers
from raychan.world.meshes.vertex_normals import folds, smoothed

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]

CREASE_DEG = 20.0
"""Crease angle [deg] where none is given: sections of a cylinder are smooth from 19 on (not measured against
others)."""
_ROUNDED = 2e-6  # of the largest coordinates: what single precision makes of a height, at most (7 roundings of 6e-8 of
# up to 3 of them)
_ALIKE = 5e-4  # of the crease angle: equal folds are treated equally although files round their vertices


@dataclass(frozen=True)
class MeshReport:
    """What was found in a mesh, and what was mended."""

    vertices: int
    faces: int
    bodies: int
    watertight: bool
    open_edges: int
    non_manifold_edges: int
    size: tuple[float, float, float]
    zero_area: int = 0
    duplicates: int = 0
    flipped: int = 0
    unread_normals: int = 0
    folded: int = 0

    def warnings(self) -> list[str]:
        """Return one sentence for each thing a user should know."""
        said = []
        if self.zero_area:
            said.append(f"{self.zero_area} faces of zero area dropped")
        if self.duplicates:
            said.append(f"{self.duplicates} duplicate faces dropped")
        if self.watertight and min(self.size) == 0.0:
            said.append("closed, but without thickness: a sheet whose two sides lie on each other")
        if self.flipped:
            said.append(f"{self.flipped} faces turned to face outward")
        if self.unread_normals:
            said.append(f"{self.unread_normals} of the file's normals are no three numbers and were left out")
        if self.folded:
            said.append(
                f"faces of more than three corners are not convex: {self.folded} pairs of the triangles that they are "
                "cut into lie on each other and return too much; divide such faces"
            )
        if not self.watertight:
            said.append(f"not watertight: {self.open_edges} open and {self.non_manifold_edges} non-manifold edges")
        return said


@dataclass(frozen=True)
class Mesh:
    """Triangles in a body's own frame.

    Fields: vertices (v, 3) [m]; faces (f, 3), counter-clockwise seen from outside; part (f,) index into part_names;
    normals (f, 3, 3) unit normals of the surface at the corners; part_materials names by part, or (); crease_deg
    the angle [deg] under which folds were taken as smooth to estimate normals, None where normals are known.
    """

    vertices: Floats
    faces: Ints
    part: Ints
    part_names: tuple[str, ...]
    normals: Floats
    report: MeshReport
    part_materials: tuple[str, ...] = field(default=())
    crease_deg: float | None = None

    @cached_property
    def topology(self) -> MeshTopology:
        """Which faces share edges and vertices, and which edges are open."""
        return mesh_topology(point_numbers(self.vertices)[self.faces], self.part, self.corners, self.normals)

    def inner_spheres(self, opaque: tuple[bool, ...]) -> tuple[Floats, Floats]:
        """Return centres (k, 3) [m] and radii (k,) [m] of spheres inside, whose shadows lie within the mesh's shadow.

        Args: opaque: which parts let no wave through.
        """
        if opaque not in self._cores:
            solid = closed_pieces(self.topology, np.array(opaque, bool)[self.part])
            self._cores[opaque] = inner_spheres_of(self.corners[solid])
        return self._cores[opaque]

    @cached_property
    def memo(self) -> dict[str, Any]:
        """Results derived from the mesh that are computed once, by name."""
        return {}

    @cached_property
    def _cores(self) -> dict[tuple[bool, ...], tuple[Floats, Floats]]:
        return {}

    @property
    def corners(self) -> Floats:
        """Corners (f, 3, 3) [m] of the faces."""
        return self.vertices[self.faces]

    @cached_property
    def bounds(self) -> Floats:
        """Lowest and highest corner (2, 3) [m]."""
        # By column: numpy takes six times as long along rows of three.
        return np.array([[x.min() for x in self.vertices.T], [x.max() for x in self.vertices.T]])

    def planes_near(self, point: Floats) -> tuple[Floats, Floats, Floats]:
        """Return a corner (p, 3) [m] of each face in whose plane a point (3,) [m] may lie, its unit normal (p, 3), zero
        where it has no area, and how far along it the plane lies from the origin (p,) [m].

        A mesh keeps its planes once they were asked for, 16 bytes a face.
        """
        if "planes" not in self.memo:
            _, normal, level = self._planes_of(slice(None))
            self.memo["planes"] = normal.astype(np.float32), level.astype(np.float32)
        normal, level = self.memo["planes"]
        room = _ROUNDED * float(np.abs(point).max() + np.abs(self.bounds).max())
        return self._planes_of(np.flatnonzero(~(np.abs(normal @ point.astype(np.float32) - level) > room)))

    def _planes_of(self, rows: Any) -> tuple[Floats, Floats, Floats]:
        """Return the planes of some faces, as `planes_near` does."""
        corners = self.vertices[self.faces[rows]]
        first, normal = np.ascontiguousarray(corners[:, 0]), planes_of(corners)[0]
        return first, normal, np.einsum("ij,ij->i", first, normal)

    @property
    def areas(self) -> Floats:
        """Areas (f,) [m2] of the faces."""
        areas: Floats = planes_of(self.corners)[1]
        return areas

    def volume(self) -> float:
        """Return the signed volume [m3] enclosed; meaningful where watertight."""
        c = self.corners
        return float(np.einsum("ij,ij->", c[:, 0], np.cross(c[:, 1], c[:, 2])) / 6.0)

    def winding(self, point: Floats) -> float:
        """Return the winding number of the faces about a point (3,): 1 inside a closed body, 0 outside.

        Source: Van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30(2), 1983 (solid angle of a triangle).
        """
        a, b, c = np.moveaxis(self.corners - np.asarray(point, float), 1, 0)
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        dots = [np.einsum("ij,ij->i", *p) for p in ((a, b), (b, c), (c, a))]
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        angle = np.arctan2(volume, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
        return float(angle.sum() / (2.0 * np.pi))


def make_mesh(
    vertices: Floats,
    faces: Ints,
    part: Ints | None = None,
    part_names: tuple[str, ...] = ("body",),
    normals: Floats | None = None,
    *,
    crease_deg: float = CREASE_DEG,
    part_materials: tuple[str, ...] = (),
) -> Mesh:
    """Return a checked Mesh of raw triangles: vertices welded, degenerate faces dropped, closed pieces wound outward.

    Args: vertices (v, 3) [m]; faces (f, 3); part (f,); normals (f, 3, 3) exact corner normals, or None to estimate them
    over folds of less than crease_deg (the faces' winding is then made consistent, too).
    Raises: SceneError for a mesh that is empty, has NaN or faces of missing vertices, or a size that no radar resolves.
    """
    v, f = np.asarray(vertices, float).reshape(-1, 3), np.asarray(faces, np.int64).reshape(-1, 3)
    v, f = degenerate_faces.used(v, f)
    kind = np.zeros(len(f), np.int32) if part is None else np.asarray(part, np.int32)
    v, f = degenerate_faces.weld(v, f)
    keep, zero, twins = degenerate_faces.alive(v, f)
    if not keep.any():
        raise SceneError("mesh is empty: no face with an area", value=len(f), allowed="at least one triangle")
    f, kind = f[keep], kind[keep]
    flipped = 0
    if normals is None:
        f, flipped = _wind(v, f)
        f, merged = merge_flat(v, f, kind.astype(np.int64), _edge_pairs, pieces)
        kind = merged.astype(np.int32)
        corner_normals = smooth_normals(v, f, crease_deg)
    else:
        corner_normals = np.asarray(normals, float)[keep]
    v, f = degenerate_faces.named(v, f)
    f = f.astype(np.int32)
    report = _report(v, f, zero, twins, flipped)
    crease = crease_deg if normals is None else None
    return Mesh(v, f, kind, part_names, corner_normals, report, part_materials, crease)


def creased(mesh: Mesh, crease_deg: float) -> Mesh:
    """Return a mesh with its normals estimated by another crease angle [deg]; the same mesh where they are known."""
    if mesh.crease_deg in (None, crease_deg):
        return mesh
    return replace(mesh, normals=smooth_normals(mesh.vertices, mesh.faces, crease_deg), crease_deg=crease_deg)


def opposed_pairs(faces: Ints) -> tuple[Ints, Ints]:
    """Return the two faces (e,) of each edge that exactly two faces share, in opposite directions."""
    a, b, _, _, opposed = _edge_pairs(faces)
    return a[opposed], b[opposed]


def crease_angle(crease_deg: float) -> float:
    """Return the angle [rad] under which folds are smooth, for a crease angle [deg]."""
    return float((1.0 + _ALIKE) * np.radians(crease_deg))


def smooth_normals(vertices: Floats, faces: Ints, crease_deg: float = CREASE_DEG) -> Floats:
    """Return corner normals (f, 3, 3), smoothed over folds of less than crease_deg (see world.vertex_normals)."""
    a, b, ea, eb, opposed = _edge_pairs(faces)
    pair = np.stack([3 * a + ea, 3 * b + eb], axis=1)[opposed]
    return smoothed(vertices, faces, pair[folds(vertices, faces, pair) < crease_angle(crease_deg)])


def _edge_pairs(f: Ints) -> tuple[Ints, Ints, Ints, Ints, NDArray[np.bool_]]:
    """Return, for edges of exactly two faces, the faces, their local edges, and whether the directions are opposite."""
    order, run = edges(f)
    uses = np.bincount(run)
    first = (np.cumsum(uses) - uses)[uses == 2]
    h, g = order[first], order[first + 1]
    start = f.ravel()
    return h // 3, g // 3, h % 3, g % 3, start[h] != start[g]


def _wind(v: Floats, f: Ints) -> tuple[Ints, int]:
    """Wind neighbours consistently and closed pieces outward; return the faces and how many were turned."""
    n = len(f)
    a, b, _, _, opposed = _edge_pairs(f)
    # Graph of 2 n nodes: f is the face as it is, n + f the face turned; consistent neighbours share a component.
    turn = np.where(opposed, 0, n)
    cover = pieces(np.concatenate([a, a + n]), np.concatenate([b + turn, b + n - turn]), 2 * n)
    piece = pieces(a, b, n)
    _, root = np.unique(piece, return_index=True)
    flip = cover[:n] != cover[root][piece]
    # The smallest change: most faces of a piece keep their winding.
    count = np.bincount(piece)
    flip ^= (2 * np.bincount(piece, flip) > count)[piece]
    out = np.where(flip[:, None], f[:, ::-1], f)
    order, run = edges(out)
    uses = np.bincount(run)[run]
    closed = np.bincount(piece, np.bincount(order[uses != 2] // 3, minlength=n)) == 0
    c = v[out] - v.mean(axis=0)
    volume = np.bincount(piece, np.einsum("ij,ij->i", c[:, 0], np.cross(c[:, 1], c[:, 2])))
    inside_out = (closed & (volume < 0.0))[piece]
    out = np.where(inside_out[:, None], out[:, ::-1], out)
    return out, int((flip ^ inside_out).sum())


def _report(v: Floats, f: Ints, zero: int, twins: int, flipped: int) -> MeshReport:
    order, run = edges(f)
    uses = np.bincount(run)
    same, start = run[1:] == run[:-1], f.ravel()[order]
    facing = start[1:][same] != start[:-1][same]
    bodies = int(pieces(order[:-1][same] // 3, order[1:][same] // 3, len(f)).max()) + 1
    size = np.ptp(v, axis=0)
    return MeshReport(
        vertices=len(v),
        faces=len(f),
        bodies=bodies,
        watertight=bool((uses == 2).all() and facing.all()),
        open_edges=int((uses == 1).sum()),
        non_manifold_edges=int((uses > 2).sum()),
        size=(float(size[0]), float(size[1]), float(size[2])),
        zero_area=zero,
        duplicates=twins,
        flipped=flipped,
    )
