"""Bistatic scattering: currents radiate where the receiver does not see them, and the shadow is a wave."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import facets, quad
from truth import mie, po

from raychan.poses import direction
from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.run.cross_section.single_body import facets_of
from raychan.run.rcs import rcs
from raychan.tracing.legs import Leg
from raychan.tracing.radiation import exit_points
from raychan.units import C0
from raychan.world.geometry import Geometry
from raychan.world.material import Material

F = 77e9
K = 2.0 * np.pi * F / C0
LAMBDA = C0 / F


def db(x):
    return 10.0 * np.log10(x)


def ends(*azimuth_deg, distance=np.inf):
    return [(po.direction(np.radians(a)), distance) for a in azimuth_deg]


def sphere_points(radius, towards, nodes):
    """Points, normals and weights of the half of a sphere that faces a direction."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    up, turn = 0.5 * (x + 1.0), 2.0 * np.pi * (np.arange(2 * nodes) + 0.5) / (2 * nodes)
    side = np.cross(towards, [0.0, 0.0, 1.0])
    flat = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(towards, side)
    n = up[:, None, None] * towards + np.sqrt(1.0 - up**2)[:, None, None] * flat
    weights = np.repeat(0.5 * w * radius**2 * np.pi / nodes, 2 * nodes)
    return radius * n.reshape(-1, 3), n.reshape(-1, 3), weights


def both_ways(shape, tx, rx):
    """S (2, 2): mean of physical optics there and back, 2 n x H where each end lights; shape(end) -> points of it."""
    there = po.amplitude(*shape(tx), K, tx, rx, form="classic")
    return 0.5 * (there + po.amplitude(*shape(rx), K, rx, tx, form="classic").T)


def plate_points(width, height, nodes):
    x, w = np.polynomial.legendre.leggauss(nodes)
    y, z = np.meshgrid(0.5 * width * x, 0.5 * height * x, indexing="ij")
    points = np.stack([0.0 * y, y, z], axis=-1).reshape(-1, 3)
    weights = (0.25 * width * height * w[:, None] * w).ravel()

    def shape(end):
        return points, np.broadcast_to([np.sign(end[0][0]), 0.0, 0.0], points.shape), weights

    return shape


@pytest.mark.parametrize("pol", ["VV", "HH"])
def test_sphere_is_physical_optics_of_all_that_is_lit_summed_point_by_point(pol):
    radius, i = 0.023, ("VV", "HH").index(pol)
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    angles = [25.0, 60.0, 90.0, 120.0, 150.0, 165.0, 175.0, 180.0]
    got = rcs(mesh, F, 0.0, polarization=pol, rx_azimuth_deg=angles).sigma
    for angle, sigma in zip(angles, got, strict=True):
        s = both_ways(lambda end: sphere_points(radius, end[0], 90), *ends(0.0, angle))
        assert db(sigma / (4 * np.pi * abs(s[i, i]) ** 2)) == pytest.approx(0.0, abs=0.03), angle


def test_mie_lies_within_the_stated_error_of_spheres_from_all_sides():
    """In the bistatic plane and across it, four sizes; light's end is where physical optics itself is off, and by too
    much for a figure near the forward direction of the worse polarisation."""
    angles, off, stated = np.arange(5.0, 181.0, 25.0), [], []
    for radius in (0.009, 0.016, 0.037, 0.06):
        mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
        exact = mie.amplitudes(radius, K, np.pi - np.radians(angles))
        for i, pol in enumerate(("VV", "HH")):
            got = rcs(mesh, F, 0.0, polarization=pol, rx_azimuth_deg=angles, tolerance_db=10.0)
            error = np.abs(db(got.sigma / (4 * np.pi * np.abs(exact[i]) ** 2)))
            off, stated = np.append(off, error), np.append(stated, got.error_db)
    known = np.isfinite(stated)
    assert known.mean() > 0.85
    assert np.mean(off[known] <= stated[known]) >= 0.95
    told = known & (off > 0.05)
    assert np.median(stated[told] / off[told]) < 12.0


