"""Fringe functions of wedges: limits, symmetry, and a strip by the method of moments."""

import numpy as np
import pytest
from truth.strip import strip

from raychan.em.fringe import fringe

HALF_PLANE, CORNER = np.full(1, 2.0), np.full(1, 1.5)


def both(n, phi, phi0):
    """Return both functions of one wedge, angles in degrees."""
    return np.array([x[0] for x in fringe(np.array([n]), *np.radians([[phi], [phi0]]))])


def test_a_half_plane_seen_edge_on_returns_length_squared_over_pi():
    soft, hard = both(2.0, 180.0, 180.0)
    assert soft == pytest.approx(-1.0, rel=1e-3) and hard == pytest.approx(0.0, abs=1e-3)


def test_a_wedge_that_opens_to_a_plane_has_no_fringe():
    assert np.abs(both(1.0 + 1e-6, 60.0, 60.0)).max() < 1e-4
    assert np.abs(both(1.1, 60.0, 60.0)).max() < np.abs(both(1.5, 60.0, 60.0)).max()


@pytest.mark.parametrize("n", [1.2, 1.5, 2.0])
@pytest.mark.parametrize("phi0", [20.0, 75.0, 130.0])
def test_fringe_is_steady_across_the_boundaries_of_shadow_and_reflection(n, phi0):
    boundaries = [x for x in (180.0 - phi0, 180.0 + phi0) if 1.0 < x < 180.0 * n - 1.0]
    for at in boundaries:
        before, on, after = (both(n, at + off, phi0) for off in (-0.5, 0.0, 0.5))
        np.testing.assert_allclose(on, 0.5 * (before + after), atol=0.02 * np.abs(on).max())


def test_either_face_may_be_the_first():
    for phi, phi0 in ((30.0, 50.0), (100.0, 200.0), (250.0, 20.0)):
        np.testing.assert_allclose(both(1.5, phi, phi0), both(1.5, 270.0 - phi, 270.0 - phi0), rtol=1e-9)


def test_nothing_is_within_the_wedge():
    assert not both(1.5, 300.0, 40.0).any() and not both(1.5, 40.0, 300.0).any()


@pytest.mark.parametrize("width", [6.0, 12.0, 20.0, 40.0])
@pytest.mark.parametrize("degrees", [0.0, 20.0, 40.0, 60.0, 75.0])
def test_both_edges_of_a_strip_bring_what_physical_optics_lacks_of_the_method_of_moments(width, degrees):
    """For the field along the edges; what goes from edge to edge is left."""
    angle = np.radians(degrees)
    phi = np.array([0.5 * np.pi + angle, 0.5 * np.pi - angle])
    turn = np.exp(1j * width * np.sin(angle) * np.array([1.0, -1.0]))
    edges = 2j * (fringe(np.full(2, 2.0), phi, phi)[0] * turn).sum()
    whole, optics = strip(width, angle, angle, "E")
    assert abs(whole - optics - edges) < 0.15 * abs(whole - optics) + 0.02
