"""Tubes that land on curved surfaces lie on these, and so do their parts and the middles of their edges."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import facets

from raychan.compile.jit import njit
from raychan.geometry.curved_patches import distance_to_patch, place_on, rise_off_chord
from raychan.tracing.history import History
from raychan.tracing.legs import Leg
from raychan.tracing.resolve_hits import resolve_hits
from raychan.tracing.subdivide import bisect
from raychan.tracing.tubes import Tubes, clearance, edge_middles
from raychan.world.geometry import Geometry

RADIUS = 0.5
N = 400


@njit()
def distances(facet, v, b, normal, o, k, out):
    for i in range(len(facet)):
        f = facet[i]
        height, slope = 0.0, 0.0
        for c in range(3):
            height += normal[f, c] * (v[f, 0, c] - o[i, c])
            slope += normal[f, c] * k[i, c]
        out[i] = distance_to_patch(v[f], b[f], normal[f], o[i], k[i], height / slope)


@njit()
def placed(facet, v, b, w, out):
    for i in range(len(facet)):
        place_on(v[facet[i]], b[facet[i]], w[i, 0], w[i, 1], w[i, 2], out[i])


@njit()
def rise(a, b, at_a, at_b, t, out):
    return rise_off_chord(a, b, at_a, at_b, t, out)


def ball(subdivisions, sign=1.0):
    """Return a ball, or with sign -1 a hollow of its shape."""
    mesh = trimesh.creation.icosphere(subdivisions, RADIUS)
    if sign < 0.0:
        mesh.invert()
    return Geometry(facets([mesh], smooth=True))


@pytest.mark.parametrize("subdivisions", [2, 3])
def test_a_ray_meets_the_patch_at_the_point_that_it_is_aimed_at(subdivisions):
    rng, geometry = np.random.default_rng(subdivisions), ball(subdivisions)
    f = geometry.facets
    facet = rng.integers(0, len(f.vertices), N)
    point, found = np.empty((N, 3)), np.empty(N)
    placed(facet, f.vertices, geometry.edge_curvature, rng.dirichlet(np.ones(3), N), point)
    # From outside, down to 13 degrees over the facet, and over the surface there.
    away = rng.normal(size=(N, 3))
    away -= np.einsum("ni,ni->n", away, geometry.normal[facet])[:, None] * geometry.normal[facet]
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    steep = rng.uniform(np.radians(13.0), 0.5 * np.pi, N)[:, None]
    k = np.cos(steep) * away - np.sin(steep) * geometry.normal[facet]
    far = rng.uniform(0.1, 30.0, N)
    distances(facet, f.vertices, geometry.edge_curvature, geometry.normal, point - far[:, None] * k, k, found)
    outside = np.einsum("ni,ni->n", k, point) < -0.2 * RADIUS
    assert outside.sum() > 0.8 * N
    assert np.abs(found - far)[outside].max() < 1e-8


def test_a_ray_beside_a_patch_meets_its_plane():
    geometry = ball(2)
    f, found = geometry.facets, np.empty(1)
    middle = f.vertices[:1].mean(axis=1) + 3.0 * (f.vertices[:1, 1] - f.vertices[:1, 0])
    start = middle + 2.0 * geometry.normal[:1]
    distances(np.array([0]), f.vertices, geometry.edge_curvature, geometry.normal, start, -geometry.normal[:1], found)
    assert found[0] == pytest.approx(2.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_points_off_chords_lie_on_the_sphere(sign):
    """A sphere's normals are its points over its radius; the rise off a chord is right to the fourth order."""
    rng, out = np.random.default_rng(4), np.empty(3)
    for angle in (0.02, 0.1, 0.3):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        a, b = turn[0], np.cos(angle) * turn[0] + np.sin(angle) * turn[1]
        for t in (0.1, 0.5, 0.8):
            assert rise(RADIUS * a, RADIUS * b, sign * a, sign * b, t, out)
            off = np.linalg.norm(RADIUS * ((1.0 - t) * a + t * b) + out) - RADIUS
            assert abs(off) < RADIUS * angle**4 / 50.0
    assert not rise(a, b, turn[2], turn[2], 0.5, out)
    assert not out.any()


