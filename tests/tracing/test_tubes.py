"""Tubes: their phase integrals, their cuts along edges, the true surface behind facets, and no ray lost at an edge."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import trimesh
from support.facets import facets, quad
from support.triangles import nodes
from truth import corner, po

from raychan.em.phase_integral import triangle_terms
from raychan.em.phasor import mean_parts, points_for
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.single_body import facets_of
from raychan.tracing.legs import Leg
from raychan.tracing.shooting import tube_routes
from raychan.world.geometry import Geometry
from raychan.world.shapes import build

F = 77e9


BARY, WEIGHTS = nodes()


def quadratic(phases, bary):
    """Quadratic through corner and mid-edge values, in its shape functions."""
    a, b, c = bary.T
    shapes = (a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a)
    return sum(p * n for p, n in zip(phases, shapes, strict=True))


def linear_phases(corners):
    return np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1))])


def triangle_mean(*corners):
    out = np.empty(3, complex)
    assert triangle_terms(linear_phases(np.array(corners)), 0.05, out) == 1
    return out.sum()


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 0.019, 0.021, 1.0, 30.0, 200.0])
def test_mean_over_a_triangle_of_linear_phase_is_its_quadrature(size):
    rng = np.random.default_rng(int(size * 1e3))
    for _ in range(10):
        p = rng.uniform(-1, 1, 3) * size + rng.uniform(-100, 100)
        p[rng.integers(3)] = p[rng.integers(3)]  # two corners alike, now and then
        assert triangle_mean(*p) == pytest.approx(WEIGHTS @ np.exp(-1j * BARY @ p), abs=1e-9)


def test_mean_is_continuous_where_its_series_begins():
    for span in (0.05, 1e-3, 2.0):
        for p in (np.array([0.0, 0.3, 1.0]), np.array([0.0, 0.0, 1.0])):
            low, high = (triangle_mean(*(p * span * f)) for f in (1 - 1e-9, 1 + 1e-9))
            assert abs(high - low) < 1e-8


@pytest.mark.parametrize("slope", [0.0, 0.5, 1.9, 2.1, 40.0])
def test_corner_terms_of_a_linear_phase_are_the_integrals_of_its_shape_functions_at_low_slope_and_add_up(slope):
    rng = np.random.default_rng(2)
    out = np.empty(3, complex)
    for _ in range(20):
        p = rng.uniform(-1, 1, 3) * slope
        triangle_terms(linear_phases(p), 0.05, out)
        whole = WEIGHTS * np.exp(-1j * BARY @ p)
        assert out.sum() == pytest.approx(whole.sum(), abs=1e-9)
        if slope <= 0.5:
            assert out == pytest.approx(whole @ BARY, abs=0.01)


@pytest.mark.parametrize("bend", [0.02, 0.3, 2.0, 4.0])
@pytest.mark.parametrize("slope", [0.0, 3.0, 40.0])
def test_mean_over_a_triangle_of_quadratic_phase_is_its_quadrature(slope, bend):
    rng = np.random.default_rng(3)
    out = np.empty(3, complex)
    for _ in range(10):
        phases = linear_phases(rng.uniform(-1, 1, 3) * slope)
        phases[3:] += rng.uniform(-1, 1, 3) * bend
        triangle_terms(phases, 1e-3, out)
        assert out.sum() == pytest.approx(WEIGHTS @ np.exp(-1j * quadratic(phases, BARY)), abs=2e-4)


def test_pieces_of_a_quadratic_phase_close_in_with_the_square_of_their_size():
    # Too bent for a Gauss rule, and running in no direction: cut in pieces.
    phases = np.array([0.0, 20.0, -28.0, 24.0, 10.0, -30.0])
    exact = WEIGHTS @ np.exp(-1j * quadratic(phases, BARY))
    out = np.empty(3, complex)
    errors = []
    for linear in (0.8, 0.8 / 4, 0.8 / 16):
        triangle_terms(phases, linear, out)
        errors.append(abs(out.sum() - exact))
    assert errors[2] < errors[0] / 8 and errors[2] < 1e-3


@pytest.mark.parametrize("reach", [4.0, 9.0, 10.0, 35.0, 62.0, 92.0])
def test_mean_and_corner_terms_of_a_phase_that_stands_still_are_the_quadrature_to_2e_6(reach):
    rng = np.random.default_rng(6)
    out = np.empty(3, complex)
    for _ in range(10):
        phases = linear_phases(rng.uniform(-1, 1, 3))
        phases[3:] += rng.choice([-1, 1], 3) * rng.uniform(0.7, 1, 3)
        bends = phases[3:] - 0.5 * (phases[:3] + np.roll(phases[:3], -1))
        size = reach / (np.ptp(phases[:3]) + 4.0 * abs(bends).max())
        phases, bends = size * phases, size * bends
        mean_parts(phases, *bends, points_for(reach), out)
        assert out == pytest.approx((WEIGHTS * np.exp(-1j * quadratic(phases, BARY))) @ BARY, abs=2e-6)


def test_mean_of_a_quadratic_phase_hangs_on_no_setting_where_it_is_not_cut_in_pieces():
    """Phases that stand still, that run along all edges, and along one only: 2e-5, though `linear` is coarse."""
    out = np.empty(3, complex)
    still = np.array([0.0, 3.0, -2.0, 3.0, 1.0, -4.0])
    all_edges = linear_phases(np.array([0.0, 60.0, 150.0])) + np.array([0.0, 0.0, 0.0, 1.5, -1.0, 0.7])
    one_edge = linear_phases(np.array([0.0, 0.4, 90.0])) + np.array([0.0, 0.0, 0.0, 1.5, -1.0, 0.7])
    along = linear_phases(np.array([0.0, 90.0, 88.0])) + np.array([0.0, 0.0, 0.0, -2.0, 3.0, 1.0])
    for phases in (still, all_edges, one_edge, along):
        for turn in range(3):
            turned = np.concatenate([np.roll(phases[:3], turn), np.roll(phases[3:], turn)])
            triangle_terms(turned, 0.1, out)
            e = WEIGHTS * np.exp(-1j * quadratic(turned, BARY))
            assert out.sum() == pytest.approx(e.sum(), abs=2e-5)
            assert out == pytest.approx(e @ BARY, abs=5e-4)


@pytest.mark.parametrize("bend", [0.0, 0.3])
@pytest.mark.parametrize("slope", [1.0, 1.9, 2.1, 5.0, 30.0])
def test_corner_terms_keep_the_change_of_the_mean_with_frequency(slope, bend):
    """Fixed terms that turn with their corners' delays: their derivative is that of the integral; for plain corner
    terms of stationary phase it would be off by 2 over the number of radians."""
    rng = np.random.default_rng(4)
    out, off = np.empty(3, complex), []
    for _ in range(20):
        p = rng.uniform(0, 1, 3)
        p *= slope / np.ptp(p)
        phases = linear_phases(p)
        phases[3:] += rng.uniform(-1, 1, 3) * bend
        triangle_terms(phases, 1e-3, out)
        e = WEIGHTS * np.exp(-1j * quadratic(phases, BARY))
        # About the middle of the phases, so that a common delay weighs nothing.
        first = out @ (p - p.mean())
        off.append(min(abs(first - e @ (f - p.mean())) for f in (quadratic(phases, BARY), BARY @ p)))
    assert max(off) < 0.05


# --- no ray is lost at an edge ------------------------------------------------------------------------------------


CLOSED = {
    "sphere": {"radius": 0.3},
    "cylinder": {"radius": 0.2, "height": 0.7},
    "box": {"length": 0.3, "width": 0.5, "height": 0.2},
    "wall": {},
    "lamp_post": {},
    "trash_bin": {},
}


def fronts(normals, rng):
    """Return a unit direction against all normals (n, 3), 8 deg off grazing or more, or None if none was found."""
    for _ in range(20):
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        d *= -np.sign(d @ normals[0])
        if (normals @ d < -0.15).all():
            return d
    return None


@pytest.mark.parametrize("name", CLOSED)
def test_rays_aimed_at_shared_edges_and_vertices_never_pass(name):
    """Rays from outside at edges and vertices whose facets all face them must hit: 1e5 in all."""
    rng = np.random.default_rng(4)
    geometry = Geometry(facets_of(build(name, CLOSED[name]), "pec", F))
    tri = geometry.facets.vertices
    count = 100_000 // len(CLOSED)
    mesh = trimesh.Trimesh(tri.reshape(-1, 3), np.arange(3 * len(tri)).reshape(-1, 3), process=False)
    mesh.merge_vertices()
    pairs, ends = mesh.face_adjacency, mesh.face_adjacency_edges
    around = [np.flatnonzero((mesh.faces == v).any(axis=1)) for v in rng.integers(len(mesh.vertices), size=300)]
    aims, ways = [], []
    for i in rng.integers(len(pairs), size=700):
        d = fronts(geometry.normal[pairs[i]], rng)
        if d is not None:
            share = rng.random((count // 1000, 1))
            aims.append(mesh.vertices[ends[i, 0]] * share + mesh.vertices[ends[i, 1]] * (1 - share))
            ways.append(np.tile(d, (len(share), 1)))
    for rows in around:
        d = fronts(geometry.normal[rows], rng)
        if d is not None:
            corner_of = np.intersect1d(np.intersect1d(mesh.faces[rows[0]], mesh.faces[rows[1]]), mesh.faces[rows[-1]])
            aims.append(np.repeat(mesh.vertices[corner_of[:1]], count // 1000, axis=0))
            ways.append(np.tile(d, (len(aims[-1]), 1)))
    aim, d = np.concatenate(aims), np.concatenate(ways)
    d += 1e-3 * rng.normal(size=d.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    assert len(d) > 0.5 * count
    # Away from the mesh's own distance too: float32 spacing grows with it.
    back = geometry.extent * 10.0 ** rng.uniform(0.2, 1.5, (len(d), 1))
    hit, _ = geometry.cast(aim - back * d, d, np.full(len(d), -1, np.int32))
    assert (hit < 0).sum() == 0


def test_rays_over_a_sheet_of_two_triangles_never_slip_between_them():
    rng = np.random.default_rng(5)
    geometry = Geometry(facets([quad(po.rectangle(1.0, 1.0))]))
    t = rng.uniform(0.001, 0.999, 20_000)[:, None]
    aim = (1 - t) * np.array([0, -0.5, -0.5]) + t * np.array([0, 0.5, 0.5])
    start = np.column_stack([rng.uniform(1, 100, len(t)), rng.uniform(-20, 20, (len(t), 2))])
    d = (aim - start) / np.linalg.norm(aim - start, axis=1, keepdims=True)
    assert (geometry.cast(start, d, np.full(len(d), -1, np.int32))[0] >= 0).all()


# --- tubes are cut along edges ------------------------------------------------------------------------------------


def footprints(mesh, look, step=1, bounces=3):
    """Area of last footprints [m^2] by the facets' planes passed, in a far field."""
    geometry = Geometry(facets_of(mesh, "pec", F))
    leg = Leg(end=look, far=True)
    rule = next(itertools.islice(refinements(geometry, F), step, None))
    areas: dict[tuple[int, ...], float] = {}
    for routes in tube_routes(geometry, leg, [leg], np.ones(len(geometry.piece_role), bool), rule, bounces):
        for facet, area in zip(routes.facet, routes.area, strict=True):
            chain = tuple(int(geometry.plane[f]) for f in facet if f >= 0)
            areas[chain] = areas.get(chain, 0.0) + float(area)
    return areas


@pytest.mark.parametrize("azimuth", [0.0, 7.0, -21.0, 30.0])
def test_tubes_of_a_dihedral_are_cut_exactly_where_the_second_face_ends(azimuth):
    faces = corner.dihedral_faces(0.2, 0.1)
    look = po.direction(np.radians(azimuth))
    got = sorted(a for chain, a in footprints(corner.mesh(faces), look, bounces=2).items() if len(chain) == 2)
    true = []
    for order in ((0, 1), (1, 0)):
        parts = corner.footprints(faces, order, (look, np.inf), (look, np.inf))
        n = po.unit_normal(faces[order[-1]])
        true.append(sum(sign * abs(corner.area(part, n)) for sign, part in parts))
    assert got == pytest.approx(sorted(true), rel=1e-6)


def test_first_tubes_of_an_open_corner_cover_it_once():
    """Seen from boresight every face of a trihedral is lit whole."""
    faces = corner.trihedral_faces(0.1)
    areas = footprints(corner.mesh(faces), np.array([1.0, 0, 0]), bounces=1)
    assert sorted(areas.values()) == pytest.approx([0.005] * 3, rel=1e-9)


# --- the true surface behind the facets ---------------------------------------------------------------------------
