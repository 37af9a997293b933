"""The curved surface behind facets: on the sphere that they stand for, and flat where they are."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import trimesh
from support.targets import F
from support.triangles import nodes, on_patch
from truth import po

from raychan.geometry.patch_cuts import edge_of_fan, halved
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.footprints import element_of
from raychan.tracing.legs import Leg
from raychan.tracing.shooting import tube_routes
from raychan.world.geometry import Geometry


def test_elements_of_the_true_surface_add_up_to_its_area_and_point_along_its_normals():
    geometry = Geometry(facets_of(trimesh.creation.icosphere(3, 0.5), "pec", F))
    bary, weights = nodes(2, 4)
    normal = np.empty((len(geometry.area), len(bary), 3))
    for of_facet, v, b in zip(normal, geometry.facets.vertices, geometry.edge_curvature, strict=True):
        for out, w in zip(of_facet, bary, strict=True):
            element_of(v, b, w, out)
    assert (0.5 * np.linalg.norm(normal, axis=2) @ weights).sum() == pytest.approx(np.pi, rel=1e-4)
    points = on_patch(geometry, bary)
    along = normal / np.linalg.norm(normal, axis=2, keepdims=True)
    assert np.einsum("nij,nij->ni", along, points / 0.5).min() > np.cos(0.02)


def test_lit_half_of_a_sphere_projects_to_its_disc():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    geometry = Geometry(facets_of(mesh, "pec", F))
    leg = Leg(end=po.direction(0.3, 0.2), far=True)
    rule = next(itertools.islice(refinements(geometry, F), 2, None))
    shadow = 0.0
    for routes in tube_routes(geometry, leg, [leg], np.ones(len(geometry.piece_role), bool), rule, 1):
        shadow += float(routes.area @ np.einsum("nj,j->n", routes.normals[:, 0], leg.end))
    assert shadow == pytest.approx(np.pi * 0.1**2, rel=2e-3)


def test_patches_of_a_sphere_are_cut_until_their_reflected_rays_spread_by_the_fan():
    """Corner normals of patches of a sphere are their places over its radius: rays turn by twice the angle between."""
    geometry = Geometry(facets_of(trimesh.creation.icosphere(2, 0.5), "pec", F))
    normals, fan = geometry.facets.normals, 0.1
    facet = np.arange(len(normals), dtype=np.int32)
    bary = np.broadcast_to(np.eye(3), (len(facet), 3, 3)).copy()
    for level in range(12):
        edge = edge_of_fan(facet, bary, normals, fan)
        rest = np.flatnonzero(edge < 0)
        corner = np.einsum("nqi,nij->nqj", bary, normals[facet])
        corner /= np.linalg.norm(corner, axis=2, keepdims=True)
        spread = 2.0 * np.linalg.norm(corner - np.roll(corner, -1, axis=1), axis=2).max(axis=1)
        assert ((spread > fan) == (edge >= 0)).all()
        if len(rest) == len(facet):
            break
        one, other = halved(facet, bary, edge, np.flatnonzero(edge >= 0), 0.0, level)
        facet, bary = np.concatenate([facet[rest], one]), np.concatenate([bary[rest], other])
    assert level > 0 and (edge < 0).all()


@pytest.mark.parametrize(("subdivisions", "share"), [(2, 0.02), (3, 0.02), (4, 0.02)])
def test_patches_of_a_coarse_sphere_lie_on_the_sphere(subdivisions, share):
    """The distance from the true sphere is a small share of the facets' own sag."""
    radius = 0.5
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    geometry = Geometry(facets_of(mesh, "pec", F))
    bary = np.random.default_rng(6).dirichlet(np.ones(3), 50)
    flat = np.einsum("mi,nij->nmj", bary, geometry.facets.vertices)
    sag = radius - np.linalg.norm(flat, axis=2).min()
    curved = on_patch(geometry, bary)
    assert np.abs(np.linalg.norm(curved, axis=2) - radius).max() < share * sag
    normal = np.einsum("mi,nij->nmj", bary, geometry.facets.normals)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    assert np.einsum("nmj,nmj->nm", normal, curved / radius).min() > 1 - 1e-4


def test_flat_facets_stay_flat():
    geometry = Geometry(facets_of(trimesh.creation.box((1, 2, 3)), "pec", F))
    assert not geometry.curved.any()
