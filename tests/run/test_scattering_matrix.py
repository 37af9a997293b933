"""The scattering matrix of a body: what circular polarisation, exchange and shifts must do to it, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from truth import corner, mie

from raychan.run.rcs import rcs
from raychan.units import C0

F = 77e9
K = 2.0 * np.pi * F / C0
CIRCULAR = np.array([[1.0, 1.0], [-1j, 1j]]) / np.sqrt(2.0)
"""Columns: both hands, V and H components of a wave on its way to the target."""


def circular(amplitude):
    """(2, 2) for circular hands: a receiver's basis vectors are those of a wave that it would send."""
    return CIRCULAR.T @ amplitude @ CIRCULAR


def dihedral(roll_deg):
    turn = trimesh.transformations.rotation_matrix(np.radians(roll_deg), [1, 0, 0])
    return corner.mesh(corner.dihedral_faces(0.1, 0.1)).apply_transform(turn)


@pytest.mark.parametrize("pol", ["VV", "VH", "HV", "HH"])
def test_all_four_elements_come_from_one_run_and_sigma_is_one_of_them(pol):
    row, col = ("VH".index(p) for p in pol)
    got = rcs(dihedral(30.0), F, [0.0, 4.0], [[1.0], [2.0]], pol, max_rays=20_000)
    assert got.amplitude.shape == (2, 2, 2, 2)
    np.testing.assert_allclose(4 * np.pi * np.abs(got.amplitude[..., row, col]) ** 2, got.sigma, rtol=1e-12)


def test_a_sphere_returns_the_hand_that_was_not_sent_for():
    """One reflection turns the hand over: the antenna that sent it hears nothing."""
    s = circular(rcs(trimesh.creation.icosphere(4, 0.1), F, 33.0, 21.0).amplitude)
    assert np.abs(np.diag(s)).max() < 1e-3 * np.abs(s[0, 1])
    assert abs(abs(s[0, 1]) / np.sqrt(mie.rcs(0.1, K) / (4 * np.pi)) - 1.0) < 0.01


@pytest.mark.parametrize("roll_deg", [0.0, 17.0, 45.0])
def test_a_dihedral_returns_the_hand_that_was_sent_however_it_is_rolled(roll_deg):
    """Its matrix is [[cos 2a, sin 2a], [sin 2a, -cos 2a]]; at 45 deg only cross-polarisation is left."""
    s = rcs(dihedral(roll_deg), F, 0.0, tolerance_db=0.05).amplitude
    peak = np.sqrt(8 * np.pi * 0.1**4 / (C0 / F) ** 2 / (4 * np.pi))
    two = np.radians(2.0 * roll_deg)
    want = np.abs([[np.cos(two), np.sin(two)], [np.sin(two), np.cos(two)]]) * peak
    np.testing.assert_allclose(np.abs(s), want, atol=0.03 * peak)
    hands = circular(s)
    assert abs(hands[0, 1]) < 0.03 * peak
    np.testing.assert_allclose(np.abs(np.diag(hands)), peak, rtol=0.03)


@pytest.mark.parametrize("near", [np.inf, 4.0])
def test_exchange_of_both_ends_transposes_the_matrix(near):
    there = {"rx_azimuth_deg": -12.0, "rx_elevation_deg": 9.0, "rx_distance": near}
    back = {"rx_azimuth_deg": 20.0, "rx_elevation_deg": -5.0, "rx_distance": near}
    mesh = corner.mesh(corner.trihedral_faces(0.1, True))
    one = rcs(mesh, F, 20.0, -5.0, distance=near, max_rays=20_000, **there).amplitude
    other = rcs(mesh, F, -12.0, 9.0, distance=near, max_rays=20_000, **back).amplitude
    np.testing.assert_allclose(one, other.T, rtol=1e-6, atol=1e-6 * np.abs(one).max())


@pytest.mark.parametrize("shift", [0.3e-3, 1.1e-3, 0.25])
def test_the_phase_follows_a_shift_towards_the_radar(shift):
    """Seen from far off, a mesh that comes nearer by d answers exp(+2jkd) of what it did."""
    mesh = trimesh.creation.box((0.1, 0.15, 0.05))
    look = np.array([np.cos(np.radians(7.0)), np.sin(np.radians(7.0)), 0.0])
    moved = mesh.copy().apply_translation(shift * look)
    here, there = (rcs(m, F, 7.0).amplitude[0, 0] for m in (mesh, moved))
    assert abs(there / here * np.exp(-2j * K * shift) - 1.0) < 1e-4
