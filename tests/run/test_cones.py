"""Tubes on a cone's side, where normals meet in one point, are cut to an end."""

from __future__ import annotations

import numpy as np
import trimesh

import raychan as rc


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
