"""rcs against closed forms, series and quadrature that share no code with it, at the bars of issue 3, rays counted."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import quad
from support.targets import F, K, amplitudes, ball, db, rms, sigma, slab_of, tube, view
from truth import corner, mie, po

from raychan.em.fresnel import coefficients_array
from raychan.records import HALF_SPACE, LAYER
from raychan.run.cross_section.single_body import facets_of
from raychan.run.rcs import rcs
from raychan.units import C0
from raychan.world.material import Material

# --- plates -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [3.0, 12.0, 25.0])
@pytest.mark.parametrize("size", [0.1, 0.2, 1.5])
def test_square_plate_in_its_near_field_is_its_quadrature(size, distance):
    corners = po.rectangle(size, size)
    got = rcs(quad(corners), F, 0.0, distance=distance, tolerance_db=0.05)
    assert db(got.sigma / sigma(po.polygon(corners, K, view(0, 0, distance)))) == pytest.approx(0.0, abs=0.05)
    assert got.rays <= 16_384


def test_plate_seen_from_aside_in_its_near_field_is_its_quadrature():
    """Within 0.05 dB down to 40 dB below the peak, as the far pattern is judged; within the stated error everywhere."""
    corners, angles = po.rectangle(0.2, 0.1), [(0.0, 0.0), (2.0, -1.0), (5.0, 0.0), (0.0, 9.0), (12.0, -7.0)]
    got = rcs(quad(corners), F, *zip(*angles, strict=True), distance=4.0, tolerance_db=0.05)
    true = np.array([sigma(po.polygon(corners, K, view(*a, 4.0))) for a in angles])
    error = np.abs(db(got.sigma / true))
    assert error[true > 1e-4 * true.max()].max() < 0.05
    assert (error <= got.error_db).all()


@pytest.mark.parametrize("pol", ["VV", "HH"])
def test_plate_against_angle_is_its_two_sincs(pol):
    azimuth = np.arange(0.0, 60.1, 1.0)
    got = rcs(quad(po.rectangle(0.1, 0.1)), F, azimuth, 0.0, pol)
    true = np.array([sigma(po.rectangle_far(0.1, 0.1, K, view(a)[0]), pol) for a in azimuth])
    seen = true > true.max() * 1e-4
    assert rms(db(got.sigma / true)[seen]) < 0.3
    assert got.rays.max() <= 65_536


@pytest.mark.parametrize("size", [100.0, 2000.0])
def test_far_side_lobes_of_a_large_plate_are_its_two_sincs(size):
    """At 2000 m this is 254 dB below the level of the plate seen square on."""
    got = rcs(quad(po.rectangle(size, size)), F, 40.0, 20.0, max_rays=20_000)
    assert db(got.sigma) == pytest.approx(db(sigma(po.rectangle_far(size, size, K, view(40.0, 20.0)[0]))), abs=1e-3)
    assert got.error_db < 0.5


def test_plate_edge_on_returns_nothing():
    got = rcs(quad(po.rectangle(0.1, 0.1)), F, 90.0)
    assert got.sigma < 1e-12


# --- curved bodies ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [np.inf, 12.0])
@pytest.mark.parametrize("subdivisions", [3, 4])
@pytest.mark.parametrize("radius", [0.05, 0.1, 0.5])
def test_sphere_is_its_mie_series_however_it_is_cut(radius, subdivisions, distance):
    got = rcs(ball(radius, subdivisions), F, [10.0, 77.0], 20.0, distance=distance)
    far = np.isinf(distance)
    true = mie.rcs(radius, K) if far else 4 * np.pi * abs(mie.backscatter_near(radius, K, distance)) ** 2
    assert np.abs(db(got.sigma / true)).max() < 0.2
    assert got.rays.max() <= 65_536


def test_sphere_has_no_cross_polarisation():
    s = np.abs(amplitudes(facets_of(ball(0.1, 4), "pec", F), view(33.0, 11.0)[0]))
    assert 2 * db(max(s[0, 1], s[1, 0]) / s[1, 1]) < -60.0


@pytest.mark.parametrize(
    ("radius", "height", "sections"), [(0.05, 0.2, 32), (0.05, 0.2, 128), (0.1, 0.3, 32), (0.1, 0.3, 64)]
)
def test_cylinder_broadside_and_off_is_its_quadrature(radius, height, sections):
    elevation = np.array([0.0, 0.3, 1.0, 2.0, 3.0])
    got = rcs(tube(radius, height, sections), F, 7.0, elevation)
    true = np.array([sigma(po.cylinder(radius, height, K, view(7.0, e))) for e in elevation])
    assert np.abs(db(got.sigma / true)).max() < 0.3
    assert got.rays.max() <= 65_536


@pytest.mark.parametrize("sections", [32, 128])
def test_cylinder_in_its_near_field_is_its_quadrature(sections):
    elevation = np.array([0.0, 1.0, 3.0])
    got = rcs(tube(0.1, 0.3, sections), F, 7.0, elevation, distance=12.0)
    true = np.array([sigma(po.cylinder(0.1, 0.3, K, view(7.0, e, 12.0))) for e in elevation])
    assert np.abs(db(got.sigma / true)).max() < 0.3
    assert got.rays.max() <= 65_536


def test_cylinder_of_many_sections_far_off_broadside_is_its_quadrature():
    elevation = np.array([25.0, 45.0, 60.0])
    got = rcs(tube(0.05, 0.2, 128), F, 7.0, elevation)
    true = np.array([sigma(po.cylinder(0.05, 0.2, K, view(7.0, e))) for e in elevation])
    assert np.abs(db(got.sigma / true)).max() < 0.3


# --- corners ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0.1, 0.2, 0.3])
def test_dihedral_peak_and_pattern_are_exact_footprints(size):
    azimuth = np.arange(-30.0, 31.0, 2.0)
    faces = corner.dihedral_faces(size, size)
    got = rcs(corner.mesh(faces), F, azimuth)
    error = db(got.sigma / [sigma(corner.corner(faces, K, view(a))) for a in azimuth])
    assert abs(error[azimuth == 0.0]) < 0.1
    assert rms(error) < 0.5
    assert got.rays.max() <= 65_536


def test_dihedral_in_its_near_field_is_exact_footprints():
    faces = corner.dihedral_faces(0.1, 0.1)
    got = rcs(corner.mesh(faces), F, [0.0, 20.0], distance=12.0)
    error = db(got.sigma / [sigma(corner.corner(faces, K, view(a, 0.0, 12.0))) for a in (0.0, 20.0)])
    assert np.abs(error).max() < 0.1


def test_rolled_dihedral_turns_polarisation():
    """Peak of a dihedral rolled by 30 deg: VV goes by cos^2 60 deg, VH by sin^2 60 deg."""
    roll = trimesh.transformations.rotation_matrix(np.radians(30.0), [1, 0, 0])
    mesh = corner.mesh(corner.dihedral_faces(0.2, 0.2)).apply_transform(roll)
    vv, vh = (float(rcs(mesh, F, 0.0, 0.0, p).sigma) for p in ("VV", "VH"))
    # One bounce returns nothing here that counts, so both are the double bounce of the upright one.
    peak = 8 * np.pi * (0.2 * 0.2) ** 2 / (C0 / F) ** 2
    assert db(vv / peak) == pytest.approx(db(np.cos(np.radians(60.0)) ** 2), abs=0.1)
    assert db(vh / peak) == pytest.approx(db(np.sin(np.radians(60.0)) ** 2), abs=0.1)


@pytest.mark.parametrize("square", [False, True])
@pytest.mark.parametrize("size", [0.05, 0.3])
def test_trihedral_boresight_and_pattern_are_exact_footprints(size, square):
    faces = corner.trihedral_faces(size, square)
    cut = np.arange(-20.0, 21.0, 5.0)
    azimuth, elevation = np.concatenate([cut, 0 * cut]), np.concatenate([0 * cut, cut])
    got = rcs(corner.mesh(faces), F, azimuth, elevation)
    true = [sigma(corner.corner(faces, K, view(a, e))) for a, e in zip(azimuth, elevation, strict=True)]
    error = db(got.sigma / true)
    assert np.abs(error[(azimuth == 0.0) & (elevation == 0.0)]).max() < 0.2
    assert rms(error) < 1.0
    assert got.rays.max() <= 65_536


@pytest.mark.parametrize("step", [0, 1, 2, 3])
def test_every_launch_of_a_trihedral_on_its_axis_is_its_exact_footprints(step):
    """Faces in the planes of the axes: corners of tubes lie behind the face beside theirs by rounding, and none of them
    is lost."""
    axes = 0.1 * np.eye(3)
    faces = [np.array([np.zeros(3), axes[i], axes[(i + 1) % 3]]) for i in range(3)]
    look = view(45.0, np.degrees(np.arctan(np.sqrt(0.5))))
    got = amplitudes(facets_of(corner.mesh(faces), "pec", F), look[0], step=step)
    assert db(sigma(got) / sigma(corner.corner(faces, K, look))) == pytest.approx(0.0, abs=1e-4)


# --- materials ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pol", ["VV", "HH"])
@pytest.mark.parametrize("distance", [np.inf, 5.0])
@pytest.mark.parametrize(
    "material",
    [Material(eps_r=5.24, sigma=1.38), Material(eps_r=6.31, sigma=0.6, thickness=0.004)],
    ids=["concrete", "glass layer"],
)
def test_dielectric_plate_is_fresnel_or_slab_times_physical_optics(material, distance, pol):
    corners = po.rectangle(0.1, 0.1)
    azimuth = np.array([0.0, 3.7, 20.0, 45.0])
    got = rcs(quad(corners), F, azimuth, 0.0, pol, distance=distance, material=material)
    true = [sigma(po.polygon(corners, K, view(a, 0, distance), geometry=slab_of(material)), pol) for a in azimuth]
    assert np.abs(db(got.sigma / true)).max() < 0.05
    assert got.rays.max() <= 16_384


@pytest.mark.parametrize("pol", ["VV", "HH"])
def test_dielectric_plate_from_two_sides_is_fresnel_at_its_specular_angle(pol):
    corners = po.rectangle(0.1, 0.1)
    material = Material(eps_r=5.24, sigma=1.38)
    for angle in (20.0, 45.0, 66.0):
        got = rcs(quad(corners), F, angle, 0.0, pol, material=material, rx_azimuth_deg=-angle, tolerance_db=0.05)
        s = po.polygon(corners, K, view(angle), view(-angle), slab_of(material), "reciprocal")
        assert db(got.sigma / sigma(s, pol)) == pytest.approx(0.0, abs=0.05)


def test_passivity_of_random_surfaces():
    rng = np.random.default_rng(1)
    n = 100_000
    kind = np.where(rng.random(n) < 0.3, HALF_SPACE, LAYER).astype(np.int8)
    loss = np.where(rng.random(n) < 0.2, 0.0, 10.0 ** rng.uniform(-6, 4, n))
    eps = 1.0 + 10.0 ** rng.uniform(-6, 2, n) - 1j * loss
    thickness = np.where(kind == LAYER, 10.0 ** rng.uniform(-7, 1, n), 0.0)
    roughness = np.where(rng.random(n) < 0.5, 0.0, 10.0 ** rng.uniform(-6, -2, n))
    cosine = np.concatenate([rng.random(n // 2), 10.0 ** rng.uniform(-9, 0, n - n // 2)])
    c = np.abs(coefficients_array(kind, eps, thickness, roughness, cosine, K)) ** 2
    assert np.isfinite(c).all()
    assert (c[:, :2] + c[:, 2:]).max() <= 1.0 + 1e-9
