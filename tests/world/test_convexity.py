"""Bodies that are convex but for what single precision makes of their corners, and such that are not."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes.simplify import _convex, _net


def rounded(body):
    """Return a body as a binary STL has it."""
    out = body.copy()
    out.vertices = body.vertices.astype(np.float32).astype(float)
    return out


def strips(depth, half=0.5, count=1000):
    """Return a block of 1 m whose top is a trough of that depth and half width [m], in so many strips."""
    y = np.linspace(-half, half, count + 1)
    top = np.stack([y, 1.0 - depth * (1.0 - (y / half) ** 2)], axis=1)
    top = top if half == 0.5 else np.concatenate([[[-0.5, 1.0]], top, [[0.5, 1.0]]])
    n = len(top)
    outline = np.concatenate([top, [[0.5, 0.0], [-0.5, 0.0]]])
    v = np.concatenate([np.insert(outline, 0, x, axis=1) for x in (-0.5, 0.5)])
    m = len(outline)
    i = np.arange(m)
    j = (i + 1) % m
    side = np.concatenate([np.stack([i, j, j + m], 1), np.stack([i, j + m, i + m], 1)])
    k = np.arange(n - 1)
    # The trough's ends: each strip down to the middle of the bottom edge, and the corners.
    cap = np.concatenate([np.stack([np.full(n - 1, n), k, k + 1], 1), [[n, n + 1, 0]]])
    return trimesh.Trimesh(v, np.concatenate([side, cap, cap[:, ::-1] + m]), process=False)


@pytest.mark.parametrize(
    "body",
    [
        trimesh.creation.capsule(height=1.0, radius=0.3, count=[24, 24]),
        trimesh.creation.cylinder(radius=0.2, height=0.8, sections=60),
        trimesh.creation.cone(radius=0.2, height=0.8, sections=40),
        trimesh.creation.icosphere(subdivisions=3),
    ],
)
def test_convex_bodies_stay_so_in_single_precision(body):
    mesh = from_trimesh(rounded(body))
    assert mesh.topology.convex and mesh.topology.pair.size
    height = _net(mesh, np.zeros(len(mesh.faces), bool))[1]
    assert _convex(mesh, height)


def test_a_capsule_of_a_file_takes_the_rays_of_the_true_one():
    """Not known to be convex, it took 25 times as many."""
    body = trimesh.creation.capsule(height=1.0, radius=0.3, count=[110, 110])
    exact, read = (rc.rcs(from_trimesh(b), 77e9, 33.0, 11.0) for b in (body, rounded(body)))
    assert int(read.rays) < 1.5 * int(exact.rays)
    assert abs(10.0 * np.log10(float(read.sigma / exact.sigma))) < float(read.error_db)


@pytest.mark.parametrize(("depth", "half", "count"), [(1e-3, 0.5, 1000), (0.05, 0.5, 1000), (2e-5, 2e-3, 20)])
def test_a_fine_trough_is_none_however_low_its_edges(depth, half, count):
    """It rises by 4e-7 m from strip to strip, less than single precision leaves of 1 m. All its corners lie on the
    hull's ends, and that of 4 mm is next to nothing of the hull's volume."""
    body = strips(depth, half, count)
    assert body.is_watertight
    mesh = from_trimesh(body)
    assert not mesh.topology.convex


def test_a_groove_of_ten_micrometres_is_one():
    body = trimesh.creation.capsule(height=1.0, radius=0.3, count=[24, 24])
    body.vertices[200] *= 1.0 - 3e-5
    assert not from_trimesh(body).topology.convex
