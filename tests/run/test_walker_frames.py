"""Frames of bodies that move in themselves: few tracings against tracing every chirp, and the labels of limbs."""

import dataclasses

import numpy as np
import pytest
from support.moving_frames import energy_db, every_chirp

import raychan as rc
from raychan.run import micro_doppler
from raychan.run.micro_doppler import retraced, stretches
from raychan.run.rules import fine_rule
from raychan.run.turning import bend, needed

WAVE = {"bandwidth_mhz": 150.0, "chirp_us": 30.0, "repetition_us": 500.0, "chirps": 24, "samples": 16}
RADAR = {"position": [0, 0, 1.0], "noise": False, "antenna": {"kind": "isotropic"}, "waveform": WAVE}


def scene(shape: str, wave: dict[str, float] = WAVE, **params: float) -> rc.Scene:
    who = rc.Body(name="who", shape=shape, position=(8.0, 0.5, 0.0), yaw_deg=165.0, params={"max_sag": 3e-3, **params})
    return rc.Scene(bodies=[who], radar={**RADAR, "waveform": wave}, model={"max_bounces": 1, "tolerance_db": 1.0})


@pytest.mark.parametrize("shape", ["walker", "cyclist"])
def test_few_tracings_give_the_samples_of_tracing_every_chirp(shape):
    given = scene(shape, phase=0.6)
    assert needed(given, "auto", 0.3) and bend(given, 0.3) > 1.0
    truth, rule = every_chirp(given)
    few = retraced(given, rule, given.model)
    assert len(few.times) < 8
    assert energy_db(few.samples - truth, truth) < max(10.0 * np.log10(few.level()) + 3.0, -20.0)
    parts = list(stretches(given, rule, given.model, 3))
    joined, error = (np.concatenate(x, axis=1) for x in zip(*parts, strict=True))
    assert joined.shape == truth.shape
    assert energy_db(joined - truth, truth) < max(energy_db(error, truth) + 3.0, -20.0)


def test_between_poses_of_six_tenths_of_a_millisecond_lengths_and_amplitudes_are_cubics(monkeypatch):
    given = scene("walker", wave={**WAVE, "repetition_us": 100.0, "chirps": 80})
    rule = fine_rule(given.radar, given.processing, given.model)

    def samples(between: float) -> np.ndarray:
        monkeypatch.setattr(micro_doppler, "_BETWEEN", between)
        return np.concatenate([part for part, _ in stretches(given, rule, given.model, 2)], axis=1)

    exact = samples(0.0)
    assert energy_db(samples(0.3e-3) - exact, exact) < -43.0
    assert energy_db(samples(0.6e-3) - exact, exact) < -40.0


def test_limbs_of_one_walker_are_one_target_in_labels():
    given = scene("walker")
    louder = rc.Scene(
        bodies=[rc.Body(name="who", shape="walker", position=(8.0, 0.5, 0.0), yaw_deg=165.0, params={"max_sag": 3e-3})],
        radar=dataclasses.replace(given.radar, noise=True, power=10.0),
        model={"max_bounces": 2, "tolerance_db": 3.0},
    )
    found = rc.simulate(louder)
    labels = {why.label for why in found.provenance if why.bodies.startswith("who.")}
    assert len(found.provenance) and labels == {"direct"}


def test_a_sequence_of_frames_goes_on_walking():
    first, second = rc.frames(scene("walker"), 2, 0.2)
    assert first.result.stats["tracings"] > 1
    ranges = [np.average(f.result.paths.range, weights=np.abs(f.result.paths.amplitude) ** 2) for f in (first, second)]
    assert ranges[1] - ranges[0] == pytest.approx(-0.28 * np.cos(np.radians(15.0)), abs=0.08)
