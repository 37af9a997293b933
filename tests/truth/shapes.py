"""Random meshes whose true RCS is known, smooth and flat: `python -m truth.shapes SEED COUNT` (from tests/) prints how
the stated error of `raychan.rcs` covers the true one. The factors of `channel/mesh_error.py` were chosen on seed 1."""

from __future__ import annotations

import sys

import numpy as np
import trimesh

from raychan.run.rcs import rcs
from raychan.world.meshes.mesh import make_mesh
from truth import po

F = 77e9
K = 2.0 * np.pi * F / 299792458.0


def ellipsoid(axes, look):
    """S [m] of an ellipsoid by physical optics: the lit half projects on an ellipse, and the depth of the point at
    the share rho of its radius is h sqrt(1 - rho^2), so that one integral over u = sqrt(1 - rho^2) is left."""
    h = np.linalg.norm(axes * look)
    w = 2.0 * K * h
    whole = 2.0 * (np.exp(1j * w) * (1.0 / (1j * w) + 1.0 / w**2) - 1.0 / w**2)
    return -1j * K / (2.0 * np.pi) * np.pi * np.prod(axes) / h * whole


def grid(points):
    """Faces of a grid (m, n) of points that closes along its second axis, with a pole before and after."""
    m, n = points
    i, j = (x.ravel() for x in np.meshgrid(np.arange(m - 1), np.arange(n), indexing="ij"))
    a, b = i * n + j, i * n + (j + 1) % n
    ring, south, north = np.arange(n), m * n, m * n + 1
    caps = [
        [south + 0 * ring, (ring + 1) % n, ring],
        [north + 0 * ring, (m - 1) * n + ring, (m - 1) * n + (ring + 1) % n],
    ]
    return np.concatenate([np.stack(x, axis=1) for x in ([a, b, b + n], [a, b + n, a + n], *caps)])


def superquadric(axes, e1, e2, m, n):
    """Mesh (|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) = 1 of m - 1 rings of n points (Barr 1981)."""
    v, u = np.linspace(-np.pi / 2, np.pi / 2, m + 1)[1:-1, None], np.linspace(0, 2 * np.pi, n, endpoint=False)
    c, s = np.cos(v) + 0 * u, np.sin(v) + 0 * u
    rows = np.stack([_pow(c, e1) * _pow(np.cos(u), e2), _pow(c, e1) * _pow(np.sin(u), e2), _pow(s, e1)], axis=2)
    points = np.concatenate([rows.reshape(-1, 3), [[0, 0, -1.0], [0, 0, 1.0]]])
    return make_mesh(points * axes, grid((m - 1, n)))


def fine_superquadric(axes, e1, e2, m=100, n=200):
    """Return the same surface by polar angles, which crowd its points nowhere, with its own normals."""
    v, u = np.linspace(-np.pi / 2, np.pi / 2, m + 1)[1:-1, None], np.linspace(0, 2 * np.pi, n, endpoint=False)

    def round_(angle, e):
        return (np.abs(np.cos(angle)) ** (2 / e) + np.abs(np.sin(angle)) ** (2 / e)) ** (-e / 2)

    c, s = round_(v, e1) * np.cos(v), round_(v, e1) * np.sin(v) + 0 * u
    rows = np.stack([c * round_(u, e2) * np.cos(u), c * round_(u, e2) * np.sin(u), s], axis=2)
    p, faces = np.concatenate([rows.reshape(-1, 3), [[0, 0, -1.0], [0, 0, 1.0]]]), grid((m - 1, n))
    flat_ = np.maximum(np.sum(np.abs(p[:, :2]) ** (2 / e2), axis=1), 1e-300) ** (e2 / e1 - 1)
    normals = np.column_stack([flat_[:, None] * _pow(p[:, :2], 2 / e2 - 1), _pow(p[:, 2], 2 / e1 - 1)]) / axes
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return make_mesh(p * axes, faces, normals=normals[faces])


def _pow(x, p):
    return np.sign(x) * np.abs(x) ** p


def hull(rng, points):
    """Convex hull of points, turned at random."""
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    return trimesh.convex.convex_hull(points @ turn.T)


def flat(mesh, look):
    """Sigma [m^2] of a convex polyhedron, each facet flat."""
    s = sum(po.polygon_far(t, K, look)[0, 0] for t in np.asarray(mesh.triangles))
    return 4.0 * np.pi * abs(s) ** 2


