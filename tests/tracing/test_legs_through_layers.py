"""Legs over mirrors through layers anywhere on the way: a layer of air takes nothing away, a pane what Fresnel says."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import trimesh

import raychan as rc
from raychan.records import POINT, REFLECT, TRANSMIT

WAVE = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=8, n_samples=256)
AIR = rc.Material(1.0001, 0.0, thickness=1e-3, name="air")
GLASS = rc.Material(6.3, 0.02, thickness=5e-3, name="glass")
RADAR = np.array([0.0, 0.0, 0.8])
SIZE = {"length": 8.0, "width": 0.2, "height": 4.0}
WALL = rc.Body(name="wall", shape="box", params=SIZE, position=(4.0, 2.6, 0.0), material="pec")


def pane(x, material, low=0.0, high=2.0, name="pane"):
    """Return an upright pane across the road."""
    corners = [[x, -1.5, low], [x, 1.5, low], [x, 1.5, high], [x, -1.5, high]]
    mesh = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    return rc.Body(name=name, mesh=mesh, material=material)


def floor(half):
    """Return a ground without end, or a square of that half side [m]."""
    if half is None:
        return rc.Body(name="ground", shape="ground", material="pec")
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half
    return rc.Body(name="ground", mesh=trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False), material="pec")


def target(kind):
    if kind == "point":
        return rc.Body(name="target", shape="sphere", params={"radius": 0.1}, position=(8, 0.2, 0.9), rcs_dbsm=-5.0)
    return rc.Body(name="target", shape="sphere", params={"radius": 0.3}, position=(8, 0.2, 0.9))


def found(bodies, bounces=3, rx=None, **model):
    """Return the result over some bodies, without noise."""
    antenna = rc.IsotropicAntenna(front=False)
    radar = rc.Radar(WAVE, position=tuple(RADAR), antenna=antenna, power=1.0, noise=False, rx_position=rx)
    return rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": bounces, **model}), seed=0)


def level(result, near=7.75):
    """Return the strongest detection [dBW] within a metre of a range [m]."""
    powers = [e.power for e in result.provenance if abs(e.range - near) < 1.2]
    return 10.0 * np.log10(max(powers))


def total(result, name="target"):
    """Return the sum of the powers of all paths over a body [dB], whatever their phases."""
    way, bodies = result.paths.trajectories, [b.name for b in result.scene.bodies]
    over = (way.body == bodies.index(name)).any(axis=1)[result.paths.trajectory]
    return 10.0 * np.log10((np.abs(result.paths.amplitude[over]) ** 2).sum())


@cache
def free_run(half, kind):
    return found([floor(half), target(kind)])


EVERY_PLACE = [(2.0, 0.0, 2.0), (0.1, 0.3, 2.0), (2.0, 0.0, 0.5), (6.5, 0.0, 0.5)]
SOME_PLACES = [(0.1, 0.3, 2.0), (6.5, 0.0, 0.5)]


@pytest.mark.parametrize(
    ("half", "kind", "x", "low", "high"),
    [
        *((None, kind, *place) for kind in ("sphere", "point") for place in EVERY_PLACE),
        *((20.0, "point", *place) for place in SOME_PLACES),
    ],
)
def test_a_layer_of_air_changes_nothing(half, kind, x, low, high):
    """Before the radar, before the ground, behind it: over the straight way or the one over the ground alone."""
    free, behind = free_run(half, kind), found([floor(half), target(kind), pane(x, AIR, low, high)])
    assert level(behind) == pytest.approx(level(free), abs=0.05)
    if kind == "point":
        assert total(behind) == pytest.approx(total(free), abs=1e-3)


@pytest.mark.parametrize("mode", ["auto", "preview"])
def test_other_modes_see_through_it_too(mode):
    bodies = [floor(None), target("sphere")]
    free, behind = found(bodies, mode=mode), found([*bodies, pane(2.0, AIR)], mode=mode)
    assert level(behind) == pytest.approx(level(free), abs=0.05)


def test_layers_on_every_stretch_between_two_mirrors():
    """Over a wall and the ground, through a layer before, between and behind them."""
    bodies = [floor(None), WALL, target("point")]
    sheets = [pane(1.0, AIR, name="a"), pane(6.9, AIR, name="b")]
    free, behind = found(bodies, 5), found([*bodies, *sheets], 5)
    assert total(behind) == pytest.approx(total(free), abs=1e-3)
    way = behind.paths.trajectories
    assert ((way.kind == TRANSMIT).sum(axis=1) >= 4).any()


def test_as_many_layers_as_are_allowed_are_passed_on_each_stretch_and_in_all_on_a_specular_path():
    one, two = [pane(2.0, AIR)], [pane(2.0, AIR), pane(4.0, AIR, name="more")]
    passed = []
    for panes in (one, two):
        way = found([target("point"), *panes], max_transmissions=1).paths.trajectories
        passed.append((way.kind == TRANSMIT)[(way.kind == POINT).any(axis=1)].sum(axis=1).tolist())
    assert passed == [[2], []]
    ends = (0.0, 0.0, 0.8), (6.0, 0.2, 0.9)
    exact = [
        rc.specular_paths(rc.Scene(bodies=panes, frequency=77e9, model={"max_transmissions": 1}), *ends, 0)
        for panes in (one, two)
    ]
    assert [len(paths.length) for paths in exact] == [1, 0]


@pytest.mark.parametrize("receiver", [(8.0, 0.2, 0.9), (7.0, -0.4, 0.3)])
def test_the_way_to_a_receiver_through_a_pane_is_the_specular_one(receiver):
    bodies = [rc.Body(name="ground", shape="ground", material="asphalt"), pane(2.0, GLASS, 0.0, 0.7)]
    own = found(bodies, 2, rx=receiver).paths
    exact = rc.specular_paths(rc.Scene(bodies=bodies, frequency=WAVE.carrier), tuple(RADAR), receiver, 1)
    kinds = own.trajectories.kind[own.trajectory]
    specular = np.isin(kinds, (0, REFLECT, TRANSMIT)).all(axis=1)
    seen = {bool((k == REFLECT).any()): abs(a) for k, a in zip(kinds[specular], own.amplitude[specular], strict=True)}
    expected = {"ground" in list(b): abs(g[0, 0]) for b, g in zip(exact.bodies, exact.gain, strict=True)}
    assert specular.sum() == len(expected) == 2
    assert seen[True] / seen[False] == pytest.approx(expected[True] / expected[False], rel=0.01)
    assert any((np.asarray(b) == "pane").any() for b in exact.bodies)


def test_the_way_through_layers_is_as_long_as_its_path():
    """Its vertices lie on it in order: their distances add up to the length."""
    result = found([floor(None), WALL, target("sphere"), pane(1.0, AIR, name="a"), pane(6.9, AIR, name="b")], 3)
    paths = result.paths
    way = paths.trajectories
    stops = np.concatenate(
        [np.broadcast_to(RADAR, (len(way.kind), 1, 3)), way.vertices, np.broadcast_to(RADAR, (len(way.kind), 1, 3))],
        axis=1,
    )
    length = np.linalg.norm(np.diff(stops, axis=1), axis=2).sum(axis=1)
    through = ((way.kind == TRANSMIT).sum(axis=1) >= 2)[paths.trajectory]
    assert through.sum() > 100
    strong = through & (np.abs(paths.amplitude) > 1e-3 * np.abs(paths.amplitude).max())
    assert strong.any()
    assert np.abs(length[paths.trajectory] - paths.length)[strong].max() < 0.15


def test_the_ground_below_returns_through_a_layer():
    sheet = trimesh.Trimesh(
        [[-1, -1, 0.4], [1, -1, 0.4], [1, 1, 0.4], [-1, 1, 0.4]], [[0, 1, 2], [0, 2, 3]], process=False
    )
    free = found([floor(None)], 2).paths
    behind = found([floor(None), rc.Body(name="sheet", mesh=sheet, material=AIR)], 2).paths
    below = np.isclose(behind.length, 1.6) & (behind.trajectories.kind == TRANSMIT).any(axis=1)[behind.trajectory]
    assert len(free.length) == 1
    assert np.abs(behind.amplitude[below]).sum() == pytest.approx(np.abs(free.amplitude).sum(), rel=1e-4)
    assert (behind.trajectories.kind[behind.trajectory[below]] == TRANSMIT).sum() == 2


@pytest.mark.parametrize("covered", [False, True])
def test_the_ground_right_below_returns_by_one_bounce_already(covered):
    """No leg over it leads on then; through a layer, as without."""
    bodies = [floor(None)]
    if covered:
        corners = np.array([[-1, -1, 0.3], [1, -1, 0.3], [1, 1, 0.3], [-1, 1, 0.3]])
        cover = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
        bodies.append(rc.Body(name="cover", mesh=cover, material=GLASS))
    sent = []
    for bounces in (1, 2):
        paths = found(bodies, bounces).paths
        down = (paths.kind == REFLECT).sum(axis=1) == 1
        down &= np.abs(paths.length - 1.6) < 1e-9
        assert down.sum() == 1
        sent.append(complex(paths.amplitude[down].item()))
    assert sent[0] == sent[1] != 0.0


def test_the_ground_on_the_way_to_a_receiver_elsewhere_is_one_bounce():
    """Line of sight, and over the ground."""
    lengths = [np.sort(found([floor(None)], bounces, rx=(5.0, 0.0, 0.8)).paths.length) for bounces in (1, 2)]
    assert lengths[0] == pytest.approx([5.0, np.hypot(5.0, 1.6)])
    assert np.array_equal(*lengths)
