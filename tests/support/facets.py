"""Facets of meshes for tests, without a scene file."""

from __future__ import annotations

import numpy as np
import trimesh

from raychan.records import PEC, Facets, Materials


def facets(meshes, materials=None, smooth=None, role=None, velocity=None):
    """Facets of trimeshes, a body each; materials rows (kind, eps, thickness, roughness)."""
    rows = materials or [(PEC, 1.0 + 0j, 0.0, 0.0)] * len(meshes)
    tri = [np.asarray(m.triangles, float) for m in meshes]
    normals = []
    for m in meshes:
        flat = np.repeat(np.asarray(m.face_normals)[:, None], 3, axis=1)
        normals.append(np.asarray(m.vertex_normals)[m.faces] if smooth else flat)
    body = np.concatenate([np.full(len(t), i) for i, t in enumerate(tri)])
    n = len(meshes)
    return Facets(
        vertices=np.concatenate(tri),
        normals=np.concatenate(normals),
        body=body,
        part=np.zeros(len(body), int),
        material=body,
        role=np.zeros(n, int) if role is None else np.asarray(role),
        origin=np.zeros((n, 3)),
        velocity=np.zeros((n, 3)) if velocity is None else np.asarray(velocity, float),
        spin=np.zeros((n, 3)),
        materials=Materials(
            kind=[r[0] for r in rows],
            eps=np.array([r[1] for r in rows], complex),
            thickness=[float(r[2]) for r in rows],
            roughness=[float(r[3]) for r in rows],
        ),
        body_names=tuple(f"body{i}" for i in range(n)),
        part_names=("whole",),
    )


def quad(corners):
    """Mesh of one planar quadrilateral, normal by the right-hand rule."""
    return trimesh.Trimesh(np.asarray(corners, float), [[0, 1, 2], [0, 2, 3]], process=False)


def ground(size=500.0, height=0.0):
    """Large horizontal square facing up."""
    s, h = size, height
    return quad([[-s, -s, h], [s, -s, h], [s, s, h], [-s, s, h]])


def box(low, high):
    """Axis-parallel box."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    m = trimesh.creation.box(extents=high - low)
    m.apply_translation(0.5 * (low + high))
    return m


def ball(at, radius=0.5):
    """Return a sphere of 5,120 facets about a place."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    mesh.apply_translation(at)
    return mesh


def facing_facets(geometry, leg, bodies):
    """Return the facets that could be met over a leg, each judged by itself."""
    f = geometry.facets
    rows = np.flatnonzero(bodies[f.body])
    k, _ = leg.rays(f.vertices[rows])
    lit = (np.einsum("nij,nij->ni", k, f.normals[rows]) < 0.0).any(axis=1)
    return rows[lit | geometry.both_sides[rows]]
