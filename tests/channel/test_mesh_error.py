"""What a mesh leaves open and physical optics cannot know is in the stated error, on shapes whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.special import h2vp, hankel2, jv, jvp
from truth import mie, shapes

from raychan.channel.mesh_error import creeping
from raychan.run.cross_section.single_body import facets_of, mesh_of
from raychan.run.rcs import rcs
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes.creases import alternatives
from raychan.world.meshes.mesh import make_mesh

F = 77e9
K = 2.0 * np.pi * F / C0


def db(x):
    return 10.0 * np.log10(x)


@pytest.mark.parametrize(("subdivisions", "most_deg"), [(3, 0.1), (4, 0.03), (5, 0.005)])
@pytest.mark.parametrize("axes", [(0.2, 0.2, 0.2), (0.3, 0.2, 0.12)])
def test_estimated_normals_of_an_ellipsoid_are_its_gradient(axes, subdivisions, most_deg):
    mesh = from_trimesh(trimesh.creation.icosphere(subdivisions).apply_scale(axes))
    true = mesh.corners / np.square(axes)
    true /= np.linalg.norm(true, axis=2, keepdims=True)
    assert np.degrees(np.linalg.norm(mesh.normals - true, axis=2)).max() < most_deg


def test_an_ellipsoid_of_many_facets_is_its_closed_form():
    """Physical optics of an ellipsoid, terminator and all; the first estimate of normals was 0.2 dB off."""
    axes, rng = np.array([0.3, 0.2, 0.12]), np.random.default_rng(5)
    mesh = trimesh.creation.icosphere(5).apply_scale(axes)
    az, el = rng.uniform(-180.0, 180.0, 6), rng.uniform(-60.0, 60.0, 6)
    got = rcs(mesh, F, az, el)
    looks = (shapes.po.direction(np.radians(a), np.radians(e)) for a, e in zip(az, el, strict=True))
    error = np.abs(db(got.sigma / [4 * np.pi * abs(shapes.ellipsoid(axes, d)) ** 2 for d in looks]))
    assert error.max() < 0.05
    assert (error <= got.error_db).mean() > 0.8


def test_the_stated_error_covers_smooth_and_flat_bodies_not_looked_at_before():
    """Seed 31; factors were chosen on seed 1. An error that is not known covers nothing and is left out."""
    kind, e, s = shapes.judged(31, 48)  # the median of 24 scatters by a third from seed to seed
    known = np.isfinite(s)
    assert known.mean() > 0.8
    assert np.mean(e[known] <= s[known]) >= 0.95
    # Of what bends one way both readings are stated, far more than the truth of one is off.
    one = known & ~np.isin(kind, shapes.BEND_ONE_WAY)
    assert np.median(s[one] / e[one]) < 5.0


@pytest.mark.parametrize(("build", "sides"), [("cylinder", 37), ("cylinder", 61), ("cone", 45)])
def test_of_bodies_that_bend_one_way_both_readings_are_stated(build, sides):
    """A prism of many sides may be meant as flat; a ball of as small folds, and the prism once told apart, are not."""
    mesh = getattr(trimesh.creation, build)(0.08, 0.15, sections=sides)
    assert alternatives(from_trimesh(mesh)).creased is not None
    az, el = np.array([10.0, 73.0, 201.0]), 17.0 if build == "cone" else 1.5
    flat = [shapes.flat(mesh, shapes.po.direction(np.radians(a), np.radians(el))) for a in az]
    got = rcs(mesh, F, az, el)
    known = got.converged
    assert (np.abs(db(got.sigma / flat)) <= got.error_db)[known].all() and known.any()
    assert alternatives(from_trimesh(mesh, crease_deg=1.0)).creased is None
    assert alternatives(from_trimesh(trimesh.creation.icosphere(3))).creased is None


def test_folds_are_in_no_doubt_where_the_caller_tells_edges():
    """By a crease angle below its folds a tube of 37 sides is the prism, by one above them the cylinder; of a cone the
    error is no larger than that of the guess."""
    cone = trimesh.creation.cone(0.1, 0.3, sections=36)
    every = [rcs(cone, 10e9, 0.0, 18.4349, crease_deg=c).error_db for c in (None, 19.0, 5.0)]
    assert every[0] >= every[1] > every[2]
    mesh = trimesh.creation.cylinder(0.08, 0.15, sections=37)
    guessed, told, flat = (rcs(mesh, F, 11.0, tolerance_db=0.1, crease_deg=c) for c in (None, 20.0, 5.0))
    assert guessed.sigma == told.sigma and guessed.numerical_db == told.numerical_db < told.error_db
    # Broadside of a cylinder: Knott, Shaeffer, Tuley, 2004, table 6.1.
    assert abs(db(told.sigma / (K * 0.08 * 0.15**2))) <= told.error_db < 0.5
    prism = shapes.flat(mesh, shapes.po.direction(np.radians(11.0), 0.0))
    assert abs(db(flat.sigma / prism)) <= flat.error_db < 0.1
    assert abs(db(told.sigma / prism)) > 0.5 and guessed.error_db > abs(db(told.sigma / prism))


@pytest.mark.parametrize("seed", [1, 2])
def test_of_irregular_facets_told_to_be_smooth_the_error_is_stated(seed):
    """Convex hulls of points on a sphere, folds of up to 35 degrees: pi r^2, but for what a wave creeps around."""
    rng, r = np.random.default_rng(seed), 0.08
    for count in (150, 500):
        p = rng.normal(size=(count, 3))
        hull = trimesh.convex.convex_hull(r * p / np.linalg.norm(p, axis=1, keepdims=True))
        crease = np.degrees(hull.face_adjacency_angles).max() + 1.0
        got = rcs(hull, 77e9, np.arange(0.0, 360.0, 60.0), 20.0, crease_deg=crease)
        known = got.converged
        assert (np.abs(db(got.sigma / (np.pi * r**2))) <= got.error_db)[known].all() and known.any()


def _saddle(count):
    """Return a sheet x = 2.5 (y^2 - z^2), 0.2 m wide, of a regular grid, and the same with its own normals."""
    y, z = np.meshgrid(*[np.linspace(-0.1, 0.1, count + 1)] * 2, indexing="ij")
    v = np.stack([2.5 * (y**2 - z**2), y, z], axis=-1).reshape(-1, 3)
    a = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    f = np.concatenate([np.stack([a, a + count + 1, a + 1], 1), np.stack([a + count + 1, a + count + 2, a + 1], 1)])
    n = np.stack([np.ones(len(v)), -5.0 * v[:, 1], 5.0 * v[:, 2]], axis=1)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return trimesh.Trimesh(v, f, process=False), make_mesh(v, f, normals=n[f])


def test_normals_along_the_border_of_an_open_sheet_are_its_gradient():
    """Facets turn by 1.4 to 2 degrees; at the sheet's four corners, where neighbours are few, normals are off more."""
    mesh = from_trimesh(_saddle(40)[0])
    y, z = mesh.corners[..., 1], mesh.corners[..., 2]
    true = np.stack([np.ones_like(y), -5.0 * y, 5.0 * z], axis=-1)
    true /= np.linalg.norm(true, axis=2, keepdims=True)
    off = np.degrees(np.arccos(np.minimum(np.abs((mesh.normals * true).sum(axis=2)), 1.0)))
    corner = (np.abs(y) > 0.094) & (np.abs(z) > 0.094)
    assert off[~corner].max() < 0.02


