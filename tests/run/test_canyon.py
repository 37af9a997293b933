"""Between two parallel walls a wave may meet each several times: images in a row stand for all of its ways."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

_WIDTH, _FAR = 3.0, 8.0


def _result(target: rc.Body, bounces: int) -> rc.Result:
    walls = [
        rc.Body(
            name=name,
            shape="plate",
            params={"width": 40.0, "height": 12.0},
            position=(20.0, side * _WIDTH / 2.0, 1.0),
            yaw_deg=-90.0 * side,
        )
        for name, side in (("left", 1.0), ("right", -1.0))
    ]
    wave = rc.Waveform(
        carrier=24e9, bandwidth=600e6, chirp_duration=30e-6, repetition=40e-6, n_chirps=16, n_samples=256
    )
    radar = rc.Radar(wave, position=(0.0, 0.0, 1.0), antenna=rc.IsotropicAntenna(front=True, polarization="V"))
    model = {"max_bounces": bounces, "tolerance_db": 1.0}
    return rc.simulate(rc.Scene(bodies=[target, *walls], radar=radar, model=model))


def _images(bounces: int) -> list[tuple[int, int]]:
    """Return by how many reflections ways go out and come back that meet so many surfaces at most, each of them as
    often as there are such ways: over either wall first."""
    pairs = [(a, b) for a in range(bounces) for b in range(bounces) if a + b < bounces]
    return [p for p in pairs for _ in range(2 ** sum(n > 0 for n in p))]


def _leg(reflections: int) -> float:
    return float(np.hypot(_FAR, reflections * _WIDTH))


@pytest.mark.parametrize("bounces", [4, 5])
def test_a_target_is_seen_over_all_images_and_each_falls_by_the_law_of_distances(bounces: int) -> None:
    point = rc.Body("target", shape="sphere", params={"radius": 0.01}, position=(_FAR, 0.0, 1.0), rcs_dbsm=10.0)
    paths = _result(point, bounces).paths
    rows = np.flatnonzero((paths.bodies == "target").any(axis=1))
    expected = sorted((_leg(a) + _leg(b), 1.0 / (_leg(a) * _leg(b))) for a, b in _images(bounces))
    found = np.array(sorted(zip(paths.length[rows], np.abs(paths.amplitude[rows]), strict=True)))
    assert found[:, 0] == pytest.approx([x for x, _ in expected], abs=1e-6)
    assert found[:, 1] / found[0, 1] == pytest.approx([x / expected[0][1] for _, x in expected], rel=1e-4)


def test_a_ball_is_as_strong_over_each_image_as_a_point_of_its_cross_section() -> None:
    ball = rc.Body("target", shape="sphere", params={"radius": 0.1, "max_sag": 1e-4}, position=(_FAR, 0.0, 1.0))
    paths = _result(ball, 4).paths
    names = [">".join(x for x in row if x) for row in paths.bodies]
    levels = {n: abs(paths.amplitude[[n == m for m in names]].sum()) for n in set(names)}
    for reflections, chain in enumerate(("target", "left>target", "left>right>target", "left>right>left>target")):
        far = _leg(reflections) - 0.1
        assert levels[chain] / levels["target"] == pytest.approx((_FAR - 0.1) / far, rel=0.03)
