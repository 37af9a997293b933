"""Wedge diffraction against the exact half plane (Sommerfeld 1896), the exact wedge series, and symmetries."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jv, wofz
from truth import slab

from raychan.em import diffraction
from raychan.tracing.point_targets import edge_point

SOFT, HARD = 0, 1
PEC = np.array([-1.0 + 0j, 1.0 + 0j])
CONDUCTOR = (-1.0 + 0j, 1.0 + 0j)


def coefficients(phi_i, phi_d, n, k, length, r_0=PEC, r_n=PEC, beta0=np.pi / 2):
    """(m, 2) coefficients at observers phi_d (m,)."""
    phi_d = np.atleast_1d(np.asarray(phi_d, float))
    phi_i, beta0, length = (np.broadcast_to(np.asarray(x, float), phi_d.shape).copy() for x in (phi_i, beta0, length))
    r_0, r_n = (np.broadcast_to(np.asarray(r, complex), (phi_d.size, 2)).copy() for r in (r_0, r_n))
    return diffraction.wedge_coefficients_array(phi_i, phi_d, float(n), beta0, float(k), length, r_0, r_n)


def geometrical(phi_i, phi_d, n, kr, pol, r_0=PEC, r_n=PEC):
    """Incident and reflected plane waves of a unit wave from phi_i, each where it exists."""
    field = np.where(np.abs(phi_d - phi_i) < np.pi, np.exp(1j * kr * np.cos(phi_d - phi_i)), 0)
    mirrored = np.exp(1j * kr * np.cos(phi_d + phi_i))
    field = field + np.where(phi_d + phi_i < np.pi, np.asarray(r_0)[..., pol] * mirrored, 0)
    # the wave off face n comes from the source mirrored there, at 2 n pi - phi_i
    mirrored = np.exp(1j * kr * np.cos(phi_d + phi_i - 2 * n * np.pi))
    return field + np.where(phi_d + phi_i > (2 * n - 1) * np.pi, np.asarray(r_n)[..., pol] * mirrored, 0)


def total(phi_i, phi_d, n, kr, pol, r_0=PEC, r_n=PEC):
    """Geometrical plus diffracted field of a unit plane wave at k rho = kr (k = 1)."""
    d = coefficients(phi_i, phi_d, n, 1.0, kr, r_0, r_n)[:, pol]
    return geometrical(phi_i, phi_d, n, kr, pol, r_0, r_n) + d * np.exp(-1j * kr) / np.sqrt(kr)


def half_plane(phi_i, phi_d, kr, pol):
    """Exact total field of a conducting half plane (Sommerfeld; Born & Wolf 1999, sec. 11.5)."""

    def one(beta):
        w = -np.sqrt(2 * kr) * np.cos(beta / 2)
        tail = np.sqrt(np.pi) / 2 * np.exp(-0.25j * np.pi) * np.exp(-1j * w**2) * wofz(1j * np.exp(0.25j * np.pi) * w)
        return np.exp(0.25j * np.pi) / np.sqrt(np.pi) * np.exp(1j * kr * np.cos(beta)) * tail

    return one(phi_d - phi_i) + PEC[pol].real * one(phi_d + phi_i)


def wedge_series(phi_i, phi_d, n, kr, pol):
    """Exact total field of a conducting wedge by Bessel functions of order m/n (Balanis 2012, eq. 13-41 ff.)."""
    m = np.arange(int(n * (kr + 12 * kr ** (1 / 3) + 40)))[:, None]
    weight = np.where(m == 0, 1.0, 2.0) / n * np.exp(0.5j * np.pi * m / n) * jv(m / n, kr)
    angles = np.cos(m / n * (phi_d - phi_i)) + PEC[pol].real * np.cos(m / n * (phi_d + phi_i))
    return np.sum(weight * angles, axis=0)


def test_transition_is_the_complementary_error_function():
    x = np.concatenate([[0.0], np.logspace(-12, 8, 2001)])
    z = np.exp(0.25j * np.pi) * np.sqrt(x)
    exact = np.sqrt(np.pi) * z * wofz(1j * z)
    assert np.max(np.abs(diffraction.transition_array(x) - exact)) < 1e-12


def test_transition_far_away_is_one():
    x = 1e4
    assert abs(diffraction.transition(x) - (1 + 0.5j / x - 0.75 / x**2)) < 1e-11


@pytest.mark.parametrize("pol", [SOFT, HARD])
@pytest.mark.parametrize("kr", [0.5, 5.0, 500.0])
@pytest.mark.parametrize("phi_i", [0.0, 0.3, 1.7, np.pi, 4.5])
def test_half_plane_is_exact(phi_i, kr, pol):
    phi = np.linspace(0.001, 2 * np.pi - 0.001, 997)
    assert np.max(np.abs(total(phi_i, phi, 2.0, kr, pol) - half_plane(phi_i, phi, kr, pol))) < 1e-10


def test_wedge_series_of_a_half_plane_is_sommerfeld():
    phi = np.linspace(0, 2 * np.pi, 97)
    assert np.max(np.abs(wedge_series(0.8, phi, 2.0, 20.0, SOFT) - half_plane(0.8, phi, 20.0, SOFT))) < 1e-12


@pytest.mark.parametrize("pol", [SOFT, HARD])
@pytest.mark.parametrize("n", [1.2, 1.5, 1.75])
def test_wedge_error_falls_as_the_next_order_of_the_expansion(n, pol):
    """K-P is the leading term; the next is of order (k rho)^(-3/2) away from boundaries, (k rho)^(-1) across them."""
    phi = np.linspace(0.0, n * np.pi, 361)
    errors = []
    for kr in (25.0, 100.0, 400.0):
        worst = [np.abs(total(p, phi, n, kr, pol) - wedge_series(p, phi, n, kr, pol)).max() for p in (0.4, 1.3, 2.0)]
        errors.append(max(worst))
    assert errors[2] < errors[1] / 3.9 < errors[0] / 15


@pytest.mark.parametrize("pol", [SOFT, HARD])
@pytest.mark.parametrize("n", [1.25, 1.5, 2.0])
def test_total_field_is_continuous_over_shadow_and_reflection_boundaries(n, pol):
    eps = complex(5.24, -0.32)
    for phi_i in (0.4, 1.1, n * np.pi - 0.7):
        crossings = np.array([phi_i + np.pi, phi_i - np.pi, np.pi - phi_i, (2 * n - 1) * np.pi - phi_i])
        for edge in crossings[(crossings > 0) & (crossings < n * np.pi)]:
            phi = edge + np.array([-1e-9, 1e-9])
            for r_0, r_n in [(PEC, PEC), fresnel(phi_i, phi, n, eps)]:
                field = total(phi_i, phi, n, 300.0, pol, r_0, r_n)
                assert np.ptp(field.real) < 1e-5 and np.ptp(field.imag) < 1e-5


def fresnel(phi_i, phi, n, eps):
    """(R_s, R_p) of face 0 under the source and of face n under the observer (m, 2 each)."""
    r_0 = np.stack(slab.half_space(np.full(phi.shape, abs(np.sin(phi_i))), eps), axis=-1)
    return r_0, np.stack(slab.half_space(np.abs(np.sin(n * np.pi - phi)), eps), axis=-1)


def test_very_good_conductor_diffracts_as_a_perfect_one():
    phi = np.linspace(0.1, 1.5 * np.pi - 0.1, 91)
    lossy = coefficients(0.9, phi, 1.5, 1.0, 50.0, *fresnel(0.9, phi, 1.5, 1 - 1e14j))
    assert np.max(np.abs(lossy - coefficients(0.9, phi, 1.5, 1.0, 50.0))) < 1e-5


def test_full_plane_does_not_diffract():
    phi = np.linspace(0.05, np.pi - 0.05, 91)
    r = np.array([0.3 - 0.2j, 0.5 + 0.1j])
    for r_0 in (PEC, r):
        assert np.max(np.abs(coefficients(0.7, phi, 1.0, 1.0, 50.0, r_0, r_0))) < 1e-12


@pytest.mark.parametrize("n", [1.3, 1.5, 2.0])
def test_grazing_incidence_on_either_face(n):
    """At grazing the soft total vanishes; the hard one is that of the exact series without any factor of one half."""
    phi = np.linspace(0.2, n * np.pi - 0.2, 60)
    kr = 200.0
    for phi_i in (0.0, n * np.pi):
        assert np.max(np.abs(total(phi_i, phi, n, kr, SOFT))) < 1e-10
        near = total(phi_i, phi, n, kr, HARD)
        assert np.max(np.abs(near - wedge_series(phi_i, phi, n, kr, HARD))) < 3 / kr**1.5


def test_exchange_of_source_and_observer_changes_nothing():
    rng = np.random.default_rng(1)
    for n in (1.1, 1.5, 2.0):
        a, b = rng.uniform(0.01, n * np.pi - 0.01, (2, 50))
        there = coefficients(a, b, n, 2.0, 7.0)
        back = coefficients(b, a, n, 2.0, 7.0)
        assert np.max(np.abs(there - back)) < 1e-12


def test_far_from_boundaries_it_is_kellers_coefficient():
    phi_i, phi, n, k = 0.5, 2.2, 1.5, 1e9
    first, second = (1 / (np.cos(np.pi / n) - np.cos((phi + s * phi_i) / n)) for s in (-1, 1))
    keller = (
        np.exp(-0.25j * np.pi)
        * np.sin(np.pi / n)
        / (n * np.sqrt(2 * np.pi * k))
        * np.array([first - second, first + second])
    )
    assert np.allclose(coefficients(phi_i, phi, n, k, 1.0)[0], keller, rtol=1e-7)


def test_edge_point_makes_the_way_shortest():
    rng = np.random.default_rng(2)
    for _ in range(20):
        tx, rx, origin, edge = rng.normal(size=(4, 3))
        edge /= np.linalg.norm(edge)
        t = edge_point(tuple(tx), tuple(rx), tuple(origin), tuple(edge))
        point = origin + t * edge
        k_in, k_out = point - tx, rx - point
        assert abs(edge @ k_in / np.linalg.norm(k_in) - edge @ k_out / np.linalg.norm(k_out)) < 1e-9


def skew_wedge():
    """Edge, normal of face 0 and a function to world axes of (along face 0, normal, edge) coordinates."""
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    edge, normal = q[:, 0], q[:, 1]
    return edge, normal, np.array([np.cross(normal, edge), normal, edge])


@pytest.mark.parametrize("phi", [0.3, 1.9, 3.0, 4.4, 6.0])
@pytest.mark.parametrize("beta0", [0.4, 1.2, np.pi / 2, 2.3])
def test_oblique_plane_wave_on_a_half_plane_is_exact(beta0, phi):
    """E_z and H_z of an oblique wave are the two-dimensional solutions at k sin(beta0) (Born & Wolf, sec. 11.6)."""
    edge, normal, axes = skew_wedge()
    k, rho, phi_i = 30.0, 1.7, 1.1
    sin, cos = np.sin(beta0), np.cos(beta0)
    k_in = np.array([-sin * np.cos(phi_i), -sin * np.sin(phi_i), cos]) @ axes
    k_out = np.array([sin * np.cos(phi), sin * np.sin(phi), cos]) @ axes
    e = np.cross(k_in, [0.3, 0.5, -0.7]) + 0.2j * np.cross(k_in, np.cross(k_in, [0.9, 0.1, 0.4]))
    s_out = rho / sin
    at_edge = e * np.exp(1j * k * cos * s_out * cos)
    vectors = (tuple(at_edge), tuple(k_in), tuple(k_out), tuple(edge), tuple(normal))
    diffracted = np.array(diffraction.diffract(*vectors, 2.0, k, np.inf, s_out, CONDUCTOR, CONDUCTOR))
    diffracted *= np.exp(-1j * k * s_out)
    assert abs(diffracted @ k_out) < 1e-12
    kr, where = k * rho * sin, np.array([phi])
    for pol, there, wave in ((SOFT, e, diffracted), (HARD, np.cross(k_in, e), np.cross(k_out, diffracted))):
        exact = (there @ edge) * half_plane(phi_i, where, kr, pol)
        seen = (there @ edge) * geometrical(phi_i, where, 2.0, kr, pol) + wave @ edge
        assert np.abs(seen - exact).max() < 1e-10


def test_diffracted_channel_is_reciprocal():
    """Exchanging two points transposes the matrix of fields between them."""
    edge, normal, axes = skew_wedge()
    rng = np.random.default_rng(4)
    for _ in range(10):
        (a, b), (za, zb) = rng.uniform(0.1, 4.6, 2), rng.normal(size=2)
        ends = [
            np.array([2 * np.cos(a), 2 * np.sin(a), za]) @ axes,
            np.array([3 * np.cos(b), 3 * np.sin(b), zb]) @ axes,
        ]
        point = edge * edge_point(*(tuple(p) for p in ends), (0.0, 0.0, 0.0), tuple(edge))
        matrices = []
        for tx, rx in (ends, ends[::-1]):
            s_in, s_out = np.linalg.norm(point - tx), np.linalg.norm(rx - point)
            k_in, k_out = (point - tx) / s_in, (rx - point) / s_out
            columns = []
            for axis in np.eye(3):
                e = (axis - (axis @ k_in) * k_in) / s_in
                args = (tuple(e), tuple(k_in), tuple(k_out), tuple(edge), tuple(normal), 1.5, 40.0, s_in, s_out)
                columns.append(diffraction.diffract(*args, CONDUCTOR, CONDUCTOR))
            matrices.append(np.array(columns).T)
        assert np.allclose(matrices[0], matrices[1].T, atol=1e-13)
