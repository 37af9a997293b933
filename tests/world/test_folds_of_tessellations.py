"""Folds above the crease angle that look like a tessellation's are told, and in the stated error."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from truth import po, shapes

from raychan.run.rcs import rcs
from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes.creases import alternatives, uncertain_folds
from raychan.world.meshes.mesh import make_mesh

make = trimesh.creation


def prism(outline, height=0.3):
    """Return a bar over an outline (n, 2) [m] that its middle sees all of."""
    p, n = np.asarray(outline, float), len(outline)
    rings = [np.column_stack([p, np.full(n, z)]) for z in (0.0, height)]
    middles = [[*p.mean(axis=0), z] for z in (0.0, height)]
    k = np.arange(n)
    j = (k + 1) % n
    faces = [[k, j, n + j], [k, n + j, n + k], [2 * n + 0 * k, j, k], [2 * n + 1 + 0 * k, n + k, n + j]]
    return trimesh.Trimesh(np.concatenate([*rings, middles]), np.concatenate([np.stack(f, axis=1) for f in faces]))


def sheet(height, n=40):
    """Return a square sheet of n by n quadrilaterals over heights (n + 1, n + 1) [m]."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, n + 1)], indexing="ij")
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + n + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + 1], 1)])
    z = np.broadcast_to(height(x, y), x.shape)
    return trimesh.Trimesh(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces, process=False)


def lens(n=60, rings=20, tilt_deg=13.0):
    """Two caps of spheres that meet in a ridge of twice the tilt."""
    rise = np.radians(tilt_deg) * (1.0 - np.arange(rings) / rings)
    u = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    up = np.concatenate(
        [np.column_stack([np.sin(t) * np.cos(u), np.sin(t) * np.sin(u), np.cos(t) + 0 * u]) for t in rise]
    )
    up = np.concatenate([up, [[0.0, 0.0, 1.0]]]) - [0.0, 0.0, np.cos(rise[0])]
    k = np.arange(n)
    j = (k + 1) % n
    faces = [np.stack([(rings - 1) * n + k, (rings - 1) * n + j, rings * n + 0 * k], 1)]
    for i in range(rings - 1):
        a, b = i * n, (i + 1) * n
        faces += [np.stack([a + k, a + j, b + j], 1), np.stack([a + k, b + j, b + k], 1)]
    f = np.concatenate(faces)
    return trimesh.Trimesh(np.concatenate([up, up * [1.0, 1.0, -1.0]]), np.concatenate([f, f[:, ::-1] + len(up)]))


def half(mesh):
    """Return the wall of a cylinder on one side, wound the other way round: a trough."""
    kept = (np.abs(mesh.face_normals[:, 2]) < 0.5) & (mesh.triangles_center[:, 0] > 0.01)
    return trimesh.Trimesh(mesh.vertices, mesh.faces[kept][:, ::-1])


def random_hull(n):
    rng = np.random.default_rng(n)
    return shapes.hull(rng, rng.normal(size=(n, 3)))


ROUND = {
    "nine sections": (make.cylinder(0.1, 0.3, sections=9), 9),
    "seventeen sections": (make.cylinder(0.1, 0.3, sections=17), 17),
    "cone": (make.cone(0.1, 0.3, sections=12), 12),
    "trough": (half(make.cylinder(0.1, 0.3, sections=17)), 7),
    "globe": (make.uv_sphere(0.1, count=[10, 20]), 160),
    "coarse globe": (make.uv_sphere(0.1, count=[5, 5]), 84),
    "ball": (make.icosphere(1), 60),
    "torus": (make.torus(0.3, 0.1, major_sections=40, minor_sections=15), 600),
    "tips of a long ellipsoid": (make.uv_sphere(1.0, count=[32, 48]).apply_scale([0.05, 0.08, 1.0]), 192),
    "half round": (prism([(np.cos(t), np.sin(t)) for t in np.radians(np.arange(0.0, 181.0, 22.5))]), 7),
}
TRUE_EDGES = {
    "box": make.box(),
    "box of many facets": make.box().subdivide().subdivide(),
    "plate": trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]),
    "roof of many facets": sheet(lambda x, y: -np.abs(x) * np.tan(np.radians(15.0))),
    "roof of bent sides": sheet(lambda x, y: -np.abs(x) * np.tan(np.radians(15.0)) - 0.05 * (x**2 + y**2)),
    "corrugated sheet": sheet(lambda x, y: 0.05 * np.tan(np.radians(13.0)) * (np.rint(20.0 * (x + 1.0)) % 2)),
    "lens": lens(),
    "chamfered bar": prism([(2, 1), (1, 2), (-1, 2), (-2, 1), (-2, -1), (-1, -2), (1, -2), (2, -1)]),
    "car's outline": prism(
        [(0, 0), (4, 0), (4, 0.7), (3.9, 0.9), (3.2, 1), (2.6, 1.4), (1.2, 1.45), (0.5, 1), (0, 0.9)]
    ),
    **{f"prism of {n}": make.cylinder(0.1, 0.3, sections=n) for n in range(3, 9)},
    **{f"hull {n}": random_hull(n) for n in (12, 40, 160)},
}  # fmt: skip


