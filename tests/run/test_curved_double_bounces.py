"""An echo over two curved surfaces is found, whatever the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

RADAR = {"position": [0, 0, 1], "waveform": {"bandwidth_mhz": 1000, "chirp_us": 30, "chirps": 32, "samples": 256}}
# Two cylinders that stand on the radar's height (radius, height, x, y), so that half of the bright spot is missing, and
# a plate.
CYLINDERS = (0.440169, 1.644006, 6.139403, 3.993767), (0.411718, 1.412136, 6.626357, -1.378890)
PLATE = {"shape": "plate", "params": {"width": 2.61188, "height": 1.676306}, "yaw_deg": 188.9378}


@pytest.mark.parametrize("tolerance", [0.5, 1.0, 2.0])
def test_an_echo_over_two_cylinders_is_found_at_half_the_length_of_its_path(tolerance):
    bodies = [
        rc.Body(name=f"c{i}", shape="cylinder", params={"radius": r, "height": h}, position=(x, y, 1.0))
        for i, (r, h, x, y) in enumerate(CYLINDERS)
    ]
    bodies.append(rc.Body(name="plate", position=(14.421079, 4.74773, 1.0), **PLATE))
    scene = rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": 3})
    found = rc.simulate(scene, tolerance_db=tolerance).detections
    # Of all ways over a point of either rim the shortest reflects at both.
    turn = np.linspace(-np.pi, np.pi, 2001)
    rim = [np.array([x, y]) + r * np.stack([np.cos(turn), np.sin(turn)], axis=1) for r, _, x, y in CYLINDERS]
    out = [np.linalg.norm(p, axis=1) for p in rim]
    length = out[0][:, None] + np.linalg.norm(rim[0][:, None] - rim[1], axis=2) + out[1]
    assert np.abs(found.range - 0.5 * length.min()).min() < 0.15


def test_an_echo_that_the_first_launch_hides_on_the_slope_of_another_is_found():
    """The first launch finds what a door of the car returns twice 8 dB too weak: no local maximum of its map."""
    wave = rc.Waveform(carrier=24e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=128)
    scene = rc.Scene(
        bodies=[rc.Body(name="car", shape="car", position=(10.473, 0.062, 0.0), yaw_deg=17.67)],
        radar=rc.Radar(wave, power=3.0, yaw_deg=1.83),
        model={"max_bounces": 2},
    )
    fine, coarse = (rc.simulate(scene, tolerance_db=t).detections for t in (0.5, 3.0))
    np.testing.assert_allclose(np.sort(coarse.range), np.sort(fine.range), atol=0.1)
