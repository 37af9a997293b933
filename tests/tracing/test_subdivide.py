"""Cuts of tubes on their way: parts are the whole, and the outline that a tube is cut at is the longest inside it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import facets

from raychan.compile.jit import njit
from raychan.tracing.edge_crossings import TubeRays
from raychan.tracing.history import History
from raychan.tracing.legs import Leg
from raychan.tracing.resolve_hits import IncidentTubes, LandedTubes, ReflectingFacets, tubes_at_hits
from raychan.tracing.silhouette_crossings import longest_crossing, outlines_of
from raychan.tracing.subdivide import as_if_straight, bisect, edge_of_spread, subdivide
from raychan.tracing.tubes import Tubes
from raychan.world.geometry import Geometry

N = 300


def vector_area(points):
    """Half the cross product of two edges of triangles (n, 3 or 4, 3)."""
    return 0.5 * np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])


def tubes_from(source, corners):
    """Tubes of rays from one point to corners (n, 3, 3), which have left their first facet."""
    n = len(corners)
    points = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    length = np.linalg.norm(points - source, axis=2)
    normals = np.broadcast_to([0.0, 0.0, 1.0], (n, 4, 3)).copy()
    byte, whole, one = np.zeros(n, np.int8), np.zeros(n, np.int32), np.ones(n)
    k = (points - source) / length[..., None]
    flat, none = np.ones(n, bool), np.empty((n, 0, 3))
    return Tubes(points, k, length, normals, whole, one, one, flat, none, byte, byte, byte, whole - 1, History())


def triangles(rng, size, about=1.0, height=0.0):
    """Triangles (n, 3, 3) at a height, `about` the middle, not too thin."""
    turn = rng.uniform(0, 2 * np.pi, (N, 1)) + np.array([0.0, 2.1, 4.2]) + rng.uniform(-0.6, 0.6, (N, 3))
    r = size * rng.uniform(0.5, 1.0, (N, 3))
    middle = rng.uniform(-about, about, (2, N, 1))
    x, y = r * np.cos(turn) + middle[0], r * np.sin(turn) + middle[1]
    return np.stack([x, y, np.full_like(x, height)], axis=-1)


def test_parts_have_the_area_of_the_whole_and_rays_of_its_source():
    rng = np.random.default_rng(1)
    source = np.array([1.0, -2.0, 4.0])
    tubes = tubes_from(source, triangles(rng, 0.05))
    geometry, leg = Geometry(facets([trimesh.creation.box()])), Leg(source)
    line = rng.normal(size=(N, 2))
    side = np.einsum("nij,nj->ni", tubes.points[:, :3, :2] - tubes.points[:, 3:, :2], line)
    side /= np.linalg.norm(line, axis=1, keepdims=True)
    side[::3] = 0.0
    rows = rng.permutation(N)[: N // 2]
    cut, parent = subdivide(geometry, leg, tubes, rows, side, False, 0.1)
    half = bisect(geometry, leg, tubes, rows, rng.integers(0, 3, len(rows)), False, 0.2)
    for parts, of in ((cut, parent), (half, np.tile(rows, 2))):
        area = np.bincount(of, vector_area(parts.points)[:, 2], N)
        assert area[rows] == pytest.approx(vector_area(tubes.points)[rows, 2], rel=1e-9)
        rays = parts.points - source
        off = np.abs(parts.length - np.linalg.norm(rays, axis=2))
        assert off[:, :3].max() < 1e-8 and off[:, 3].max() < 1e-6
        assert np.abs(parts.k - rays / parts.length[..., None]).max() < 1e-4
    # No part lies on both sides of the line that it was cut at.
    at = np.einsum("nij,nj->ni", cut.points[:, :3, :2] - tubes.points[parent, 3:, :2], line[parent])
    known = side[parent].any(axis=1)
    assert known.any() and (~known).any()
    assert (at[known].min(axis=1) * at[known].max(axis=1)).min() > -1e-12


def test_heights_taken_as_straight_are_zero_where_quadratic_ones_are():
    rng = np.random.default_rng(4)
    side = rng.choice([-1.0, 1.0], (N, 3)) * rng.uniform(1e-6, 1.0, (N, 3))
    side[::7, 1] = 0.0
    side = side[(side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)]
    middle = 0.5 * (side + np.roll(side, -1, axis=1)) + rng.normal(size=side.shape) * rng.choice([0.0, 0.3], (1, 3))
    straight, tried = as_if_straight(side, middle), 0
    for a in range(3):
        b = (a + 1) % 3
        rows = np.flatnonzero(straight[:, a] * straight[:, b] < 0.0)
        tried += len(rows)
        t = straight[rows, a] / (straight[rows, a] - straight[rows, b])
        h = side[rows, a] * (1 - t) * (1 - 2 * t) + 4 * t * (1 - t) * middle[rows, a] + side[rows, b] * t * (2 * t - 1)
        assert np.abs(h).max() < 1e-9
    assert tried > N
    assert ((straight > 0.0) == (side > 0.0)).all()


def test_tubes_are_cut_where_their_rays_spread_most_off_a_curved_mirror():
    """Rays along -z on a cylinder of radius 1 about the y axis turn by twice the angle of their foot: with corners at
    angles 0, 0.01 and 0.04, the second edge spreads by 0.06 rad and the third by 0.08."""
    angle = np.array([0.0, 0.01, 0.04])
    normals = np.zeros((2, 4, 3))
    normals[:, :3, 0], normals[:, :3, 2] = np.sin(angle), np.cos(angle)
    k = np.broadcast_to([0.0, 0.0, -1.0], (2, 4, 3)).copy()
    facet, curved = np.array([0, 1], np.int32), np.array([True, False])
    assert edge_of_spread(k, normals, facet, curved, 0.07).tolist() == [2, -1]
    assert edge_of_spread(k, normals, facet, curved, 0.09).tolist() == [-1, -1]


@njit()
def search(rows, rays, outlines, side, tested, room):
    for i in rows:
        longest_crossing(i, i, rays, False, outlines, side[i], tested, room)


def shares_inside(tubes, i, source, ends, margin=0.0, steps=4000):
    """How much [m] of each edge (e, 2, 3) lies inside tube i, or beside it by a margin, beyond its footprint: point by
    point."""
    t = (np.arange(steps) + 0.5) / steps
    x = ends[:, :1] + t[:, None] * (ends[:, 1:] - ends[:, :1])
    weights = np.linalg.solve((tubes.points[i, :3] - source).T, (x - source).reshape(-1, 3).T).T
    ahead = (x.reshape(-1, 3) - tubes.points[i, 3]) @ tubes.k[i, 3] > 0.0
    inside = ahead & (weights > -margin * weights.sum(axis=1, keepdims=True)).all(axis=1)
    return inside.reshape(len(ends), steps).mean(axis=1) * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def test_outline_found_between_mirror_and_nowhere_is_that_of_which_most_lies_inside_the_tube():
    rng = np.random.default_rng(2)
    ball, box = trimesh.creation.icosphere(2, 0.8), trimesh.creation.box((0.5, 0.4, 1.0))
    ball.apply_translation([0.3, 0.2, 3.0])
    box.apply_translation([-0.8, 0.5, 2.0])
    geometry = Geometry(facets([ball, box]))
    source = np.array([0.1, 0.2, -3.0])
    # Narrow ones, which are followed all the way.
    tubes = tubes_from(source, triangles(rng, 0.05, 0.5)[:, ::-1])
    side = np.zeros((N, 3))
    rows = np.arange(0, N, 2)
    hit, reach = np.full((N, 4), -1, np.int32), np.full((N, 4), np.inf)
    rays = TubeRays(tubes.points, tubes.k, tubes.length, tubes.flat, hit, reach)
    outlines = outlines_of(geometry)
    search(rows, rays, outlines, side, np.full(len(outlines.grid.edges), -1, np.int32), np.empty((9, 3)))
    ends, faces = geometry.edge_ends, geometry.edge_faces
    towards = np.einsum("fj,fj->f", geometry.normal, source - geometry.first) > 0.0
    ends = ends[towards[faces[:, 0]] != towards[faces[:, 1]]]
    found = 0
    for i in rows:
        length = shares_inside(tubes, i, source, ends)
        best = int(length.argmax())
        if length[best] < 2e-3:
            # Shorter ones may lie on the very side of the tube, where none cuts it.
            assert not side[i].any() or shares_inside(tubes, i, source, ends, 0.05).max() > 0.0
            continue
        found += 1
        across = np.cross(ends[:, 1] - ends[:, 0], source - ends[:, 0])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        wanted = np.einsum("eqj,ej->eq", tubes.points[i, :3] - ends[:, :1], across)
        alike = length > length[best] - 1e-3
        assert np.abs(np.abs(wanted[alike]) - np.abs(side[i])).max(axis=1).min() < 1e-9
    assert found > 20
    assert not side[1::2].any()


def test_tubes_land_with_the_spreading_of_their_area_and_the_normals_between_their_facets_corners():
    """Off a curved mirror the power of a tube stays; a point of a facet has the mean of its corners' normals."""
    rng = np.random.default_rng(3)
    mesh = trimesh.creation.icosphere(1, 2.0)
    geometry = Geometry(facets([mesh], smooth=True))
    f = geometry.facets
    source = np.array([0.0, 0.0, 5.0])
    tubes = tubes_from(source, triangles(rng, 0.01, 0.2, 4.0))
    facet, reach = geometry.cast(tubes.points[:, 3], tubes.k[:, 3], np.full(N, -1, np.int32))
    assert (facet >= 0).all()
    hit = np.repeat(facet, 4).reshape(N, 4)
    reach = geometry.distance(hit.ravel(), tubes.points.reshape(-1, 3), tubes.k.reshape(-1, 3)).reshape(N, 4)
    points, k, normals, length = np.empty((N, 4, 3)), np.empty((N, 4, 3)), np.empty((N, 4, 3)), np.empty((N, 4))
    (spread, strength), flat, caustics = np.empty((2, N)), np.empty(N, bool), np.empty(N, np.int8)
    start = np.full(N, 2.0)
    rays = tubes.points, tubes.k, tubes.length, tubes.normals, tubes.facet, start, tubes.strength
    before = IncidentTubes(*rays, np.zeros(N, bool), tubes.caustics)
    bodies = ReflectingFacets(f.vertices, f.normals, geometry.curved, *geometry.material_columns)
    after = LandedTubes(points, k, length, normals, spread, strength, flat, caustics)
    tubes_at_hits(np.arange(N), hit, reach, before, bodies, False, 1600.0, after)
    assert points == pytest.approx(tubes.points + reach[..., None] * tubes.k)
    thrown = [np.abs(np.einsum("ij,ij->i", vector_area(p), tubes.k[:, 3])) for p in (tubes.points, points)]
    assert spread**2 * thrown[1] == pytest.approx(4.0 * thrown[0])
    assert not flat.any() and not caustics.any() and strength == pytest.approx(1.0)
    edges = f.vertices[facet].transpose(0, 2, 1)
    weights = np.linalg.solve(edges, points[:, 3, :, None])[..., 0]
    mean = np.einsum("ni,nij->nj", weights, f.normals[facet])
    assert normals[:, 3] == pytest.approx(mean / np.linalg.norm(mean, axis=1, keepdims=True), abs=1e-9)
