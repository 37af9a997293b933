"""An echo over two curved bodies is found, whatever the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc

RADAR = {"position": [0, 0, 1], "waveform": {"bandwidth_mhz": 1000, "chirp_us": 30, "chirps": 32, "samples": 256}}
# Two cylinders that stand on the radar's height (radius, height, x, y), so that half of the bright spot is missing, and
# a plate (width, height, x, y, yaw).
CASES = {
    501: ((0.49857, 1.56748, 9.351291, 0.474695), (0.444528, 1.992063, 6.586309, 2.631061)),
    505: ((0.440169, 1.644006, 6.139403, 3.993767), (0.411718, 1.412136, 6.626357, -1.378890)),
}
PLATES = {
    501: (1.304229, 1.725581, 11.677564, 3.495330, 157.5906),
    505: (2.61188, 1.676306, 14.421079, 4.74773, 188.9378),
}


@pytest.mark.parametrize("seed", CASES)
@pytest.mark.parametrize("tolerance", [0.5, 1.0, 2.0])
def test_an_echo_over_two_cylinders_is_found_at_half_the_length_of_its_path(seed, tolerance):
    bodies = [
        rc.Body(name=f"c{i}", shape="cylinder", params={"radius": r, "height": h}, position=(x, y, 1.0))
        for i, (r, h, x, y) in enumerate(CASES[seed])
    ]
    w, h, x, y, yaw = PLATES[seed]
    bodies.append(
        rc.Body(name="plate", shape="plate", params={"width": w, "height": h}, position=(x, y, 1.0), yaw_deg=yaw)
    )
    scene = rc.Scene(bodies=bodies, radar=RADAR, model={"max_bounces": 3})
    found = rc.simulate(scene, tolerance_db=tolerance).detections
    # Of all ways over a point of either rim the shortest reflects at both.
    turn = np.linspace(-np.pi, np.pi, 2001)
    rim = [np.array([x, y]) + r * np.stack([np.cos(turn), np.sin(turn)], axis=1) for r, _, x, y in CASES[seed]]
    out = [np.linalg.norm(p, axis=1) for p in rim]
    length = out[0][:, None] + np.linalg.norm(rim[0][:, None] - rim[1], axis=2) + out[1]
    assert np.abs(found.range - 0.5 * length.min()).min() < 0.15
