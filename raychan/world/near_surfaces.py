"""Where another surface of a body lies near a facet: skins of a sheet, a film, a ball in its socket."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raychan.geometry.triangles import planes_of
from raychan.records import Facets
from raychan.world.material import resolve
from raychan.world.meshes.mesh import Mesh
from raychan.world.ray_caster import RayCaster

Bools = NDArray[np.bool_]

_POINTS = np.array([[1.0, 1.0, 1.0], [4.5, 4.5, 1.0], [1.0, 4.5, 4.5], [4.5, 1.0, 4.5]])  # barycentric, not normalised
_FREQUENCY = 77e9  # Hz: any does, no wave is traced


def near_surfaces(mesh: Mesh, distance: float) -> Bools:
    """Return which facets (f,) have another surface of the mesh within a distance [m] over or under them, or are it;
    tested at four points of each facet, across its plane. Over a convex body there is none."""
    n = len(mesh.faces)
    caster = RayCaster(_facets(mesh))
    normal, _ = planes_of(mesh.corners)
    share = _POINTS / _POINTS.sum(axis=1, keepdims=True)
    near, own = np.zeros(n, bool), np.arange(n, dtype=np.int32)
    for point in np.einsum("pk,fkc->pfc", share, mesh.corners):
        for way in (-normal,) if mesh.topology.convex else (normal, -normal):
            hit = caster.within(np.ascontiguousarray(point), way, own, distance)
            rows = np.flatnonzero(hit >= 0)
            apart = (mesh.faces[rows, :, None] != mesh.faces[hit[rows], None, :]).all(axis=(1, 2))
            near[rows[apart]] = True
            near[hit[rows[apart]]] = True
    return near


def _facets(mesh: Mesh) -> Facets:
    """Return the facets of a mesh in its own frame."""
    n = len(mesh.faces)
    rest = np.zeros((1, 3))
    return Facets(
        vertices=mesh.corners,
        normals=mesh.normals,
        body=np.zeros(n, np.int32),
        part=np.zeros(n, np.int32),
        material=np.zeros(n, np.int32),
        role=np.zeros(1, np.int8),
        origin=rest,
        velocity=rest,
        spin=rest,
        materials=resolve(["pec"], _FREQUENCY),
        body_names=("body",),
        part_names=("body",),
    )