@pytest.mark.parametrize("name", ROUND)
def test_equal_folds_that_go_on_may_be_a_curve(name):
    mesh, count = ROUND[name]
    assert f"{count} folds of" in uncertain_folds(from_trimesh(mesh), "--crease")
    assert "may be a curved surface: --crease decides" in uncertain_folds(from_trimesh(mesh), "--crease")
    assert alternatives(from_trimesh(mesh)).rounded is not None
    # Whoever says what the folds are is not asked.
    for deg in (0.0, 60.0):
        assert alternatives(from_trimesh(mesh, crease_deg=deg)).rounded is None


@pytest.mark.parametrize("name", TRUE_EDGES)
def test_edges_stay_edges(name):
    assert alternatives(from_trimesh(TRUE_EDGES[name])).rounded is None
    assert "curved" not in uncertain_folds(from_trimesh(TRUE_EDGES[name]), "")


def test_turning_and_scaling_and_the_order_of_facets_change_nothing():
    rng = np.random.default_rng(4)
    for mesh, count in (ROUND["globe"], ROUND["seventeen sections"], ROUND["torus"]):
        other = mesh.copy()
        other.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
        other.apply_scale(7.3)
        faces = other.faces[rng.permutation(len(other.faces))]
        turned = make_mesh(other.vertices, np.array([np.roll(f, rng.integers(3)) for f in faces]))
        assert f"{count} folds of" in uncertain_folds(turned, "")


@pytest.mark.parametrize("sides", [10, 17])
def test_a_coarse_cylinder_lies_within_the_stated_error_of_both_readings(sides):
    """The flat reading is what is computed, exactly; round is Kirchhoff's integral over the cylinder."""
    radius, height, el = 0.08, 0.15, 1.5
    mesh, az = make.cylinder(radius, height, sections=sides), np.linspace(0.0, 360.0 / sides, 5)
    looks = [po.direction(np.radians(a), np.radians(el)) for a in az]
    flat = [shapes.flat(mesh, look) for look in looks]
    round_ = [shapes.sigma(po.cylinder(radius, height, shapes.K, (look, np.inf))) for look in looks]
    got = rcs(mesh, shapes.F, az, el)
    known = got.converged
    assert known.any()
    for true in (flat, round_):
        assert (np.abs(10.0 * np.log10(got.sigma / true)) <= got.error_db)[known].all()
    assert (rcs(mesh, shapes.F, az, el, crease_deg=5.0).error_db < 0.1).all()


@pytest.mark.parametrize("mesh", [make.uv_sphere(0.12, count=[9, 30]), make.icosphere(1, 0.12)], ids=["globe", "ball"])
def test_a_coarse_ball_lies_within_the_stated_error(mesh):
    """Test against sigma = pi r^2; where the reading decides all, no figure is stated."""
    got = rcs(mesh, shapes.F, np.linspace(3.0, 80.0, 6), 10.0)
    error = np.abs(10.0 * np.log10(got.sigma / (np.pi * 0.12**2)))
    assert (error <= got.error_db)[got.converged].all()
    assert (~got.converged | (got.error_db > 1.0)).all()


@pytest.mark.parametrize("sides", [9, 12, 16])
def test_a_coarse_cylinder_seen_end_on_lies_within_the_stated_error_of_both_readings(sides):
    """Its rim may be round: the lid is then a disc, of sigma 4 pi (pi r^2 / lambda)^2; flat, a polygon."""
    r, wavelength = 0.08, 2.0 * np.pi / shapes.K
    got = rcs(make.cylinder(r, 0.15, sections=sides), shapes.F, 0.0, 90.0)
    for area in (np.pi * r**2, 0.5 * sides * r**2 * np.sin(2.0 * np.pi / sides)):
        true = 4.0 * np.pi * (area / wavelength) ** 2
        assert abs(10.0 * np.log10(float(got.sigma) / true)) <= got.error_db
    assert got.error_db < 1.0
    assert rcs(make.cylinder(r, 0.15, sections=8), shapes.F, 0.0, 90.0).error_db < 0.01, "an octagonal bar has edges"


def test_the_tips_of_a_long_ellipsoid_lie_within_the_stated_error():
    """Its mesh turns by 100 deg within two rings of each tip: the answer is up to 14 dB off physical optics."""
    axes = np.array([0.05, 0.08, 1.0])
    mesh = ROUND["tips of a long ellipsoid"][0]
    for az in (10.0, 80.0):
        el = np.array([40.0, 60.0, 80.0, 85.0])
        got = rcs(mesh, shapes.F, az, el)
        looks = (po.direction(np.radians(az), np.radians(e)) for e in el)
        error = np.abs(10.0 * np.log10(got.sigma / [4.0 * np.pi * abs(shapes.ellipsoid(axes, d)) ** 2 for d in looks]))
        assert (error <= got.error_db)[got.converged].all(), np.column_stack([error, got.error_db])


def test_a_cylinder_of_24_sections_seen_from_above_lies_within_the_stated_error():
    """Away from broadside its rims return, as circles: taken as 24-gons they are up to 7 dB off."""
    mesh, az, el = make.cylinder(0.05, 0.2, sections=24), np.array([77.0, 10.0, 10.0]), np.array([40.0, 70.0, 85.0])
    got = rcs(mesh, shapes.F, az, el)
    looks = [po.direction(np.radians(a), np.radians(e)) for a, e in zip(az, el, strict=True)]
    true = [shapes.sigma(po.cylinder(0.05, 0.2, shapes.K, (look, np.inf))) for look in looks]
    error = np.abs(10.0 * np.log10(got.sigma / true))
    assert (error <= got.error_db).all() and error.max() > 6.0