def landed(geometry, sign):
    """Return tubes of rays that left a curved mirror, on the facets of a ball, and where they come from."""
    f = geometry.facets
    facet = np.arange(len(f.vertices), dtype=np.int32)
    n = len(facet)
    points = np.concatenate([f.vertices, f.vertices.mean(axis=1, keepdims=True)], axis=1)
    points *= RADIUS / np.linalg.norm(points, axis=2, keepdims=True)
    normals = sign * points / RADIUS
    source = np.array([3.0, 1.0, 0.5]) if sign > 0.0 else np.array([0.1, 0.05, -0.1])
    length = np.linalg.norm(points - source, axis=2)
    k = (points - source) / length[..., None]
    lit = np.einsum("nqi,nqi->nq", k, normals).max(axis=1) < -0.2
    byte, one = np.zeros(n, np.int8), np.ones(n)
    last, bary = np.full(n, -1, np.int32), np.empty((n, 0, 3))
    tubes = Tubes(points, k, length, normals, facet, one, one, ~lit, bary, byte, byte, byte, last, History())
    return tubes.take(lit), source


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_parts_and_middles_of_tubes_on_a_ball_lie_on_it_with_the_lengths_of_their_rays(sign):
    geometry = ball(3, sign)
    tubes, source = landed(geometry, sign)
    flat = RADIUS - np.linalg.norm(0.5 * (tubes.points[:, 0] + tubes.points[:, 1]), axis=1).min()
    rows = np.arange(len(tubes))
    parts = bisect(geometry, Leg(source), tubes, rows, rows % 3, False, 0.1)
    middle, half_way = edge_middles(geometry, Leg(source), tubes, False)
    for points, length, share in ((parts.points, parts.length, 0.05), (middle, half_way, 0.02)):
        assert np.abs(np.linalg.norm(points, axis=2) - RADIUS).max() < share * flat
        assert np.abs(np.linalg.norm(points - source, axis=2) - length).max() < share * flat


def test_rays_that_leave_a_hollow_meet_its_far_side():
    """Points of a hollow patch lie behind the facets that rays meet."""
    geometry = ball(2, -1.0)
    tubes, _ = landed(geometry, -1.0)
    start = clearance(geometry, tubes)
    out = tubes.k - 2.0 * np.einsum("nqi,nqi->nq", tubes.k, tubes.normals)[..., None] * tubes.normals
    facet, reach = geometry.cast(tubes.points[:, 3], out[:, 3], tubes.facet, start[:, 3])
    chord = 2.0 * RADIUS * np.einsum("ni,ni->n", out[:, 3], tubes.normals[:, 3])
    assert (facet >= 0).all()
    assert reach == pytest.approx(chord, rel=0.05)
    assert not clearance(ball(2), landed(ball(2), 1.0)[0]).any()


def test_a_corner_whose_ray_runs_almost_along_its_facet_lands_where_the_ray_cast_beside_it_does():
    """A hood's far facet lay within 3e-4 of a ray, and the corner 0.1 mm beside it landed 0.67 m short of the hood."""
    tilt = 3e-4
    normal = np.array([[0.0, 0.0, 1.0], [np.sin(0.1 - tilt), 0.0, np.cos(0.1 - tilt)]])
    down = np.array([np.cos(0.1), 0.0, -np.sin(0.1)])
    points, directions = np.zeros((1, 4, 3)), np.repeat(down[None, None], 4, axis=1)
    first = np.array([0.5 * down, 0.8 * down])
    points[0, 1] = -1e-4 * normal[1]
    hit, cast = np.array([[0, 1, 0, 0]], np.int32), np.array([[0.5, 0.8, 0.5, 0.5]])
    surface = np.zeros((2, 3, 3)), np.zeros((2, 3, 3)), np.zeros(2, bool)

    def reach(one_surface, facing=normal):
        one = np.array([one_surface])
        return resolve_hits(np.array([0]), points, directions, hit, cast, one, first, facing, surface)[2][0]

    plane = 0.8 - 1e-4 / tilt
    assert reach(True)[1] == pytest.approx(0.8)
    assert reach(True)[[0, 2, 3]] == pytest.approx(0.5)
    # On one plane it lands there; the corner of a tube that lands by its centre's facet, on that.
    assert reach(True, normal[[1, 1]])[1] == pytest.approx(plane, rel=1e-3)
    assert reach(False)[1] == pytest.approx(0.499, rel=1e-4)
