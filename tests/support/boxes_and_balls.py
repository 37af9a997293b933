"""A random scene of boxes and balls that stand apart on a ground: echoes of one, two and three bounces."""

from __future__ import annotations

import numpy as np

import raychan as rc

WAVEFORM = {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 32, "samples": 64}
_PLACES = [(x, y) for x in (5.0, 8.5, 12.0) for y in (-3.5, 0.0, 3.5)]


def scene_of(seed: int, **model: object) -> rc.Scene:
    """Return the scene of a seed, with keys of its table [model]."""
    rng = np.random.default_rng(seed)
    places = np.array(_PLACES)[rng.permutation(len(_PLACES))[:6]] + rng.uniform(-0.4, 0.4, (6, 2))
    bodies = [rc.Body("ground", shape="ground", params={"size": 60.0})]
    for i, at in enumerate(places):
        motion = {"velocity": (float(rng.uniform(-5, 5)), 0.0, 0.0)}
        if i < 3:
            size = dict(zip(("length", "width", "height"), map(float, rng.uniform(0.6, 1.6, 3)), strict=True))
            yaw = float(rng.uniform(0, 90))
            bodies.append(rc.Body(f"box_{i}", shape="box", params=size, position=(*at, 0.0), yaw_deg=yaw, **motion))
        else:
            bodies.append(rc.Body(f"ball_{i}", shape="sphere", params={"radius": 0.4}, position=(*at, 0.6), **motion))
    radar = {"waveform": WAVEFORM, "position": (0, 0, 0.6), "power_dbm": 20.0}
    return rc.Scene(bodies=bodies, radar=radar, model=model)
