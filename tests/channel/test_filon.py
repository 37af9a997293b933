"""Filon's rule over footprints: what it gives of a product of phases is the phase integral of their sum."""

import numpy as np
import pytest

import raychan as rc
from raychan.channel.filon import filon, points_over
from raychan.channel.paths import join, paths_of
from raychan.em.phase_integral import quadratic_means
from raychan.signal.baseband import synthesize
from raychan.units import C0


@pytest.mark.parametrize("part", [1e-2, 1e-3, 1e-5])
def test_rule_gives_the_phase_integral_of_both_phases(part):
    rng, n = np.random.default_rng(1), 60
    corner = rng.uniform(-1.0, 1.0, (n, 3)) * 10.0 ** rng.uniform(-1.0, 2.5, (n, 1))
    bend = rng.normal(size=(n, 3)) * 10.0 ** rng.uniform(-1.0, 1.0, (n, 1))
    phases = np.concatenate([corner, 0.5 * (corner + corner[:, [1, 2, 0]]) + bend], axis=1)
    turn = rng.uniform(-1.0, 1.0, (n, 3)) * 10.0 ** rng.uniform(-1.0, 1.6, (n, 1))
    run = np.abs(turn - turn[:, [1, 2, 0]])
    limit = np.full(n, part)
    count = points_over(run, limit)
    bary, weight = filon(phases, run, limit, count)
    row = np.repeat(np.arange(n), count)
    seen = weight * np.exp(-1j * (bary * turn[row]).sum(axis=1))
    found = np.bincount(row, seen.real, n) + 1j * np.bincount(row, seen.imag, n)
    middles = 0.5 * (turn + turn[:, [1, 2, 0]])
    truth = quadratic_means(phases + np.concatenate([turn, middles], axis=1), 1e-6)
    assert bary.min() >= 0.0 and np.allclose(bary.sum(axis=1), 1.0)
    assert np.abs(found - truth).max() < part


def test_one_point_of_no_run_is_the_phase_integral():
    phases = np.array([[0.3, 7.0, -40.0, 2.0, -16.0, -20.0]])
    none, part = np.zeros((1, 3)), np.full(1, 1e-3)
    assert points_over(none, part) == 1
    weight = filon(phases, none, part, np.ones(1, np.int64))[1]
    assert weight == pytest.approx(quadratic_means(phases, 1e-6), abs=1e-6)


@pytest.mark.parametrize("tilt, width", [(22.0, 0.127), (-12.0, 0.25)], ids=["narrow", "wide"])
def test_receivers_far_apart_see_the_sum_over_the_points_of_a_tilted_plate(tilt, width):
    far, height, yaw = 2.264, 0.111, np.radians(180.0 - tilt)
    y, z = np.linspace(-0.68, 0.68, 5), np.linspace(-0.34, 0.34, 4)
    elements = [(0.0, a, b) for a in y for b in z]
    wave = rc.Waveform(77e9 - 75e6, 150e6, 40e-6, n_chirps=2, n_samples=64)
    size = {"width": width, "height": height}
    plate = rc.Body("plate", shape="plate", params=size, position=(far, 0, 0), yaw_deg=180.0 - tilt)
    radar = rc.Radar(wave, position=(0, 0, 0), elements=elements, power=0.016)
    routes = rc.trace(rc.Scene(bodies=[plate], radar=radar, model={"max_bounces": 1, "tolerance_db": 1.0}))
    batches, facets = routes.batches, routes.geometry.facets
    paths = join([paths_of(b, facets, radar, wave.carrier, routes.noise) for b in batches])
    seen = synthesize(paths, radar).samples[:, 0, 32]
    u, v = ((np.arange(300) + 0.5) / 300.0 - 0.5) * width, ((np.arange(150) + 0.5) / 150.0 - 0.5) * height
    over, up = np.meshgrid(u, v)
    points = np.stack([far - over * np.sin(yaw), over * np.cos(yaw), up], axis=-1).reshape(-1, 3)
    own = np.linalg.norm(points, axis=1)
    back = np.linalg.norm(points - np.array(elements)[:, None], axis=2)
    truth = (np.exp(-2j * np.pi * 77e9 / C0 * (own + back)) / (own * back)).sum(axis=1)
    # One factor for all: gains and obliquity, which differ little over so small a plate.
    truth = truth * np.vdot(truth, seen) / np.vdot(truth, truth)
    assert np.linalg.norm(seen - truth) < 0.1 * np.linalg.norm(truth)
