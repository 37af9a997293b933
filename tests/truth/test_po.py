"""Physical-optics quadrature against sinc, Bessel, Gordon and the textbook, and against exchange of the ends."""

from __future__ import annotations

import numpy as np
import pytest
from support.far_field import HEAD_ON, LAM, K, far, sigma

from truth import corner, po, slab


@pytest.mark.parametrize("end", [(0.0, 0.0), (0.3, 0.2), (-0.9, 0.4)])
def test_plate_quadrature_is_sinc_is_gordon(end):
    plate, view = po.rectangle(0.1, 0.07), far(*end)
    closed = po.rectangle_far(0.1, 0.07, K, view[0])
    scale = 1e-9 * K * 0.007
    assert np.allclose(po.polygon(plate, K, view), closed, atol=scale)
    assert np.allclose(po.polygon_far(plate, K, view[0]), closed, atol=scale)


def test_plate_peak_is_four_pi_area_squared_over_wavelength_squared():
    peak = sigma(po.rectangle_far(0.3, 0.2, K, HEAD_ON)[0, 0])
    assert peak == pytest.approx(4 * np.pi * 0.06**2 / LAM**2)


@pytest.mark.parametrize("form", ["classic", "huygens"])
def test_bistatic_plate_in_a_principal_plane_is_the_textbooks(form):
    ti, ts, a, b = 0.5, -0.2, 0.1, 0.07
    s = po.rectangle_far(a, b, K, po.direction(ti), po.direction(ts), form=form)
    x = K * a * (np.sin(ti) + np.sin(ts)) / 2
    shape = 4 * np.pi * (a * b / LAM) ** 2 * (np.sin(x) / x) ** 2
    both = 0.5 * (np.cos(ti) + np.cos(ts))
    v, h = (np.cos(ti), np.cos(ts)) if form == "classic" else (both, both)
    assert sigma(s[0, 0]) == pytest.approx(shape * v**2) and sigma(s[1, 1]) == pytest.approx(shape * h**2)
    assert abs(s[0, 1]) < 1e-12 and abs(s[1, 0]) < 1e-12


@pytest.mark.parametrize("distances", [(3.0, 3.0), (5.0, 8.0), (np.inf, np.inf)])
def test_bistatic_plate_is_reciprocal(distances):
    a, b = (po.direction(0.4, -0.1), distances[0]), (po.direction(-0.3, 0.5), distances[1])
    plate = po.rectangle(0.06, 0.05)
    assert np.allclose(po.polygon(plate, K, a, b), po.polygon(plate, K, b, a).T, rtol=1e-6, atol=1e-12)


def test_all_currents_agree_where_the_radar_is_one():
    view = (po.direction(0.3, 0.2), 2.0)
    plate = po.rectangle(0.05, 0.04)
    quick = po.polygon(plate, K, view)
    for form in ("classic", "huygens", "reciprocal"):
        assert np.allclose(po.polygon(plate, K, view, view, form=form), quick, atol=1e-9)


@pytest.mark.parametrize(("distance", "radius"), [(3.0, 0.5), (1.0, 0.3)])
def test_disc_nearby_is_its_image_less_its_edge_wave(distance, radius):
    """On the axis the integral of exp(-2jkr)/r^2 dr is closed but for O(1/kD): S = -D/2 (1 - (D/r_e)^2 exp(..))."""
    edge = np.hypot(distance, radius)
    exact = -distance / 2 * (1 - (distance / edge) ** 2 * np.exp(-2j * K * (edge - distance)))
    assert abs(po.disc(radius, K, (HEAD_ON, distance))[0, 0] - exact) < 3 / K


def test_plate_from_very_far_is_far_and_triangles_add_up():
    plate, d = po.rectangle(0.05, 0.08), po.direction(0.1, 0.2)
    closed = po.rectangle_far(0.05, 0.08, K, d)
    assert np.allclose(po.polygon(plate, K, (d, 1e6)), closed, atol=1e-5)
    halves = np.array([plate[[0, 1, 2]], plate[[0, 2, 3]]])
    near = (d, 2.0)
    assert np.allclose(po.triangles(halves, K, near), po.polygon(plate, K, near), atol=1e-9)


def test_polygon_integral_without_phase_is_its_area():
    corners = corner.trihedral_faces(0.3)[0]
    for g in (np.zeros(3), 1e-5 * np.ones(3), 3e-4 * np.ones(3)):
        assert po.fourier(corners, g) == pytest.approx(0.045, rel=1e-3)


def test_disc_quadrature_is_bessel():
    d = po.direction(0.2, -0.1)
    assert np.allclose(po.disc(0.04, K, (d, np.inf)), po.disc_far(0.04, K, d), atol=1e-9)


def test_cylinder_broadside_is_stationary_phase_and_tilted_is_its_sinc():
    a, h = 0.1, 0.2
    broad = sigma(po.cylinder(a, h, K, far(0.3))[0, 0])
    assert broad == pytest.approx(K * a * h**2, rel=2e-2)
    t = 0.01
    tilted = sigma(po.cylinder(a, h, K, far(0.3, t), caps=False)[0, 0])
    assert tilted / broad == pytest.approx(np.sinc(K * h * np.sin(t) / np.pi) ** 2, rel=2e-2)


def test_cylinder_end_on_is_its_disc():
    s = po.cylinder(0.05, 0.1, K, (np.array([0, 0, 1.0]), np.inf))
    assert sigma(s[0, 0]) == pytest.approx(4 * np.pi * (np.pi * 0.0025) ** 2 / LAM**2, rel=1e-6)


def test_dielectric_plate_at_normal_incidence_is_weaker_by_its_reflection():
    plate, view = po.rectangle(0.05, 0.05), (HEAD_ON, np.inf)
    pec = po.polygon_far(plate, K, HEAD_ON)
    glass = po.polygon(plate, K, view, view, geometry=lambda c: slab.layer(c, 6.3 - 0.2j, 0.005, K)[:2])
    r = slab.layer(1.0, 6.3 - 0.2j, 0.005, K)[0]
    assert np.allclose(glass, -r * pec, atol=1e-9)


def test_conductor_by_its_coefficients_is_the_conductor():
    plate, a, b = po.rectangle(0.05, 0.03), (po.direction(0.4, 0.3), 4.0), (po.direction(-0.1, 0.6), 7.0)
    assert np.allclose(po.polygon(plate, K, a, b, geometry=slab.pec), po.polygon(plate, K, a, b), atol=1e-12)