BEND_ONE_WAY = ("cylinder", "prism")  # kinds of bodies that may be meant as round or as flat


def case(rng, i):
    """Name, mesh, azimuth, elevation [deg] and true sigma [m^2] of one of eight kinds of bodies, the first four smooth
    but for their rims, the others flat."""
    az, el = rng.uniform(-180.0, 180.0), np.degrees(np.arcsin(rng.uniform(-0.9, 0.9)))
    look = po.direction(np.radians(az), np.radians(el))
    axes = rng.uniform(0.05, 0.3, 3)
    kind = ("ico ellipsoid", "grid ellipsoid", "superquadric", "cylinder", "hull", "ball hull", "sphere hull", "prism")[
        i % 8
    ]
    if kind == "ico ellipsoid":
        mesh = trimesh.creation.icosphere(subdivisions=int(rng.integers(3, 6))).apply_scale(axes)
        return kind, mesh, az, el, 4 * np.pi * abs(ellipsoid(axes, look)) ** 2
    if kind == "grid ellipsoid":
        mesh = superquadric(axes, 1.0, 1.0, int(rng.integers(24, 64)), int(rng.integers(32, 128)))
        return kind, mesh, az, el, 4 * np.pi * abs(ellipsoid(axes, look)) ** 2
    if kind == "superquadric":
        e = rng.uniform(0.7, 1.0, 2)
        mesh = superquadric(axes, *e, int(rng.integers(24, 64)), int(rng.integers(32, 128)))
        return kind, mesh, az, el, rcs(fine_superquadric(axes, *e), F, az, el, tolerance_db=0.05).sigma
    if kind in ("cylinder", "prism"):
        r, h, n, el = (
            rng.uniform(0.03, 0.1),
            rng.uniform(0.05, 0.2),
            int(rng.integers(*((19, 36) if kind == "prism" else (24, 100)))),
            rng.uniform(-3, 3),
        )
        mesh = trimesh.creation.cylinder(r, h, sections=n)
        end = po.direction(np.radians(az), np.radians(el))
        true = flat(mesh, end) if kind == "prism" else sigma(po.cylinder(r, h, K, (end, np.inf)))
        return kind, mesh, az, el, true
    p = rng.normal(size=(int(10 ** rng.uniform(1.3, 3.3)), 3))
    p *= {"hull": 0.1, "ball hull": 0.2, "sphere hull": 0.2}[kind]
    if kind != "hull":
        p /= np.linalg.norm(p, axis=1, keepdims=True) / 0.2
    if kind == "ball hull":
        p *= rng.random((len(p), 1)) ** (1 / 3)
    mesh = hull(rng, p * axes / axes.max())
    return kind, mesh, az, el, flat(mesh, look)


def sigma(s):
    """Return the radar cross section [m^2] of a scattering matrix, VV."""
    return 4.0 * np.pi * abs(s[0, 0]) ** 2


def judged(seed, count):
    """Names (n,), true and stated errors (n,) [dB] of `count` random cases."""
    rng = np.random.default_rng(seed)
    names, rows = [], []
    for i in range(count):
        name, mesh, az, el, true = case(rng, i)
        got = rcs(mesh, F, az, el)
        names.append(name)
        rows.append((abs(10.0 * np.log10(float(got.sigma) / float(true))), float(got.error_db)))
    return np.array(names), *np.array(rows).T


if __name__ == "__main__":
    kinds, errors, stated = judged(int(sys.argv[1]), int(sys.argv[2]))
    known = np.isfinite(stated)
    for i in np.flatnonzero(known & (errors > stated)):
        print(f"{i:4d} {kinds[i]:15s} {errors[i]:8.3f} dB beyond the stated {stated[i]:.3f}")
    for kind in (*dict.fromkeys(kinds), "all"):
        rows = known & ((kinds == kind) | (kind == "all"))
        e, s = errors[rows], stated[rows]
        print(
            f"{kind:15s} {rows.sum():4d} known, covered {np.mean(e <= s):6.1%}, stated / true median "
            f"{np.median(s / e):6.2f}, true median {np.median(e):.3f} dB, worst {e.max():.2f} dB"
        )
