"""Estimated normals and folds against slow, obvious forms of the same."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from raychan.geometry.fold_shapes import bends, edge_lengths, outward
from raychan.geometry.normal_fits import corrected
from raychan.geometry.triangles import planes_of
from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes.creases import _smooth_folds

PIVOT, FITTED, ENOUGH = 1e-4, 0.3, 9


def bodies():
    """Return meshes of smooth bodies, whose facets are even and uneven."""
    rng = np.random.default_rng(3)
    hull = trimesh.convex.convex_hull(rng.normal(size=(400, 3)) * [1.0, 2.0, 0.7])
    torus = trimesh.creation.torus(1.0, 0.4, major_sections=24, minor_sections=17)
    waves = trimesh.creation.icosphere(subdivisions=3)
    waves.vertices *= 1.0 + 0.05 * np.sin(5.0 * waves.vertices[:, :1])
    return [hull, torus, waves]


def slow_normal(place, first, g, near, power):
    """Return the corrected normal of vertex g by numpy's least squares."""
    n = first[g]
    u = np.cross(n, [1.0, 0.0, 0.0] if abs(n[0]) < 0.7 else [0.0, 1.0, 0.0])
    u /= np.linalg.norm(u)
    w = np.cross(n, u)
    d = place[near] - place[g]
    # The axis along which the neighbours extend farthest.
    _, axes = np.linalg.eigh(np.array([d @ u, d @ w]) @ np.array([d @ u, d @ w]).T)
    u, w = axes[:, 1] @ np.array([u, w]), np.cross(n, axes[:, 1] @ np.array([u, w]))
    x, y, z = d @ u, d @ w, d @ n
    sx, sy, sz = (np.sqrt(np.mean(c * c)) for c in (x, y, z))
    s, t = x / sx, y / sy
    terms = np.stack(
        [s, t, s * s + (z / sx) ** 2, s * t, t * t + (z / sy) ** 2, s**3, s * s * t, s * t * t, t**3], axis=1
    )
    root = (s * s + t * t) ** (-0.25 * power)
    for k in (9, 5):
        if len(near) < ENOUGH:
            break
        fit, _, rank, _ = np.linalg.lstsq(terms[:, :k] * root[:, None], z * root, rcond=None)
        rest = root * (z - terms[:, :k] @ fit)
        if rank == k and rest @ rest < FITTED**2 * ((root * z) @ (root * z)):
            slope = fit[0] / sx, fit[1] / sy
            if np.hypot(*slope) < sz / np.hypot(sx, sy):
                n = n - slope[0] * u - slope[1] * w
            break
    return n / np.linalg.norm(n)


@pytest.mark.parametrize("power", [0.0, 4.0])
@pytest.mark.parametrize("which", range(3))
def test_normals_are_corrected_as_by_least_squares(which, power):
    body = bodies()[which]
    place, rng = np.asarray(body.vertices), np.random.default_rng(4)
    first = body.vertex_normals + 0.05 * rng.normal(size=place.shape)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    ring = [set(near) for near in body.vertex_neighbors]
    near = [sorted(set().union(*(ring[j] for j in own), own) - {g}) for g, own in enumerate(ring)]
    start = np.append(0, np.cumsum([len(some) for some in near])).astype(np.int32)
    other = np.concatenate(near).astype(np.int32)
    rows, out = np.arange(0, len(place), 3), first.copy()
    corrected(place, first, rows, (start, other), power, (PIVOT, FITTED, ENOUGH), out)
    slow = np.array([slow_normal(place, first, g, near[g], power) for g in rows])
    off = np.abs(out[rows] - slow).max(axis=1)
    # Where a pivot is near its bound, or the plausible turn is, one of both may keep what the other corrects.
    assert np.mean(off < 1e-8) > 0.97 and np.abs(out[rows] - first[rows]).max() > 0.01
    assert np.array_equal(out[1::3], first[1::3])


@pytest.mark.parametrize("which", range(3))
def test_facets_bend_as_the_eigenvalues_of_their_tensors(which):
    mesh = from_trimesh(bodies()[which])
    pair, fold = _smooth_folds(mesh)
    normal, v = planes_of(mesh.corners)[0], mesh.corners
    tensor = np.zeros((len(mesh.faces), 3, 3))
    for (a, b), angle in zip(pair, fold, strict=True):
        span = v[a // 3, (a % 3 + 1) % 3] - v[a // 3, a % 3]
        length = np.linalg.norm(span)
        for f in (a // 3, b // 3):
            across = np.cross(span / length, normal[f])
            tensor[f] += angle * length * np.outer(across, across)
    most, least = bends(mesh.vertices, mesh.faces, normal, pair, fold)
    true = np.linalg.eigvalsh(tensor)
    assert np.allclose(most, true[:, 2], rtol=1e-9, atol=1e-12) and np.allclose(least, true[:, 1], rtol=1e-6, atol=1e-9)


def test_folds_of_a_convex_body_are_outward_and_of_its_inside_inward():
    hull = from_trimesh(bodies()[0])
    pair = hull.topology.pair
    normal = planes_of(hull.corners)[0]
    assert (outward(hull.vertices, hull.faces, normal, pair) == 1.0).all()
    assert (outward(hull.vertices, hull.faces, -normal, pair) == -1.0).all()
    ends = hull.vertices[hull.faces][pair[:, 0] // 3]
    k = pair[:, 0] % 3
    rows = np.arange(len(k))
    long = np.linalg.norm(ends[rows, (k + 1) % 3] - ends[rows, k], axis=1)
    assert np.allclose(edge_lengths(hull.vertices, hull.faces, pair), long, rtol=1e-12)