@pytest.mark.parametrize("tx", [0.0, 33.0, 70.0])
def test_plate_has_its_two_lobes_and_the_sinc_between_on_either_side(tx):
    """Both planes of polarisation; closed form: vector factors times one sinc an axis."""
    width, height = 0.05, 0.03
    mesh, n = quad(po.rectangle(width, height)), np.array([1.0, 0.0, 0.0])
    for rx in (10.0, -tx, 88.0, 97.0, 140.0, 180.0 + tx, 215.0, 262.0):
        t, r = (e[0] for e in ends(tx, rx))
        factor = 0.0
        for a, b, back in ((t, r, False), (r, t, True)):
            lit = n * np.sign(n @ a)
            one = po.vector_factor(lit, a, b, form="classic")
            factor = factor + 0.5 * (one.T if back else one)
        shape = width * height * np.sinc(width * (t + r)[1] / LAMBDA)
        true = 4 * np.pi * np.abs(K / (4 * np.pi) * factor * shape) ** 2
        for i, pol in enumerate(("VV", "HH")):
            got = rcs(mesh, F, tx, polarization=pol, rx_azimuth_deg=rx).sigma
            assert db(got / true[i, i]) == pytest.approx(0.0, abs=0.02), (rx, pol)


@pytest.mark.parametrize(
    ("tx", "rx"), [((0.0, 6.0), (180.0, 6.0)), ((40.0, 5.0), (221.0, 3.0)), ((40.0, 5.0), (160.0, 3.0))]
)
def test_plate_in_its_near_field_straight_through_and_aside_is_its_sum_over_points(tx, rx):
    a, b = (po.direction(np.radians(tx[0])), tx[1]), (po.direction(np.radians(rx[0])), rx[1])
    s = both_ways(plate_points(0.2, 0.1, 300), a, b)
    got = rcs(quad(po.rectangle(0.2, 0.1)), F, tx[0], distance=tx[1], rx_azimuth_deg=rx[0], rx_distance=rx[1]).sigma
    assert db(got / (4 * np.pi * abs(s[0, 0]) ** 2)) == pytest.approx(0.0, abs=0.03)


def forward(mesh, look, material="pec"):
    """S (2, 2) straight through, in units of that of 1 m^2 of shadow."""
    geometry = Geometry(facets_of(mesh, material, F))
    rule = list(refinements(geometry, F))[2]
    s = scattering(geometry, Leg(end=look, far=True), Leg(end=-look, far=True), F, 1, rule)[0]
    return s / (K / (2.0 * np.pi))


def shadow_area(parts, look):
    """Area that convex bodies, apart as seen along `look`, take from a beam."""
    return sum(0.5 * np.abs(m.face_normals @ look) @ m.area_faces for m in parts)


@pytest.mark.parametrize("seed", range(4))
def test_forward_wave_takes_twice_the_shadow_from_the_beam(seed):
    """Extinction theorem: 4 pi / k times the forward amplitude's part in phase with the incident wave is 2 A."""
    rng = np.random.default_rng(seed)
    look = direction(*rng.uniform(-1.2, 1.2, 2))
    body = (trimesh.creation.box(rng.uniform(0.05, 0.2, 3)), trimesh.creation.icosphere(subdivisions=3, radius=0.1))[
        seed % 2
    ]
    s = forward(body, look)
    area = shadow_area([body], look)
    np.testing.assert_allclose(np.abs(np.diag(s)), area, rtol=5e-3)
    np.testing.assert_allclose(np.diag(s).real, 0.0, atol=2e-3 * area)
    # H turns over between two ends that look at each other, V does not: both are the same wave, of the other sign.
    np.testing.assert_allclose(s[0, 0], -s[1, 1], atol=1e-3 * area)
    np.testing.assert_allclose([s[0, 1], s[1, 0]], 0.0, atol=1e-3 * area)


def test_two_plates_in_line_throw_the_shadow_of_both_together():
    front = quad(po.rectangle(0.1, 0.06))
    for width, height, union in ((0.06, 0.04, 0.006), (0.2, 0.04, 0.006 + 0.1 * 0.04), (0.3, 0.2, 0.06)):
        back = quad(po.rectangle(width, height) - [0.3, 0.0, 0.0])
        s = forward(trimesh.util.concatenate([front, back]), np.array([1.0, 0.0, 0.0]))
        assert abs(s[0, 0]) == pytest.approx(union, rel=1e-3)


def test_layer_takes_from_the_beam_what_it_does_not_pass():
    """1 - T of a slab, one and two of them in line; vacuum throws no shadow."""
    plate, look = quad(po.rectangle(0.1, 0.06)), np.array([1.0, 0.0, 0.0])
    assert abs(forward(plate, look, Material(eps_r=1.0, sigma=0.0, thickness=0.004))[0, 0]) < 1e-9
    eps, d = 4.0 - 0.05j, 0.003
    glass = Material(eps_r=4.0, sigma=0.05 * 2 * np.pi * F * 8.8541878128e-12, thickness=d)
    n = np.sqrt(eps)
    r = (1 - n) / (1 + n)
    t = (1 - r**2) * np.exp(-1j * K * d * (n - 1.0)) / (1 - r**2 * np.exp(-2j * K * d * n))
    one = forward(plate, look, glass)[0, 0]
    metal = forward(plate, look)[0, 0]
    assert one / metal == pytest.approx(1.0 - t, abs=1e-6)
    pair = trimesh.util.concatenate([plate, quad(po.rectangle(0.1, 0.06) - [0.2, 0.0, 0.0])])
    assert forward(pair, look, glass)[0, 0] / metal == pytest.approx(1.0 - t * t, abs=1e-3)


