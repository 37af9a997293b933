"""A pane whose reflection and transmission turn quickly with angle: large footprints bring what small ones do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import raychan as rc
from raychan.channel.paths import paths_of
from raychan.records import SCATTER
from raychan.run.rules import step_rule
from raychan.tracing.solver import launch_routes
from raychan.tracing.stats import Stats
from raychan.units import C0
from raychan.world.geometry import geometry_of

WAVE = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=30e-6, n_chirps=8, n_samples=64)
GLASS = rc.Material(name="pane", eps_r=6.5, sigma=0.3, thickness=0.005)


def behind_a_pane(yaw_deg: float, step: int) -> complex:
    """Sum of the echoes of a plate behind a tilted pane, of a launch of 0.25 dB made so many times half as coarse."""
    pane = rc.Body(
        "pane", shape="plate", params={"width": 1.2, "height": 1.4}, position=(1.6, 0.1, 1.0), yaw_deg=yaw_deg
    )
    back = {"width": 0.5, "height": 0.5}
    of = rc.Scene(
        bodies=[
            replace(pane, material="pane"),
            rc.Body("back", shape="plate", params=back, position=(2.6, 0.1, 0.8), yaw_deg=180.0),
        ],
        radar=rc.Radar(WAVE, (0, 0, 1.0), noise=False, antenna=rc.IsotropicAntenna(), power=1e6),
        model={"max_bounces": 1, "tolerance_db": 0.25},
        materials={"pane": GLASS},
    )
    geometry, rule = geometry_of(of, 0.25), step_rule(of.radar, of.processing, of.model, step)
    rule = replace(rule, refinement=replace(rule.refinement, floor=1e-9, relative=1e-6))
    total = 0j
    for routes in launch_routes(geometry, of.points(0.0), rule, Stats()):
        paths = paths_of(routes, geometry.facets, of.radar, WAVE.carrier)
        way = paths.trajectories
        hit = ((way.body == 1) & (way.kind == SCATTER)).any(axis=1)
        waves = paths.amplitude * np.exp(-2j * np.pi * WAVE.swept / C0 * paths.length)  # of the middle of the ramp
        total += waves[hit[paths.trajectory]].sum()
    return total


@pytest.mark.parametrize("yaw_deg", [170.0, 160.0, 145.0])
def test_what_a_plate_returns_through_a_pane_is_the_same_by_large_and_small_footprints(yaw_deg):
    assert abs(behind_a_pane(yaw_deg, 0) / behind_a_pane(yaw_deg, 3) - 1.0) < 0.01
