"""The channel of a monostatic radar: closed forms, moved scenes, exchange, nothing in view."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.facets import box, facets, ground, quad
from support.points import no_points, point, radar
from truth import slab, tworay

from raychan.poses import theta_phi
from raychan.records import HALF_SPACE, PEC
from raychan.run.solver import solve
from raychan.tracing.settings import refinement
from raychan.units import C0

F = 77e9
WAVE = C0 / F
K = 2 * np.pi / WAVE
ASPHALT = 3.18 - 0.1j


def test_a_target_of_given_rcs_obeys_the_radar_equation():
    f = facets([box((200, 0, 0), (201, 1, 1))])
    for distance, sigma in ((5.0, 1.0), (30.0, 0.3), (150.0, 20.0)):
        paths, _ = solve(f, point((distance, 0, 0.5), sigma), radar(), F, refinement(F, 0.5), 1)
        at = np.argmin(np.abs(paths.range - distance))
        power = np.abs(paths.amplitude[at]) ** 2
        assert 10 * np.log10(power / tworay.radar_power(distance, sigma, WAVE)) == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("polarization", [0, 1])
@pytest.mark.parametrize("distance", [2.5, 6.0, 13.5, 40.0, 120.0])
def test_a_target_over_ground_has_four_ways_of_closed_form_through_brewster(distance, polarization):
    f = facets([ground(1000.0)], [(HALF_SPACE, ASPHALT, 0.0, 0.0)], role=[1])
    target = (distance, 0.0, 0.9)
    paths, _ = solve(f, point(target, 1.0), radar(polarization=polarization), F, refinement(F, 0.5), 3)
    far = paths.delay > 2 * 1.2 / C0
    ways = np.array([1 / distance, 0.0])
    direct, over = np.hypot(distance, 0.4), np.hypot(distance, 1.4)
    grazing = 1.4 / over
    gamma = slab.half_space(grazing, ASPHALT)[1 - polarization]
    ways = np.exp(-1j * K * direct) / direct + gamma * np.exp(-1j * K * over) / over
    if polarization == 0:
        # V of each way seen in the target's own basis: the scatterer answers along the wave it meets.
        d, o = np.array([distance, 0, 0.4]) / direct, np.array([distance, 0, 1.4]) / over
        t_d, t_o = theta_phi(d[None])[0][0], theta_phi(o[None])[0][0]
        c = float(t_d @ t_o)
        a, b = np.exp(-1j * K * direct) / direct, gamma * np.exp(-1j * K * over) / over
        squared = a * a + 2 * a * b * c + b * b
    else:
        squared = ways**2
    expected = WAVE / (4 * np.pi) * np.sqrt(1 / (4 * np.pi)) * squared
    ratio = paths.amplitude[far].sum() / expected
    assert far.sum() == 4
    assert abs(20 * np.log10(abs(ratio))) < 0.01
    assert abs(np.angle(ratio)) < 0.01


def test_ground_below_the_radar_returns_as_its_image():
    f = facets([ground(1000.0)], [(HALF_SPACE, ASPHALT, 0.0, 0.0)], role=[1])
    paths, _ = solve(f, no_points(), radar(), F, refinement(F, 0.5), 3)
    fresnel = slab.half_space(1.0, ASPHALT)[0]
    assert paths.range == pytest.approx([0.5])
    assert np.abs(paths.amplitude) == pytest.approx([WAVE / (4 * np.pi) * abs(fresnel)], rel=1e-6)


def test_a_large_plate_returns_as_a_mirror():
    plate = quad([[8, -2, -2], [8, -2, 3], [8, 2, 3], [8, 2, -2]])
    paths, _ = solve(facets([plate]), no_points(), radar(), F, refinement(F, 0.2), 1)
    assert abs(paths.amplitude.sum()) == pytest.approx(WAVE / (4 * np.pi * 16.0), rel=0.03)


def scene_of_mirrors(t, v):
    wall = quad([[-5, 6, -1], [60, 6, -1], [60, 6, 8], [-5, 6, 8]])
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    ball.apply_translation((14, -1, 0.8))
    meshes = [ground(), wall, ball]
    for m, u in zip(meshes, v, strict=True):
        m.apply_translation(np.asarray(u) * t)
    rows = [(HALF_SPACE, ASPHALT, 0.0, 0.0), (PEC, 1.0, 0.0, 0.0), (PEC, 1.0, 0.0, 0.0)]
    return facets(meshes, rows, smooth=True, role=[1, 0, 0], velocity=v)


def test_range_rates_are_those_of_the_moved_scene():
    v = [(0, 0, 0), (0, -3, 0), (6, 2, 0)]
    own = np.array([7.0, 0.0, 0.0])
    dt = 1e-4

    def strongest(t):
        f = scene_of_mirrors(t, v)
        paths, _ = solve(f, no_points(), radar(np.array([0, 0, 0.5]) + own * t, own), F, refinement(F, 2.0), 1)
        seen = {}
        for chain in np.unique(paths.body, axis=0):
            rows = np.flatnonzero((paths.body == chain).all(axis=1))
            at = rows[np.argmax(np.abs(paths.amplitude[rows]))]
            power = np.abs(paths.amplitude[rows]) ** 2
            seen[tuple(chain.tolist())] = (
                (paths.range[rows] * power).sum() / power.sum(),
                (paths.range_rate[rows] * power).sum() / power.sum(),
                abs(paths.amplitude[at]),
            )
        return seen

    before, now, after = strongest(-dt), strongest(0.0), strongest(dt)
    ball_direct = tuple([2] + [-1] * (len(next(iter(now))) - 1))
    assert ball_direct in now
    moved = (after[ball_direct][0] - before[ball_direct][0]) / (2 * dt)
    # The tubes differ from frame to frame; their mean range is that of the same glint.
    assert moved == pytest.approx(now[ball_direct][1], abs=0.3)
    d = np.array([14, -1, 0.3]) / np.linalg.norm([14, -1, 0.3])
    assert now[ball_direct][1] == pytest.approx(float((np.array([6, 2, 0]) - own) @ d), abs=0.05)


def test_nothing_in_view_is_an_empty_record():
    f = facets([box((200, 0, 0), (201, 1, 1))])
    silent = radar()
    silent.tx_field = silent.rx_field = lambda look: np.zeros((len(look), 3), complex)
    paths, stats = solve(f, no_points(), silent, F, refinement(F, 0.5), 2)
    assert np.abs(paths.amplitude).sum() == 0.0
    assert stats.rays >= 0


def test_a_scene_ten_kilometres_away_is_the_same_scene():
    shift = np.array([10_000.0, -10_000.0, 0.0])
    meshes = [box((9, -1, 0.1), (13, 1, 1.5)), quad([[5, 6, -1], [40, 6, -1], [40, 6, 8], [5, 6, 8]])]
    here, _ = solve(facets(meshes), no_points(), radar(), F, refinement(F, 0.5), 3)
    for m in meshes:
        m.apply_translation(shift)
    there, _ = solve(facets(meshes), no_points(), radar(np.array([0, 0, 0.5]) + shift), F, refinement(F, 0.5), 3)
    a, b = here.amplitude.sum(), there.amplitude.sum()
    assert abs(20 * np.log10(abs(b / a))) < 0.01


def test_a_surface_drawn_twice_returns_once():
    def plate(half):
        return quad([[10, -half, -half], [10, -half, half], [10, half, half], [10, half, -half]])

    def level(meshes):
        paths, _ = solve(facets(meshes), no_points(), radar((0, 0, 0)), F, refinement(F, 0.2), 1)
        return 20 * np.log10(abs(paths.amplitude.sum()))

    alone = level([plate(0.5)])
    assert level([plate(0.5), plate(0.5)]) == pytest.approx(alone, abs=0.01)
    assert level([plate(0.5), plate(0.2)]) == pytest.approx(alone, abs=0.01)
