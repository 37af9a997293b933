"""Two plates one after the other: a coarse run finds the second one, past which rays of the first one go."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

AT = np.array([0.0, 0.0, 0.5])
WAVE = rc.Waveform(24.1e9, 0.6e9, 30e-6, n_chirps=8, n_samples=128)


def plate(name, size, aimed, at, ends):
    """Return a plate near `aimed` that, there, would mirror one of two ends into the other."""
    normal = sum((end - aimed) / np.linalg.norm(end - aimed) for end in ends)
    normal /= np.linalg.norm(normal)
    yaw, pitch = np.degrees(np.arctan2(normal[1], normal[0])), -np.degrees(np.arcsin(normal[2]))
    params = {"width": size, "height": size}
    return rc.Body(name=name, shape="plate", params=params, position=at, yaw_deg=yaw, pitch_deg=pitch)


def strongest(seed, tolerance):
    """Return the level of the strongest detection of a seeded pair of plates."""
    rng = np.random.default_rng(seed)
    one, two = np.array([4.0, 1.5, 0.5]), np.array([5.3, -1.0, 0.5])
    one, two = one + rng.uniform(-0.4, 0.4, 3), two + rng.uniform(-0.3, 0.3, 3)
    large = plate("large", 0.4, one, one + rng.uniform(-0.1, 0.1, 3), (AT, two))
    radar = rc.Radar(WAVE, position=AT, antenna=rc.IsotropicAntenna(), power=1.0, noise=False)
    made = rc.Scene(
        bodies=[large, plate("small", 0.15, two, two, (one, AT))],
        radar=radar,
        model={"max_bounces": 2, "tolerance_db": tolerance},
    )
    return rc.simulate(made, seed=1).detections.snr.max()


@pytest.mark.parametrize("seed", [8, 33, 60, 63])
def test_a_double_bounce_that_coarse_tubes_pass_has_the_level_of_a_fine_run(seed):
    assert strongest(seed, 2.0) == pytest.approx(strongest(seed, 0.1), abs=0.25)
