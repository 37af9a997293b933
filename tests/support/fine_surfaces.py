"""Finely tessellated smooth surfaces with exact normals, and how far points are off them."""

from __future__ import annotations

import numpy as np
import trimesh

from raychan.world.meshes.mesh import make_mesh


def _grid(points, normals, shape, **options):
    """Return the mesh of points (m n, 3) on a torus of rows and columns, with their normals."""
    m, n = shape
    row, column = (x.ravel() for x in np.meshgrid(np.arange(m), np.arange(n), indexing="ij"))

    def at(i, j):
        return i % m * n + j % n

    one = np.stack([at(row, column), at(row + 1, column), at(row + 1, column + 1)], axis=1)
    other = np.stack([at(row, column), at(row + 1, column + 1), at(row, column + 1)], axis=1)
    faces = np.concatenate([one, other])
    return make_mesh(points, faces, normals=None if normals is None else normals[faces], **options)


def ball(subdivisions=5, radius=0.5, known=True, part=None, **options):
    """Return a sphere, an icosahedron subdivided, 20,480 facets by default; parts by a function of facets' centres."""
    raw = trimesh.creation.icosphere(subdivisions=subdivisions)
    unit = raw.vertices / np.linalg.norm(raw.vertices, axis=1, keepdims=True)
    kinds = None if part is None else part(unit[raw.faces].mean(axis=1))
    normals = unit[raw.faces] if known else None
    return make_mesh(radius * unit, raw.faces, kinds, normals=normals, **options)


def ellipsoid(axes=(0.8, 0.4, 0.25), subdivisions=5, known=True):
    """Return an ellipsoid of 20,480 facets by default."""
    raw = trimesh.creation.icosphere(subdivisions=subdivisions)
    unit = raw.vertices / np.linalg.norm(raw.vertices, axis=1, keepdims=True)
    normal = unit / np.asarray(axes)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return make_mesh(unit * axes, raw.faces, normals=normal[raw.faces] if known else None)


def torus(wide=0.5, thin=0.15, shape=(240, 120), known=True):
    """Return a torus about z; 57,600 facets by default."""
    u, w = (x.ravel() for x in np.meshgrid(*(2.0 * np.pi * np.arange(n) / n for n in shape), indexing="ij"))
    normal = np.stack([np.cos(w) * np.cos(u), np.cos(w) * np.sin(u), np.sin(w)], axis=1)
    ring = wide * np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=1)
    return _grid(ring + thin * normal, normal if known else None, shape)


def off_ball(points, radius=0.5):
    """Return how far points (n, 3) lie off a sphere [m]."""
    return np.abs(np.linalg.norm(points, axis=1) - radius)


def off_torus(points, wide=0.5, thin=0.15):
    """Return how far points (n, 3) lie off a torus [m]."""
    return np.abs(np.hypot(np.linalg.norm(points[:, :2], axis=1) - wide, points[:, 2]) - thin)


def on_patches(mesh, per_facet, rng):
    """Return random points (n, 3) on the curved facets of a mesh, by Nagata's formula written out."""
    from raychan.geometry.triangles import edge_curvatures

    v = mesh.corners
    bend, _ = edge_curvatures(v, mesh.normals)
    x, y, z = np.moveaxis(rng.dirichlet(np.ones(3), (len(v), per_facet)), 2, 0)[..., None]
    flat = x * v[:, None, 0] + y * v[:, None, 1] + z * v[:, None, 2]
    return (flat - x * y * bend[:, None, 0] - y * z * bend[:, None, 1] - z * x * bend[:, None, 2]).reshape(-1, 3)


def half_ball():
    """Return the upper half of a sphere with a flat lid below, whose rim is a crease."""
    whole = ball(6)
    top = whole.faces[(whole.vertices[whole.faces][:, :, 2] > -1e-9).all(axis=1)]
    raw = trimesh.Trimesh(whole.vertices, top, process=False)
    rim = raw.edges[trimesh.grouping.group_rows(raw.edges_sorted, require_count=1)]
    v = np.append(whole.vertices, [[0.0, 0.0, 0.0]], axis=0)
    faces = np.concatenate([top, np.stack([rim[:, 1], rim[:, 0], np.full(len(rim), len(v) - 1)], axis=1)])
    return make_mesh(v, faces)
