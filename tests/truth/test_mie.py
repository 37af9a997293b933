"""Mie series against Rayleigh, geometrical optics, the optical theorem and miepython."""

from __future__ import annotations

import miepython
import numpy as np
import pytest

from truth import mie

C0 = 299_792_458.0
K = 2 * np.pi * 77e9 / C0


def sigma(s):
    return 4 * np.pi * np.abs(s) ** 2


def test_small_conducting_sphere_is_rayleigh():
    x = 0.02
    assert mie.rcs(1.0, x) == pytest.approx(9 * np.pi * x**4, rel=2e-3)


@pytest.mark.parametrize("ka", [200.0, 1000.0])
def test_large_conducting_sphere_is_pi_a_squared(ka):
    assert mie.rcs(1.0, ka) == pytest.approx(np.pi, rel=1e-3)
    # amplitude -(a/2) exp(2jka), corrected by O(1/ka)
    assert abs(mie.backscatter(1.0, ka) + 0.5 * np.exp(2j * ka)) < 1.0 / ka


@pytest.mark.parametrize("eps", [2.5, 2.5 - 0.1j, 5.24 - 0.3j])
@pytest.mark.parametrize("x", [0.5, 16.1, 300.0])
def test_dielectric_sphere_is_miepythons(eps, x):
    peer = miepython.efficiencies_mx(np.sqrt(complex(eps)), x)[2]
    assert mie.rcs(1.0, x, eps) / np.pi == pytest.approx(peer, rel=1e-5)


@pytest.mark.parametrize("eps", [None, 3.0 - 0.2j])
def test_sphere_angles_end_in_backscatter_and_optical_theorem(eps):
    k, a = 25.0, 1.0
    back = mie.amplitudes(a, k, np.pi, eps)
    assert back[0] == pytest.approx(mie.backscatter(a, k, eps)) and back[1] == pytest.approx(-back[0])
    mu, w = np.polynomial.legendre.leggauss(200)
    scattered = np.pi * np.sum(w * sum(np.abs(s) ** 2 for s in mie.amplitudes(a, k, np.arccos(mu), eps)))
    extinct = -4 * np.pi / k * mie.amplitudes(a, k, 0.0, eps)[0][0].imag
    if eps is None:
        assert scattered == pytest.approx(extinct, rel=1e-9)
    else:
        assert 0 < scattered < extinct


@pytest.mark.parametrize("distance", [1.0, 3.0, 12.0])
def test_near_sphere_is_geometrical_optics(distance):
    """Image in a convex mirror: sigma = pi a^2 (D/(D - a))^2 with unit field at 1 m and D to the centre."""
    exact = sigma(mie.backscatter_near(0.3, K, distance))
    assert exact == pytest.approx(np.pi * 0.09 * (distance / (distance - 0.3)) ** 2, rel=1e-3)


def test_near_sphere_from_very_far_is_far():
    assert mie.backscatter_near(0.05, 100.0, 1e5) == pytest.approx(mie.backscatter(0.05, 100.0), rel=1e-3)
