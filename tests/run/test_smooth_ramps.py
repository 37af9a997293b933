"""What is carried on over a frame from few instants is what is carried on chirp by chirp."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import raychan as rc
from raychan.run import micro_doppler
from raychan.run.carried_ramps import CarriedRamps
from raychan.run.instant import traced_at
from raychan.run.rules import fine_rule
from raychan.run.segments import Traced
from raychan.run.smooth_ramps import _slopes, _to_polynomials
from raychan.run.solver import solve_into
from raychan.run.turning import middle_chirp
from raychan.world.geometry import geometry_of

_WAVE = rc.Waveform(24e9, 300e6, 40e-6, 250e-6, n_chirps=72, n_samples=64)
_LINE = np.array([0.0, 1.0, 0.0]) * np.arange(4)[:, None] * _WAVE.wavelength
_TWO = np.array([[0.0, -0.05, 0.0], [0.0, 0.05, 0.0]])


def _scene(wave: rc.Waveform, speed: float, **radar: object) -> rc.Scene:
    bodies = [
        rc.Body("ground", shape="ground", material="asphalt"),
        rc.Body("plate", shape="plate", params={"width": 0.4, "height": 0.3}, position=(6.0, -0.5, 0.6), yaw_deg=180.0,
                velocity=(0.0, speed, 0.0)),
        rc.Body("ball", shape="sphere", params={"radius": 0.2}, position=(8.0, 2.0, 0.5), velocity=(1.0, -speed, 0.0)),
        rc.Body("point", shape="sphere", params={"radius": 0.05}, rcs_dbsm=5.0, position=(5.0, 1.0, 0.7),
                velocity=(0.0, speed, 0.0)),
    ]  # fmt: skip
    sensor = rc.Radar(wave, (0.0, 0.0, 0.7), noise=False, **radar)
    return rc.Scene(bodies, radar=sensor, model={"max_bounces": 2, "diffraction": False, "tolerance_db": 1.0})


@pytest.mark.parametrize(
    ("wave", "radar", "limit"),
    [
        ({}, {}, -90.0),
        ({"n_chirps": 24, "repetition": 750e-6}, {}, -90.0),
        ({"carrier": 77e9, "bandwidth": 1e9}, {}, -70.0),
        ({"complex_sampling": False}, {"elements": _LINE}, -90.0),
        ({}, {"elements": _LINE, "tx_elements": _TWO, "multiplexing": "tdm"}, -90.0),
        ({}, {"elements": _LINE, "tx_elements": _TWO, "multiplexing": "ddm"}, -90.0),
        ({}, {"elements": 20.0 * _LINE}, -90.0),
        ({}, {"elements": _LINE}, -90.0),
    ],
)
@pytest.mark.parametrize(("speed", "first"), [(8.0, 0), (15.0, 0), (15.0, 5)])
def test_few_instants_bring_what_every_chirp_brings(wave, radar, limit, speed, first):
    """The sum over chirps is the slow form; what the sweep turns off its middle the quick one has to first order."""
    scene = _scene(dataclasses.replace(_WAVE, **wave), speed, **radar)
    traced = traced_at(scene, scene.model)
    assert traced.carried is not None and traced.carried.tolist() == [body.name != "ground" for body in scene.bodies]
    rule = fine_rule(scene.radar, scene.processing, scene.model)
    geometry, paths, routes = geometry_of(traced.scene, 1.0, traced.time), [], []
    solve_into(
        paths.append, geometry, traced.scene.points(), traced.scene.radar, scene.radar.waveform.carrier, rule,
        keep=routes.append,
    )  # fmt: skip
    frame = micro_doppler._Frame(scene, rule, scene.model, None)
    frame.turns = frame.carried.turns = traced.carried
    key = frame.keyframe(middle_chirp(frame.chirps), Traced(micro_doppler.join(paths), tuple(routes)))
    slow = CarriedRamps(frame.radar, traced.carried).turning(key, first, frame.chirps - 1)[0]
    off = np.abs(frame.carried.turning(key, first, frame.chirps - 1)[0] - slow) ** 2
    level = 10.0 * np.log10(off.sum() / (np.abs(slow) ** 2).sum())
    assert level < limit


def test_polynomials_give_back_a_function_and_its_slope():
    u = -np.cos(np.pi * np.arange(9) / 8)
    factors = _to_polynomials(8) @ np.exp(0.5 * u)
    assert np.polynomial.chebyshev.chebval(0.3, factors) == pytest.approx(np.exp(0.15), rel=1e-9)
    assert _slopes(8) @ factors == pytest.approx(0.5 * np.exp(0.5 * u), rel=1e-6)
