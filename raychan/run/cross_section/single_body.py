"""A body by itself: its mesh from a file or object, and its facets at the origin of its own frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from raychan.records import Facets
from raychan.world.material import Material, resolve
from raychan.world.mesh_files.mesh_io import from_trimesh, load
from raychan.world.meshes.mesh import CREASE_DEG, Mesh, creased


def facets_of(mesh: Any, material: str | Material, frequency: float) -> Facets:
    """Return the facets of one body at the origin of its own frame."""
    body = mesh_of(mesh)
    n = len(body.faces)
    return Facets(
        vertices=body.corners,
        normals=body.normals,
        body=np.zeros(n, np.int32),
        part=body.part,
        material=np.zeros(n, np.int32),
        role=np.zeros(1, np.int8),
        origin=np.zeros((1, 3)),
        velocity=np.zeros((1, 3)),
        spin=np.zeros((1, 3)),
        materials=resolve([material], frequency),
        body_names=("target",),
        part_names=body.part_names,
    )


def mesh_of(mesh: Any, crease_deg: float | None = None) -> Mesh:
    """Return the mesh of a file or a trimesh, or a Mesh with its normals estimated by crease_deg [deg], if given."""
    crease = CREASE_DEG if crease_deg is None else crease_deg
    if isinstance(mesh, Mesh):
        return mesh if crease_deg is None else creased(mesh, crease)
    return load(mesh, crease_deg=crease) if isinstance(mesh, str | Path) else from_trimesh(mesh, crease)
