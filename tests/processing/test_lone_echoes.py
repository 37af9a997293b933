"""A lone echo is one detection whatever window and padding: its side lobes in coarse maps are no others."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc


@pytest.mark.parametrize("pad", [(1, 1), (2, 1), (1, 2)])
@pytest.mark.parametrize("window", ["rect", "taylor(20)"])
def test_a_lone_echo_is_one_detection(window, pad):
    rng = np.random.default_rng(5)
    wave = rc.Waveform(77e9, 300e6, 30e-6, n_chirps=64, n_samples=128)
    settings = rc.Processing(range_window=window, rate_window=window, pad=pad)
    for seed in range(20):
        place, rate = rng.uniform(12.0, 18.0), rng.uniform(-8.0, 8.0)
        ball = {"shape": "sphere", "params": {"radius": 0.05}, "rcs_dbsm": 50.0}
        body = rc.Body(name="ball", position=(place, 0.0, 0.5), velocity=(rate, 0.0, 0.0), **ball)
        found = rc.simulate(rc.Scene([body], radar=rc.Radar(wave, processing=settings)), seed=seed).detections
        assert found.rate == pytest.approx([rate], abs=0.05)
