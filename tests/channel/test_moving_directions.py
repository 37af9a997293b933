"""Directions and gains of routes at later instants are those of the same routes, traced then."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import raychan as rc
from raychan.channel.moving_directions import MovingDirections
from raychan.records import POINT, Routes
from raychan.run.solver import solve_into
from raychan.tracing.settings import PruneRule
from raychan.world.geometry import geometry_of

_LATE = 0.02  # s


def _traced(scene: rc.Scene, rule: PruneRule) -> tuple[Routes, MovingDirections]:
    """Return the routes of one launch over a scene, and their directions."""
    batches: list[Routes] = []
    geometry, rule = geometry_of(scene, 1.0), dataclasses.replace(rule, position=scene.radar.position)
    solve_into(lambda _: None, geometry, scene.points(), scene.radar, 24e9, rule, keep=batches.append)
    (routes,) = [b for b in batches if isinstance(b, Routes) and (b.kind == POINT).any()]
    return routes, MovingDirections.of(routes, geometry.facets, scene.radar)


def test_a_point_over_ground_is_seen_later_where_it_then_is_traced():
    """Directly and over the ground, by a radar that drives; the radar's antennas are narrow."""
    wave = rc.Waveform(24e9, 150e6, 30e-6, n_chirps=2, n_samples=32)
    antenna = rc.CosineAntenna(12.0, 16.0)
    radar = rc.Radar(wave, (0.0, 0.0, 0.7), antenna=antenna, velocity=(8.0, 0.0, 0.0), noise=False)
    bodies = [
        rc.Body("ground", shape="ground", material="pec"),
        rc.Body("point", shape="sphere", params={"radius": 0.01}, rcs_dbsm=0.0, position=(9.0, -0.4, 0.9),
                velocity=(0.0, 25.0, 0.0)),
    ]  # fmt: skip
    scene = rc.Scene(bodies, radar=radar, model={"max_bounces": 2, "retrace": 1, "diffraction": False})
    rule = rc.trace(scene).rule
    (before, now), (after, then) = _traced(scene, rule), _traced(scene.at(_LATE), rule)
    assert np.array_equal(before.kind, after.kind) and len(before.kind) >= 3
    assert now.place + _LATE * now.velocity == pytest.approx(then.place, abs=1e-5)
    here, there = (np.abs(antenna.field(_unit(x.place[:, 0]))[:, 0]) for x in (now, then))
    back, again = (np.abs(antenna.field(_unit(x.place[:, 1]))[:, 0]) for x in (now, then))
    gains = np.abs(now.gains(scene.radar, np.array([0.0, _LATE])))
    assert gains[0] == pytest.approx(1.0)
    assert gains[1] == pytest.approx(there * again / here / back, rel=2e-3) and gains[1].max() > 1.05


def _unit(x: np.ndarray) -> np.ndarray:
    return x / np.linalg.norm(x, axis=1, keepdims=True)
