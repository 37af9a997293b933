"""Diffracted point_legs to points: continuous over shadow boundaries, half at the boundary, alike both point_legs."""

from __future__ import annotations

import numpy as np
import pytest
from support.facets import box, facets, quad
from support.points import point, radar

import raychan as rc
from raychan.channel.edge_diffraction import leg_field
from raychan.poses import theta_phi
from raychan.records import DIFFRACT
from raychan.run.solver import solve
from raychan.tracing.point_targets import wedge_legs
from raychan.tracing.settings import refinement
from raychan.units import C0
from raychan.world.geometry import Geometry

F = 77e9
K = 2 * np.pi * F / C0


def vertical(look):
    return theta_phi(look)[0].astype(complex)


def horizontal(look):
    return theta_phi(look)[1].astype(complex)


def field(geometry, y, x=20.0):
    """Field of all point_legs at (x, y, 0) from the origin, over that of free space; the mean of V and H.

    The mean of soft and hard diffraction is what scalar theory gives.
    """
    at, scale = np.array([x, y, 0.0]), np.hypot(x, y) * np.exp(1j * K * np.hypot(x, y))
    legs = wedge_legs(geometry, np.zeros(3), at, -1, K)
    v = sum(leg_field(leg, geometry.facets, vertical, K) for leg in legs)
    h = sum(leg_field(leg, geometry.facets, horizontal, K) for leg in legs)
    straight = at / np.linalg.norm(at)
    return 0.5 * scale * (v @ theta_phi(straight[None])[0][0] + h @ theta_phi(straight[None])[1][0])


@pytest.fixture(scope="module")
def screen():
    return Geometry(facets([quad([[10, 0, -30], [10, 0, 30], [10, 40, 30], [10, 40, -30]])]))


def test_field_behind_a_half_plane_is_half_at_the_shadow_boundary(screen):
    assert np.abs(field(screen, 1e-7)) == pytest.approx(0.5, abs=5e-3)
    assert np.abs(field(screen, -1e-7)) == pytest.approx(0.5, abs=5e-3)


def test_field_behind_a_half_plane_is_fresnels_integral(screen):
    from scipy.special import fresnel

    for y in (-1.0, -0.3, -0.05, 0.05, 0.3, 1.0):
        # Clearance of the ray over the edge at x = 10, in Fresnel zones (ITU-R P.526, eq. 26).
        v = y / 2.0 * np.sqrt(2.0 / (C0 / F) * (1 / 10.0 + 1 / 10.0))
        s, c = fresnel(v)
        truth = abs((1 + 1j) / 2 * ((0.5 - c) - 1j * (0.5 - s)))
        assert np.abs(field(screen, y)) == pytest.approx(truth, rel=0.02)


def test_total_field_is_continuous_across_the_boundary_of_a_box():
    # The ray over the front edge at (8, 0.5) passes x = 20 at y = 1.25.
    s = Geometry(facets([box((8, 0.5, -20), (10, 12, 20))]))
    ys = 1.25 + np.linspace(-0.02, 0.02, 41)
    level = np.array([abs(field(s, y)) for y in ys])
    assert np.abs(np.diff(level)).max() < 0.02


@pytest.mark.compiled(reason="minutes as plain Python")
def test_a_hidden_target_returns_over_the_edge_with_the_same_way_both_ways():
    wall = box((8, 0, -20), (8.5, 12, 20))
    f = facets([wall, box((19.9, 0.4, 0.0), (20.1, 0.6, 1.0))], role=[0, 2])
    hidden = point((20.0, 0.5, 0.5), 1.0, body=1)
    outside_beam, _ = solve(f, hidden, radar(), F, refinement(F, 0.5), 3)
    lit, _ = solve(f, hidden, radar(), F, refinement(F, 0.5), 3, diffraction=True)
    ranges = 0.5 * C0 * outside_beam.delay
    assert not ((ranges > 19) & (np.abs(outside_beam.amplitude) > 0) & (outside_beam.kind == 4).any(axis=1)).any()
    over = (lit.kind == DIFFRACT).any(axis=1)
    assert over.any()
    free = C0 / F / (4 * np.pi) ** 1.5 / (20.0**2 + 0.5**2)
    assert 0.0 < np.abs(lit.amplitude[over]).max() < 0.1 * free


@pytest.mark.parametrize("on", [0, 1])
def test_ends_on_an_edge_have_finite_legs(screen, on):
    ends = [np.array([0.0, 0.0, 0.0]), np.array([20.0, 0.0, 0.0])]
    ends[on] = np.array([10.0, 0.0, 0.0])
    legs = wedge_legs(screen, *ends, -1, K)
    assert all(np.isfinite([*leg.leaves, *leg.arrives]).all() and not leg.over for leg in legs)


def test_point_targets_on_edges_of_each_others_boxes_are_simulated():
    boxes = [
        rc.Body(
            name, shape="box", rcs_dbsm=level, rcs_point=(0.0, 0.0, 0.0), position=(x, 0.0, 0.0), velocity=(v, 0, 0)
        )
        for name, x, v, level in (("a", 2.0, 5.0, 20.0), ("b", 1.5, -5.0, -20.0))
    ]
    waveform = rc.Waveform(77e9, 1e9, 20e-6, 40e-6, 128, 256)
    run = rc.simulate(rc.Scene(boxes, radar=rc.Radar(waveform, position=(0.0, 0.0, 0.0))))
    assert run.detections.range.tolist() == pytest.approx([1.5], abs=0.05)