def test_a_double_bounce_of_an_open_sheet_by_its_facets_is_that_by_its_normals():
    guessed, known = (rcs(mesh, 10e9, 45.0, 5.0) for mesh in _saddle(40))
    assert abs(db(guessed.sigma / known.sigma)) <= guessed.error_db + known.error_db < 0.5
    assert known.bounces == 2


def test_a_mesh_that_knows_its_normals_is_in_no_doubt():
    ball = trimesh.creation.icosphere(2, 0.1)
    mesh = make_mesh(ball.vertices, ball.faces, normals=np.asarray(ball.vertices)[ball.faces] / 0.1)
    found = alternatives(mesh)
    assert found.fitted is None and found.creased is None
    assert alternatives(from_trimesh(trimesh.creation.box())).creased is None


def test_small_spheres_lie_within_the_stated_error():
    """Mie's series at ka = 1 to 50, where a wave creeps around the sphere, and little of it at ka = 300."""
    sizes = np.concatenate([np.geomspace(1.0, 50.0, 25), [300.0]])
    got = [rcs(trimesh.creation.icosphere(3, ka / K), F, 20.0, 10.0) for ka in sizes]
    error = [abs(db(float(g.sigma) / mie.rcs(ka / K, K))) for g, ka in zip(got, sizes, strict=True)]
    stated = np.array([float(g.error_db) for g in got])
    known = np.isfinite(stated)
    assert known[sizes > 2.0].all()
    assert (np.array(error)[known] <= stated[known]).all()
    assert stated[-1] < 0.1


@pytest.mark.parametrize("radius_k", [1.5, 4.0, 12.0, 40.0])
def test_thin_cylinders_lie_within_what_creeping_waves_may_change(radius_k):
    """The series of the infinite cylinder, both polarisations (Harrington 1961, sec. 5-9), and physical optics."""
    n = np.arange(int(radius_k + 6 * radius_k ** (1 / 3) + 14))
    fold = np.where(n == 0, 1.0, 2.0) * (-1.0) ** n
    node, weight = np.polynomial.legendre.leggauss(400)
    angle = 0.5 * np.pi * node
    lit = np.sum(0.5 * np.pi * weight * np.cos(angle) * np.exp(2j * radius_k * np.cos(angle)))
    optics = abs(0.5 * radius_k * lit)
    mesh = trimesh.creation.cylinder(radius_k / K, 40.0 / K, sections=64)
    share = creeping(Geometry(facets_of(mesh, "pec", F)), K)[1]
    for field in (jv(n, radius_k) / hankel2(n, radius_k), jvp(n, radius_k) / h2vp(n, radius_k)):
        assert abs(abs(np.sum(fold * field)) / optics - 1.0) < share


def test_several_bodies_in_one_mesh_have_the_creeping_waves_of_each():
    # Three unlike axes: those of a ball are any, chosen by rounding, which moves its least extent by 0.1 %.
    ball = trimesh.creation.icosphere(3, 0.01).apply_scale((1.0, 0.9, 0.8))
    others = [ball.copy().apply_translation(x) for x in ((1.5, 0.5, 0.0), (1.6, -0.6, 0.8))]
    k = 2.0 * np.pi * 5e9 / 299_792_458.0
    one, three = (
        creeping(Geometry(facets_of(mesh_of(m, 20.0), "pec", 5e9)), k)
        for m in (ball, trimesh.util.concatenate([ball, *others]))
    )
    assert three[1] == pytest.approx(one[1], rel=1e-3) and three[0] == pytest.approx(np.sqrt(3.0) * one[0], rel=1e-3)