def test_exchange_of_ends_on_all_sides_of_random_bodies_changes_nothing():
    rng = np.random.default_rng(5)
    boxes = [trimesh.creation.box(rng.uniform(0.02, 0.08, 3)) for _ in range(2)]
    boxes[1].apply_translation([0.0, 0.12, 0.03])
    bodies = [trimesh.creation.icosphere(subdivisions=3, radius=0.04), trimesh.util.concatenate(boxes)]
    for i in range(6):
        (a, ea), (b, eb) = rng.uniform(-180.0, 180.0, 2), rng.uniform(-60.0, 60.0, 2)
        near = ({"distance": 3.0}, {"distance": 2.0}) if i % 3 == 2 else ({}, {})
        rx = [{f"rx_{k}": v for k, v in n.items()} for n in near]
        pol = ("VV", "VH", "HH")[i % 3]
        one = rcs(
            bodies[i % 2], F, a, ea, pol, rx_azimuth_deg=b, rx_elevation_deg=eb, max_rays=20_000, **near[0], **rx[1]
        )
        two = rcs(
            bodies[i % 2],
            F,
            b,
            eb,
            pol[::-1],
            rx_azimuth_deg=a,
            rx_elevation_deg=ea,
            max_rays=20_000,
            **near[1],
            **rx[0],
        )
        assert db(two.sigma / one.sigma) == pytest.approx(0.0, abs=1e-6)


def test_receiver_beside_the_transmitter_is_the_transmitter():
    mesh = trimesh.creation.box([0.1, 0.07, 0.05])
    alone, beside = rcs(mesh, F, 7.0, 3.0), rcs(mesh, F, 7.0, 3.0, rx_azimuth_deg=7.0, rx_elevation_deg=3.0)
    assert db(beside.sigma / alone.sigma) == pytest.approx(0.0, abs=0.01)


def test_reflected_wave_is_blocked_by_what_stands_in_its_way():
    """A plate at 45 deg sends its lobe to the left, onto a second one that the transmitter sees edge-on."""
    turn = trimesh.transformations.rotation_matrix(np.radians(45.0), [0, 0, 1])
    plate = quad(po.rectangle(0.1, 0.1)).apply_transform(turn)
    screen = quad([[0.3, 0.5, -0.3], [-0.3, 0.5, -0.3], [-0.3, 0.5, 0.3], [0.3, 0.5, 0.3]])
    free = rcs(plate, F, 0.0, rx_azimuth_deg=90.0).sigma
    assert db(free) == pytest.approx(db(4 * np.pi * (0.1 * 0.1 * np.sqrt(0.5) / LAMBDA) ** 2), abs=0.01)
    both = rcs(trimesh.util.concatenate([plate, screen]), F, 0.0, rx_azimuth_deg=90.0).sigma
    assert db(both / free) < -20.0


def test_rays_of_currents_leave_their_own_body_where_it_ends_and_no_further():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    other = trimesh.creation.box([0.2, 0.2, 0.2], trimesh.transformations.translation_matrix([-2.0, 0.0, 0.0]))
    geometry = Geometry(facets([ball, other]))
    leg = Leg(end=np.array([-1.0, 0.0, 0.0]), far=True)
    facet = np.flatnonzero(geometry.normal[: len(ball.faces), 0] > 0.3).astype(np.int32)
    points = geometry.facets.vertices[facet].mean(axis=1)
    moved, there = exit_points(geometry, leg, points, facet)
    assert (there < len(ball.faces)).all() and (moved[:, 0] < 0.0).all()
    np.testing.assert_allclose(moved[:, 1:], points[:, 1:], atol=1e-9)
    seen = leg.visible(geometry, moved, there, np.full(len(facet), 1e-4), 1).seen
    hidden = (np.abs(points[:, 1:]) < 0.1).all(axis=1)
    np.testing.assert_array_equal(seen, ~hidden)
    assert hidden.any() and seen.any()


def test_ends_must_both_be_near_or_both_far():
    with pytest.raises(ValueError, match="rx_distance"):
        rcs(quad(po.rectangle(0.1, 0.1)), F, 0.0, rx_azimuth_deg=40.0, rx_distance=5.0)
