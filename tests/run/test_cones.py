"""Tubes on a cone's side are cut to an end; seen nose-on, a cone is as physical optics has it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.units import C0


def test_cuts_of_a_cone_end_long_before_their_budget():
    mesh = trimesh.creation.cone(radius=0.0832463, height=0.24973889, sections=48)
    wave = rc.Waveform(24e9, 100e6, 40e-6, repetition=50e-6, n_chirps=16, n_samples=64)
    place = (7.9218693390050605, -2.728687595822761, -0.44384633236495963)
    cone = rc.Body(name="cone", mesh=mesh, material="pec", position=place, yaw_deg=171.8247129073439)
    antenna = rc.CosineAntenna(hpbw_h_deg=60.0, hpbw_v_deg=30.0)
    radar = rc.Radar(wave, power=1.4987276562041927, position=(0.0, 0.0, 1.079453114649978), antenna=antenna)
    result = rc.simulate(rc.Scene([cone], radar=radar, model={"max_bounces": 2, "tolerance_db": 1.0}))
    assert not [w for w in result.warnings if "coarser than the tolerance" in w]
    assert result.stats["tubes"] < 100_000 and np.isfinite(result.detections.error_db).all()


@pytest.mark.parametrize(("radius", "height", "sections"), [(0.05, 0.5, 100), (0.05, 0.5, 20), (0.1, 0.1, 40)])
def test_a_cone_seen_nose_on_is_that_of_physical_optics(radius, height, sections):
    """Test against S = k t^2 times the integral of z exp(-2j k z) along the axis, t = radius / height."""
    k, slope = 2.0 * np.pi * 24e9 / C0, radius / height
    end = np.exp(-2j * k * height)
    along = end * (0.5j * height / k + 0.25 / k**2) - 0.25 / k**2
    true = 4.0 * np.pi * abs(k * slope**2 * along) ** 2
    got = rc.rcs(trimesh.creation.cone(radius=radius, height=height, sections=sections), 24e9, 0.0, 90.0)
    off = abs(10.0 * np.log10(got.sigma.item() / true))
    assert off < min(got.error_db.item(), 100.0 / sections**2)  # facets lie off a cone by the square of their width
    assert got.error_db < 0.6
