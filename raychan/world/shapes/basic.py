"""Basic bodies: plate, sphere, cylinder, box, corners, ground."""

from __future__ import annotations

import numpy as np

from raychan.world.meshes.mesh import Mesh
from raychan.world.shapes.piece import SAG, Assembly, Piece, polygon
from raychan.world.shapes.solid import block, ellipsoid, pillar


def _one(material: str, *pieces: Piece) -> Mesh:
    made = Assembly()
    made.add("body", material, *pieces)
    return made.mesh()


def plate(width: float = 1.0, height: float = 1.0, material: str = "pec") -> Mesh:
    """Return a flat sheet facing +x, centred on the origin, width along y and height along z [m]."""
    y, z = width / 2.0, height / 2.0
    return _one(material, polygon(np.array([[0, -y, -z], [0, y, -z], [0, y, z], [0, -y, z]])))


def sphere(radius: float = 0.5, max_sag: float = SAG, material: str = "pec") -> Mesh:
    """Return a sphere about the origin, radius [m]."""
    return _one(material, ellipsoid((radius, radius, radius), max_sag))


def cylinder(radius: float = 0.1, height: float = 1.0, max_sag: float = SAG, material: str = "pec") -> Mesh:
    """Return an upright closed cylinder on z = 0 about the z axis, radius and height [m]."""
    return _one(material, pillar(radius, height, sag=max_sag))


def box(length: float = 1.0, width: float = 1.0, height: float = 1.0, material: str = "pec") -> Mesh:
    """Return a closed box on z = 0, centred in x and y; length along x, width along y, height along z [m]."""
    return _one(material, block((-length / 2, -width / 2, 0.0), (length / 2, width / 2, height)))


def dihedral(size: float = 0.1, height: float = 0.1, material: str = "pec") -> Mesh:
    """Return two sheets, size across and height along z [m], that meet at right angles on the z axis and open to +x.

    Origin: middle of the common edge; boresight +x bisects the faces.
    """
    s, z = size / np.sqrt(2.0), height / 2.0
    left = np.array([[0, 0, -z], [s, s, -z], [s, s, z], [0, 0, z]])
    right = np.array([[0, 0, -z], [0, 0, z], [s, -s, z], [s, -s, -z]])
    return _one(material, polygon(left), polygon(right))


def trihedral(size: float = 0.1, square: bool = False, material: str = "pec") -> Mesh:
    """Return three sheets that meet at right angles in the origin and open to +x, inner edges of `size` [m].

    Faces are triangles, or squares; one edge lies in the plane y = 0 above the others; boresight +x.
    """
    # Columns: the three inner edges, each at equal angle to +x.
    axis, tilt = 1.0 / np.sqrt(3.0), np.sqrt(2.0 / 3.0)
    turn = np.radians([90.0, 210.0, 330.0])
    edges = size * np.stack([np.full(3, axis), tilt * np.cos(turn), tilt * np.sin(turn)], axis=1)
    apex = np.zeros(3)
    faces = []
    for i in range(3):
        a, b = edges[i], edges[(i + 1) % 3]
        faces.append(polygon(np.array([apex, a, a + b, b] if square else [apex, a, b])))
    return _one(material, *faces)


def ground(size: float = 400.0, material: str = "asphalt") -> Mesh:
    """Return a level square sheet facing up, `size` [m] across, centred on the origin; bodies stand on its z = 0."""
    s = size / 2.0
    return _one(material, polygon(np.array([[-s, -s, 0], [s, -s, 0], [s, s, 0], [-s, s, 0]])))
