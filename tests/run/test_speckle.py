"""Speckle: levels of several echoes in one cell move with their bodies as their phasors do."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from support.results import WAVE, paths

from raychan.kinds import InteractionType
from raychan.run.point_spread import PointSpread
from raychan.run.speckle import SHIFT, spreads_db
from raychan.units import C0

RESPONSE = PointSpread(WAVE, "hann", "hann")
SCATTER = int(InteractionType.SCATTER)


def bodies_at(*middles):
    role = np.zeros(len(middles), np.int8)
    extents = np.repeat(np.array(middles, float)[:, None], 2, axis=1)
    return SimpleNamespace(facets=SimpleNamespace(role=role), extents=extents)


def test_two_equal_echoes_move_as_two_phasors():
    found = paths([10.0, 10.0], [0.0, 0.0], [1.0, 1.0], [[(1, SCATTER)], [(2, SCATTER)]])
    geometry = bodies_at((0, 0, 0), (10.0, 0.1, 0.5), (10.0, 0.2, 0.5), (0, 0, 0))
    spread = spreads_db(found, geometry, RESPONSE, np.array([[10.0, 0.0, 1.0]]), WAVE.carrier)[0]
    rng = np.random.default_rng(0)
    rng.standard_normal((20, 4, 3))
    shift = SHIFT * rng.standard_normal((20, 4, 3))[:, 1:3]
    towards = geometry.extents[1:3, 0] / np.linalg.norm(geometry.extents[1:3, 0], axis=1, keepdims=True)
    waves = np.exp(-4j * np.pi * WAVE.carrier / C0 * np.einsum("kbi,bi->kb", shift, towards))
    assert spread == pytest.approx(np.std(20.0 * np.log10(np.abs(waves.sum(axis=1)))), rel=2e-2)


def test_one_echo_does_not_move():
    found = paths([10.0], [0.0], [1.0], [[(1, SCATTER)]])
    geometry = bodies_at((0, 0, 0), (10.0, 0.1, 0.5), (0, 0, 0), (0, 0, 0))
    assert spreads_db(found, geometry, RESPONSE, np.array([[10.0, 0.0, 1.0]]), WAVE.carrier)[0] < 1e-9


def test_two_echoes_of_one_body_move_by_its_turn_only():
    """Shifts move both alike; about the middle, 0.1 m apart across the view, a turn changes their difference."""
    found = paths([10.0, 10.0], [0.0, 0.0], [1.0, 1.0], [[(1, SCATTER)], [(1, SCATTER)]])
    geometry = bodies_at((0, 0, 0), (10.0, 0.1, 0.5), (0, 0, 0), (0, 0, 0))
    assert spreads_db(found, geometry, RESPONSE, np.array([[10.0, 0.0, 1.0]]), WAVE.carrier)[0] < 1e-6


def test_mirrors_stay():
    found = paths([10.0, 10.0], [0.0, 0.0], [1.0, 1.0], [[(1, SCATTER)], [(2, SCATTER)]])
    geometry = bodies_at((0, 0, 0), (10.0, 0.1, 0.5), (10.0, 0.2, 0.5), (0, 0, 0))
    geometry.facets.role[:] = 1
    assert spreads_db(found, geometry, RESPONSE, np.array([[10.0, 0.0, 1.0]]), WAVE.carrier)[0] < 1e-9
