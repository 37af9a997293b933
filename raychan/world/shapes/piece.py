"""Pieces of surface with exact corner normals, and their assembly to a mesh of named parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import edge_curvatures
from raychan.world.meshes.halving import cubic_off
from raychan.world.meshes.mesh import Floats, Ints, Mesh, make_mesh

SAG = 0.3e-3
"""Default largest distance [m] between a curved part and its facets: facets against accuracy (not measured)."""
BODY_SAG = 0.6e-3
"""The same for vehicles, whose corner normals carry the curvature: fewer facets are enough (not measured)."""

_OWN, _OTHER = np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0, 1, 3], [1, 2, 3]])  # corners of a cell's two facets
_ALIKE = 1e-3  # of a distance: cuts of a cell that differ by less are alike
_EQUAL = 1e-9  # of a diagonal, and m of a distance: by less they differ by rounding
_UP, _DIGITS = np.array([0.01, 0.0, 2.0]), 9  # weights of a corner's x, y and z [1/m], and digits of their sum

Bend = Callable[[Floats], tuple[Floats, Floats]]
"""Maps points (n, 3) to new points (n, 3) and the Jacobian there (n, 3, 3)."""


@dataclass(frozen=True)
class Piece:
    """Triangles with corner normals (f, 3, 3); `cell` (f,) numbers the quadrilateral each came from."""

    vertices: Floats
    faces: Ints
    normals: Floats
    cell: Ints

    def moved(self, matrix: Floats | None = None, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Piece:
        """Return the piece under x -> matrix x + offset; a reflection turns the faces with it."""
        m = np.eye(3) if matrix is None else np.asarray(matrix, float)
        normals = _unit(self.normals @ np.linalg.inv(m))
        faces = self.faces if np.linalg.det(m) > 0.0 else self.faces[:, ::-1]
        turned = normals if np.linalg.det(m) > 0.0 else normals[:, ::-1]
        return Piece(self.vertices @ m.T + np.asarray(offset, float), faces, turned, self.cell)

    def mirrored(self) -> Piece:
        """Return the piece reflected in the plane y = 0."""
        return self.moved(np.diag([1.0, -1.0, 1.0]))

    def bent(self, bend: Bend) -> Piece:
        """Return the piece under a smooth map that keeps orientation; normals by its Jacobian's inverse transpose.

        Quadrilaterals are cut anew, for the surface that they now span."""
        vertices, jacobian = bend(self.vertices)
        inverse = np.linalg.inv(jacobian)[self.faces]
        normals = _unit(np.einsum("fij,fijk->fik", self.normals, inverse))
        return Piece(vertices, self.faces, normals, self.cell).recut()

    def recut(self) -> Piece:
        """Return the piece with each quadrilateral cut along the diagonal by which quadratic facets lie nearer to cubic
        ones, of two alike along the shorter one, of two equal ones along that from the corner highest and farthest from
        y = 0: a piece that is its own image in this plane has facets that are, too."""
        faces, normals = self.faces.copy(), self.normals.copy()
        i = np.flatnonzero(self.cell[1:] == self.cell[:-1])
        # Faces abc and acd, as `grid` makes them.
        corners = (i, 0), (i, 1), (i, 2), (i + 1, 2)
        at, n = (np.stack([x[row, k] for row, k in corners], axis=1) for x in (self.faces, self.normals))
        p = self.vertices[at]
        own, other = (_off(p[:, cuts], n[:, cuts]) for cuts in (_OWN, _OTHER))
        ac, bd = (np.linalg.norm(p[:, k + 2] - p[:, k], axis=1) for k in (0, 1))
        equal = np.abs(ac - bd) < _EQUAL * ac
        highest = np.argmax(np.round(p @ _UP + np.abs(p[..., 1]), _DIGITS), axis=1)
        alike = np.abs(own - other) < _EQUAL + _ALIKE * np.maximum(own, other)
        rows = np.flatnonzero(np.where(alike, np.where(equal, highest % 2 == 1, bd < ac), other < own))
        for f, cut in enumerate(_OTHER):
            faces[i[rows] + f], normals[i[rows] + f] = at[rows][:, cut], n[rows][:, cut]
        return Piece(self.vertices, faces, normals, self.cell)

    def centres(self) -> Floats:
        """Return the centre (f, 3) of the cell that each face belongs to."""
        middle = self.vertices[self.faces].mean(axis=1)
        count = np.bincount(self.cell)
        return np.stack([np.bincount(self.cell, middle[:, i]) / np.maximum(count, 1) for i in range(3)], axis=1)[
            self.cell
        ]

    def facing(self) -> Floats:
        """Return the mean normal (f, 3) of the cell that each face belongs to."""
        middle = self.normals.mean(axis=1)
        return _unit(np.stack([np.bincount(self.cell, middle[:, i]) for i in range(3)], axis=1)[self.cell])

    def where(self, keep: NDArray[np.bool_]) -> Piece:
        """Return the faces (f,) chosen."""
        return Piece(self.vertices, self.faces[keep], self.normals[keep], self.cell[keep])


def _unit(v: Any) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _off(v: Floats, n: Floats) -> Floats:
    """Return how far (c,) [m] at most the quadratic facets of cells, v and n (c, 2, 3, 3), lie from cubic ones."""
    corners, normals = v.reshape(-1, 3, 3), n.reshape(-1, 3, 3)
    off = cubic_off(corners, normals, edge_curvatures(corners, normals)[0])
    return np.asarray(off.reshape(-1, 2).max(axis=1))


def join(*pieces: Piece) -> Piece:
    """Return several pieces as one."""
    base = np.cumsum([0, *(len(p.vertices) for p in pieces)])
    cells = np.cumsum([0, *(int(p.cell.max(initial=-1)) + 1 for p in pieces)])
    return Piece(
        np.concatenate([p.vertices for p in pieces]),
        np.concatenate([p.faces + b for p, b in zip(pieces, base, strict=False)]),
        np.concatenate([p.normals for p in pieces]),
        np.concatenate([p.cell + c for p, c in zip(pieces, cells, strict=False)]),
    )


def grid(points: Floats, normals: Floats) -> Piece:
    """Return the surface through points (m, n, 3) with normals (m, n, 3); cells whose ends coincide collapse.

    Row index i and column index j must run so that (d/di) x (d/dj) points outward.
    """
    m, n = points.shape[:2]
    index = np.arange(m * n).reshape(m, n)
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)
    cell = np.repeat(np.arange(len(a)), 2)
    vertices = points.reshape(-1, 3)
    p = vertices[faces]
    # Near-zero edges: poles, and creases (the same point twice with two normals).
    shortest = np.linalg.norm(np.roll(p, -1, axis=1) - p, axis=2).min(axis=1)
    keep = shortest > 1e-9 * max(float(np.ptp(vertices, axis=0).max()), 1e-300)
    return Piece(vertices, faces[keep], normals.reshape(-1, 3)[faces[keep]], cell[keep])


def polygon(points: Floats) -> Piece:
    """Return a flat convex polygon (n, 3), counter-clockwise seen from outside."""
    p = np.asarray(points, float)
    n = len(p)
    faces = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    normal = _unit(sum(np.cross(p[i] - p[0], p[i + 1] - p[0]) for i in range(1, n - 1)))  # type: ignore[arg-type]
    return Piece(p, faces, np.broadcast_to(normal, (n - 2, 3, 3)).copy(), np.zeros(n - 2, int))


@dataclass
class Assembly:
    """Gathers pieces under part names with the names of their materials."""

    parts: dict[str, str] = field(default_factory=dict)
    pieces: list[tuple[str, Piece]] = field(default_factory=list)

    def add(self, part: str, material: str, *pieces: Piece) -> None:
        """Add pieces to a part; the first call fixes the part's material."""
        self.parts.setdefault(part, material)
        self.pieces.extend((part, p) for p in pieces if len(p.faces))

    def pair(self, part: str, material: str, *pieces: Piece) -> None:
        """Add pieces to `part`_left and their reflections in y = 0 to `part`_right."""
        self.add(f"{part}_left", material, *pieces)
        self.add(f"{part}_right", material, *(p.mirrored() for p in pieces))

    def mesh(self) -> Mesh:
        """Return the mesh of all parts."""
        names = tuple(self.parts)
        whole = join(*(p for _, p in self.pieces))
        part = np.concatenate([np.full(len(p.faces), names.index(name), np.int32) for name, p in self.pieces])
        materials = tuple(self.parts.values())
        return make_mesh(whole.vertices, whole.faces, part, names, whole.normals, part_materials=materials)
