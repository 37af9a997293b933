"""The waves of paths at both ends, by a compiled loop and step by step."""

from __future__ import annotations

import numpy as np
import pytest

from raychan.radar.array import wavefronts
from raychan.records import DIFFUSE, POINT, REFLECT, SCATTER, TRANSMIT, Paths
from raychan.signal.fronts import fronts_of


def random_paths(n: int, seed: int, parts: bool) -> Paths:
    """Return paths over up to four interactions, of which one scatters as a rule."""
    rng = np.random.default_rng(seed)
    tx, rx, slots = rng.normal(size=3), rng.normal(size=3), 4
    kind = rng.choice([REFLECT, TRANSMIT], (n, slots)).astype(np.int8)
    used = rng.integers(0, slots + 1, n)
    kind[np.arange(slots) >= used[:, None]] = 0
    some = np.flatnonzero(used)[: 3 * n // 4]
    kind[some, rng.integers(0, used[some])] = rng.choice([SCATTER, POINT, DIFFUSE], len(some))
    vertices = np.where((kind > 0)[:, :, None], 10.0 * rng.normal(size=(n, slots, 3)), rx).astype(np.float32)
    looks = [x / np.linalg.norm(x, axis=1, keepdims=True) for x in rng.normal(size=(2, n, 3))]
    aside = rng.normal(size=(n, 2, 3)) * (rng.random((n, 1, 1)) < 0.5) if parts else np.zeros((n, 0, 3))
    return Paths.of(
        length=rng.uniform(1.0, 50.0, n), length_rate=np.zeros(n), amplitude=np.ones(n, complex), departure=looks[0],
        arrival=looks[1], body=np.zeros((n, slots), np.int16), part=np.zeros((n, slots), np.int16), kind=kind,
        vertices=vertices, aside=aside.astype(np.float32), body_names=("body",), part_names=("",), tx=tx, rx=rx,
    )  # fmt: skip


@pytest.mark.parametrize("parts", [False, True])
def test_they_are_those_of_the_way_from_the_scatterer_to_each_end(parts):
    paths = random_paths(500, 1, parts)
    met, n = paths.trajectories, len(paths.length)
    scatters = np.isin(met.kind, [SCATTER, POINT, DIFFUSE])
    slot = np.where(scatters.any(axis=1), scatters.argmax(axis=1), -1)
    assert (slot < 0).any() and (slot > 0).any()
    ends = (np.broadcast_to(x, (n, 1, 3)) for x in (paths.tx, paths.rx))
    stops = np.concatenate([next(ends), met.vertices.astype(float), next(ends)], axis=1)
    slow = wavefronts(stops, slot, met.departure.astype(float), met.arrival, paths.length)
    if parts:
        rows = np.flatnonzero(paths.aside.any(axis=(1, 2)))
        slow = slow.moved(rows, paths.aside[rows].astype(float))
    fast = fronts_of(paths)
    for name in ("arrival", "radius", "departure", "tx_radius", "bare"):
        np.testing.assert_allclose(getattr(fast, name), getattr(slow, name), rtol=1e-12, atol=1e-12)
