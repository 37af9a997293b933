"""The scattering matrix of one and the same end is symmetric, and goes over into that of two ends side by side."""

import numpy as np
import pytest
import trimesh

import raychan as rc


def dihedral(opening_deg):
    half = np.radians(0.5 * opening_deg)
    sides = np.array([[np.cos(half), s * np.sin(half), 0.0] for s in (1, -1)]) * 0.2
    z = np.array([0.0, 0.0, 0.075])
    corners = [-z, z, *(side + k * z for side in sides for k in (-1, 1))]
    return trimesh.Trimesh(corners, [[0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 1, 5]], process=False)


@pytest.mark.parametrize(("opening", "azimuth", "elevation"), [(60, 5, 40), (80, 33.3, -25), (70, 12, 18)])
def test_monostatic_cross_polarisation_is_reciprocal_and_continuous(opening, azimuth, elevation):
    body = dihedral(opening)
    one = rc.rcs(body, 77e9, azimuth, elevation).amplitude
    assert one[0, 1] == pytest.approx(one[1, 0], abs=1e-15)
    beside = rc.rcs(body, 77e9, azimuth, elevation, rx_azimuth_deg=azimuth + 1e-7, rx_elevation_deg=elevation).amplitude
    assert np.abs(one - beside).max() < 1e-3 * np.abs(one).max()
