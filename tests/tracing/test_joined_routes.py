"""Joined batches of routes bring the same paths."""

from __future__ import annotations

import dataclasses

import numpy as np

import raychan as rc
from raychan.channel.paths import join, paths_of
from raychan.records import Routes
from raychan.tracing.joined_routes import joined


def _batches() -> tuple[rc.Scene, rc.SceneRoutes, list[Routes]]:
    bodies = [
        rc.Body("ground", shape="ground", material="asphalt"),
        rc.Body("box", shape="box", position=(6.0, 0.5, 0.0), velocity=(1.0, 2.0, 0.0)),
        rc.Body("ball", shape="sphere", params={"radius": 0.2}, position=(5.0, -1.0, 0.4)),
    ]
    radar = rc.Radar(rc.Waveform(24e9, 150e6, 30e-6, n_chirps=8, n_samples=32), (0.0, 0.0, 0.6))
    scene = rc.Scene(bodies, radar=radar, model={"max_bounces": 3})
    routes = rc.trace(scene, tolerance_db=3.0)
    return scene, routes, [b for b in routes.batches if isinstance(b, Routes) and len(b.kind)]


def test_joined_batches_bring_the_paths_of_each():
    scene, routes, batches = _batches()
    assert len({b.kind.shape[1] for b in batches}) > 1
    many = sum(len(b.kind) for b in batches)
    for most in (1, many // 3, many):
        some = joined(batches, most)
        assert sum(len(b.kind) for b in some) == many
        assert len(some) == (1 if most == many else len(batches) if most == 1 else len(some))
        one, other = (
            join([paths_of(b, routes.geometry.facets, scene.radar, 24e9) for b in x]) for x in (batches, some)
        )
        assert np.array_equal(one.length, other.length) and np.array_equal(one.amplitude, other.amplitude)
        assert np.array_equal(one.length_rate, other.length_rate)


def test_unused_slots_are_as_in_any_batch():
    _, _, batches = _batches()
    (one,) = joined(batches, 10**9)
    unused = one.kind == 0
    assert (one.body[unused] == -1).all() and (one.facet[unused] == -1).all() and not one.normals[unused].any()
    assert (one.vertices[unused] == one.rx).all()
    assert {f.name for f in dataclasses.fields(Routes)} == set(vars(one))
