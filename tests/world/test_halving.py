"""Halving facets along cubic edges comes nearer to the surface behind them, and stays closed."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from truth import shapes

from raychan.channel.mesh_error import mesh_error
from raychan.geometry.triangles import edge_curvatures
from raychan.run.cross_section.single_body import facets_of
from raychan.run.rcs import rcs
from raychan.world.geometry import Geometry
from raychan.world.mesh_files.mesh_io import from_trimesh
from raychan.world.meshes.creases import alternatives
from raychan.world.meshes.halving import cubic_off, halved
from raychan.world.meshes.mesh import make_mesh
from raychan.world.meshes.topology import point_numbers


def ellipsoid(axes, subdivisions=2):
    ball = trimesh.creation.icosphere(subdivisions)
    corners = np.asarray(ball.triangles) * axes
    normals = corners / np.square(axes)
    return corners, normals / np.linalg.norm(normals, axis=2, keepdims=True)


def test_halved_facets_of_an_ellipsoid_lie_on_it_by_fourth_order():
    """Heights that a cubic misses go with the fourth power of the edge, normals with the second."""
    axes, off, turned = np.array([0.3, 0.2, 0.15]), [], []
    for subdivisions in (2, 3):
        v, n = halved(*ellipsoid(axes, subdivisions))
        off.append(np.abs(np.linalg.norm(v / axes, axis=2) - 1.0).max())
        true = v / np.square(axes)
        turned.append(np.linalg.norm(n - true / np.linalg.norm(true, axis=2, keepdims=True), axis=2).max())
    assert off[1] < off[0] / 12.0
    assert turned[1] < turned[0] / 3.5


def test_halved_facets_share_every_edge_even_where_normals_part():
    """A cylinder's rim: its lid is flat, its side is round."""
    mesh = trimesh.creation.cylinder(0.1, 0.3, sections=24)
    facets = facets_of(mesh, "pec", 77e9)
    v, _ = halved(facets.vertices, facets.normals)
    corner = point_numbers(v.reshape(-1, 3)).reshape(-1, 3)
    edge = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], -1).reshape(-1, 2), axis=1)
    assert (np.unique(edge, axis=0, return_counts=True)[1] == 2).all()


@pytest.mark.parametrize("sections", [9, 16, 24])
def test_a_halved_lid_follows_the_round_side_and_stays_flat(sections):
    """Its rim lies on both: area goes to pi r^2 with the square of the section, three quarters of the lack a step."""
    mesh = from_trimesh(trimesh.creation.cylinder(0.1, 0.3, sections=sections), crease_deg=60.0)
    v, _ = halved(mesh.corners, mesh.normals)
    lid = (np.abs(np.abs(v[:, :, 2]) - 0.15) < 1e-12).all(axis=1)
    area = 0.5 * np.linalg.norm(np.cross(v[lid, 1] - v[lid, 0], v[lid, 2] - v[lid, 0]), axis=1).sum() / 2.0
    before = 0.5 * sections * 0.1**2 * np.sin(2.0 * np.pi / sections)
    twice = sections * 0.1**2 * np.sin(np.pi / sections)
    assert area == pytest.approx(twice, abs=0.05 * (twice - before))


def parabola(a):
    """Return a facet of z = a x^2 with one edge across, one along and one askew."""
    v = np.array([[[-0.1, 0.0, 0.01 * a], [0.1, 0.0, 0.01 * a], [-0.1, 0.3, 0.01 * a]]])
    n = np.stack([-2.0 * a * v[..., 0], 0.0 * v[..., 0], np.ones((1, 3))], axis=2)
    return v, n / np.linalg.norm(n, axis=2, keepdims=True)


def test_what_is_a_quadratic_is_hardly_off_it():
    """Both curves meet a parabola across its axis; askew they part sideways, whose height goes with the turn cubed."""
    off = [float(cubic_off(v, n, edge_curvatures(v, n)[0])[0]) for v, n in map(parabola, (1.0, 0.5, 0.25))]
    assert off[0] < 0.03 * 0.01
    assert off[1] < off[0] / 7.0 and off[2] < off[1] / 7.0
    flat = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float), np.array([3 * [[0, 0, 1]]], float)
    assert cubic_off(*flat, edge_curvatures(*flat)[0])[0] == 0.0


@pytest.mark.parametrize("known", [True, False], ids=["known normals", "estimated normals"])
def test_what_coarse_facets_miss_of_a_superquadric_is_in_the_stated_error(known):
    """Its curvature vanishes on lines that cross facets; truth is a mesh of 39,600 facets with its own normals."""
    rng, errors, stated = np.random.default_rng(404), [], []
    for _ in range(2):
        axes, e = rng.uniform(0.08, 0.25, 3), rng.uniform(0.7, 0.9, 2)
        az, el = rng.uniform(-180.0, 180.0), rng.uniform(-50.0, 50.0)
        fine = shapes.fine_superquadric(axes, *e)
        mesh = shapes.superquadric(axes, *e, 24, 40)
        if known:
            mesh = shapes.fine_superquadric(axes, *e, 24, 40)
        got = rcs(mesh, shapes.F, az, el)
        true = rcs(fine, shapes.F, az, el, tolerance_db=0.05)
        errors.append(abs(10.0 * np.log10(float(got.sigma / true.sigma))))
        stated.append(float(got.error_db))
    held = np.isfinite(stated)
    assert held.any()
    assert (np.array(errors)[held] <= np.array(stated)[held]).all()


def test_a_fine_ball_and_a_box_are_not_halved():
    for mesh in (trimesh.creation.icosphere(5, 0.2), trimesh.creation.box((0.2, 0.3, 0.4))):
        geometry = Geometry(facets_of(mesh, "pec", shapes.F))
        assert mesh_error(geometry, alternatives(make_mesh(mesh.vertices, mesh.faces)), shapes.K).halved is None
