"""Routes with their ends exchanged: the same wave."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

import raychan as rc
from raychan.channel.paths import paths_of
from raychan.channel.transfer import transfer
from raychan.poses import theta_phi
from raychan.run.rules import fine_rule
from raychan.tracing.contributions import Contributions
from raychan.tracing.images import Images
from raychan.tracing.legs import reachable
from raychan.tracing.shooting import numbered_routes
from raychan.tracing.solver import Launch, launch_routes
from raychan.tracing.sources import depth_of, legs_of
from raychan.tracing.stats import Stats
from raychan.tracing.ways import turned_round
from raychan.world.geometry import geometry_of

F = 24e9


def routes_of_a_scene():
    """Return the routes of tubes over ground, a pane, a ball and a box, from one place to another."""
    bodies = [
        rc.Body(name="ground", shape="ground", material="concrete"),
        rc.Body(name="box", shape="box", position=(6.0, 0.3, 0.4), yaw_deg=30.0,
                params={"length": 0.6, "width": 0.5, "height": 0.8}),
        rc.Body(name="ball", shape="sphere", params={"radius": 0.3}, position=(6.0, -0.8, 0.5)),
        rc.Body(name="pane", shape="plate", params={"width": 2.0}, material="glass", position=(3.0, 0.0, 0.6)),
    ]  # fmt: skip
    wave = rc.Waveform(F, 500e6, 15e-6, n_chirps=8, n_samples=64)
    radar = rc.Radar(wave, position=np.array([0.0, 0.0, 0.5]), rx_position=np.array([0.0, 2.0, 0.9]), noise=False)
    made = rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 3, "tolerance_db": 2.0})
    geometry = geometry_of(made)
    rule = fine_rule(radar, made.processing, made.model)
    every = launch_routes(geometry, made.points(0.0), rule, Stats())
    return geometry, [routes for routes in every if (routes.scatter >= 0).all()]


def basis(look):
    return np.stack(theta_phi(look), axis=1).astype(complex)


def test_routes_turned_round_twice_are_the_same_and_once_have_the_transposed_gains():
    geometry, batches = routes_of_a_scene()
    layers = 0
    for routes in batches:
        other = turned_round(routes)
        again = turned_round(other)
        for column in fields(routes):
            np.testing.assert_array_equal(getattr(again, column.name), getattr(routes, column.name), column.name)
        gains = [transfer(r, geometry.facets, F, basis, basis, corners=True) for r in (routes, other)]
        size = np.abs(gains[0]).max(axis=(1, 2, 3), initial=1e-300)[:, None, None, None]
        np.testing.assert_allclose(gains[1] / size, gains[0].transpose(0, 2, 1, 3) / size, atol=1e-9)
        layers = max(layers, int((routes.kind > 0).sum(axis=1).max(initial=0)))
    assert layers >= 3


def test_echoes_over_the_ground_and_straight_back_are_those_that_go_the_other_way():
    """A radar traces one of both; here both are traced, and each element of an array hears its own phase."""
    bodies = [
        rc.Body(name="ground", shape="ground", material="concrete"),
        rc.Body(name="ball", shape="sphere", params={"radius": 0.3}, position=(6.0, -0.8, 0.9)),
        rc.Body(name="other", shape="sphere", params={"radius": 0.5}, position=(7.0, 0.8, 0.5)),
    ]
    radar = rc.Radar(rc.Waveform(F, 500e6, 15e-6, n_chirps=8, n_samples=64), position=np.array([0.0, 0.0, 0.5]))
    made = rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 2, "tolerance_db": 0.2})
    geometry, rule = geometry_of(made), fine_rule(radar, made.processing, made.model)
    launch = Launch(geometry, made.points(0.0), rule)

    def heard(routes):
        paths = paths_of(routes, geometry.facets, radar, F)
        wave = 2.0 * np.pi * F / rc.units.C0
        return paths.amplitude.sum(), (paths.amplitude * np.exp(1j * wave * 0.01 * paths.arrival[:, 2])).sum()

    pair = {}
    for batch, source in launch.whole(Stats(), lambda routes: routes):
        legs, outs = legs_of(source)
        if (depth_of(source) == 1).all() and len(source) and {int(legs[0]), int(outs[0])} == {0, 1}:
            over_first = bool((batch.kind[:, 0] == rc.InteractionType.REFLECT).all())
            pair[over_first] = pair.get(over_first, 0.0) + np.array(heard(batch))
    over = launch.legs[1]
    found, images = Contributions(rule.refinement.for_depth(2)), Images.of(geometry, launch.legs, launch.legs)
    other = [
        heard(routes)
        for routes, depth, out in numbered_routes(
            geometry, over, launch.legs, images, reachable(geometry, over), 2, found, lambda r, d, o, _: (r, d, o)
        )
        if depth == 1 and out == 0
    ]
    assert set(pair) == {False, True}
    slow, size = np.sum(other, axis=0), np.abs(pair[True]).max()
    assert abs(pair[True][0] - pair[False][0]) < 1e-9 * size  # without elements both are one number
    assert np.abs(pair[True] - slow).max() < 0.02 * size
    assert abs(pair[False][1] - slow[1]) > 0.1 * size  # to an element they are not
