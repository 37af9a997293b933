"""Legs over several mirrors: none is missing over which a ray comes, be it over one mirror twice."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import raychan as rc
from raychan.tracing.legs import Leg, legs_over, planes_that_mirror
from raychan.tracing.mirrors import Mirror
from raychan.world.geometry import geometry_of

_BOUNCES = 3
_POINTS = 2000


def _plates(rng: np.random.Generator) -> rc.Scene:
    """Return four plates about the radar, two of them opposite to each other, one of glass, and a box, of which it sees
    the front only."""
    wave = rc.Waveform(24e9, 500e6, 15e-6, n_chirps=8, n_samples=64)
    bodies = []
    for k, angle in enumerate([0.0, 180.0, *rng.uniform(0.0, 360.0, 2)]):
        place = rng.uniform(2.0, 4.0) * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        size = {"width": rng.uniform(2.0, 5.0), "height": rng.uniform(2.0, 5.0)}
        yaw, pitch = angle + 180.0 + rng.uniform(-8.0, 8.0), rng.uniform(-8.0, 8.0)
        material = "car_glass" if k == 1 else None
        bodies.append(
            rc.Body(
                f"p{k}", shape="plate", params=size, position=place, yaw_deg=yaw, pitch_deg=pitch, material=material
            )
        )
    box, place = {"length": 0.8, "width": 1.0, "height": 1.2}, (1.2, 0.4, 0.0)
    bodies.append(rc.Body("box", shape="box", params=box, position=place, yaw_deg=rng.uniform(0.0, 90.0)))
    return rc.Scene(bodies=bodies, radar=rc.Radar(wave, position=(0.0, 0.0, 0.0)))


def _comes(end: np.ndarray, chain: tuple[Mirror, ...], points: np.ndarray) -> np.ndarray:
    """Tell to which points (n, 3) a ray comes over mirrors, by plain vectors."""
    images = [end]
    for m in chain:
        images.append(m.image(images[-1]))
    x, ok = points, np.ones(len(points), bool)
    for m, before, image in zip(chain[::-1], images[-2::-1], images[:0:-1], strict=True):
        height, depth = (x - m.point) @ m.normal, (before - m.point) @ m.normal
        ok &= (height > 1e-6) & (depth > 1e-6)
        t = depth / np.where(ok, height + depth, 1.0)
        x = image + t[:, None] * (x - image)
        on = x @ m.axes.T
        ok &= ((on > m.low) & (on < m.high)).all(axis=1)
    return ok


@pytest.mark.parametrize("seed", range(6))
def test_no_chain_of_mirrors_is_missing_over_which_a_ray_comes_to_a_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    geometry, end = geometry_of(_plates(rng)), np.zeros(3)
    there = {leg.mirrors for leg in legs_over(geometry, end, _BOUNCES)}
    points = rng.uniform(-4.0, 4.0, (_POINTS, 3))
    lit, away = (planes_that_mirror(geometry, end, x) for x in (False, True))
    mirrors = [*lit, *(m.turned() for m in lit if geometry.both_sides[m.facet]), *away]
    twice, behind, missing = 0, 0, list[str]()
    own = {(m.facet, tuple(m.normal)): m for leg in there for m in leg}
    for count in range(1, _BOUNCES + 1):
        for chain in product(mirrors, repeat=count):
            known = tuple(own.get((m.facet, tuple(m.normal)), m) for m in chain)
            if _comes(end, chain, points).any():
                twice += len({m.facet for m in chain}) < count
                behind += any(m in away for m in chain)
                missing += [" > ".join(str(m.body) for m in chain)] if known not in there else []
    assert missing == []
    assert twice > 0 and behind > 0


def test_a_wave_does_not_meet_the_plane_again_that_it_has_just_left() -> None:
    geometry = geometry_of(_plates(np.random.default_rng(0)))
    for leg in legs_over(geometry, np.zeros(3), _BOUNCES):
        assert all(a.facet != b.facet for a, b in zip(leg.mirrors, leg.mirrors[1:], strict=False))


def test_no_leg_is_kept_to_whose_last_mirror_no_ray_runs_over_the_others() -> None:
    geometry = geometry_of(_plates(np.random.default_rng(1)))
    for leg in legs_over(geometry, np.zeros(3), _BOUNCES):
        if len(leg.mirrors) > 1:
            m = leg.mirrors[-1]
            before = Leg(end=leg.end, mirrors=leg.mirrors[:-1])
            u, v = (x.ravel() for x in np.meshgrid(*(np.linspace(m.low[k], m.high[k], 200) for k in (0, 1))))
            spots = (
                m.point + np.outer(u - m.axes[0] @ m.point, m.axes[0]) + np.outer(v - m.axes[1] @ m.point, m.axes[1])
            )
            assert _comes(before.end, before.mirrors, spots).any()
