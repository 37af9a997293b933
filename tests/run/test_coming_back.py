"""Waves that a limit on bounces ends just before they come back are told, as no ratio of what was traced tells them."""

import numpy as np
import pytest

import raychan as rc
from raychan.run.ledger_entry import SEEN


def run(shape, bounces, yaw=0.0, height=0.4, alone=False, material=None, power=0.01, **params):
    corner = rc.Body(
        name="corner", shape=shape, params=params, position=(8.0, 0.3, height), yaw_deg=180.0 + yaw, material=material
    )
    ball = rc.Body(name="ball", shape="sphere", params={"radius": 0.3}, position=(4.0, -0.3, 0.4))
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=64)
    model = {"max_bounces": bounces, "tolerance_db": 1.0}
    bodies = [corner] if alone else [corner, ball]
    return rc.simulate(rc.Scene(bodies=bodies, radar=rc.Radar(waveform=wave, power=power), model=model))


def told(result):
    return [line for line in result.warnings if "of unknown level" in line]


@pytest.mark.parametrize("yaw", [-15.0, 0.0, 20.0])
def test_a_trihedral_with_two_bounces_is_told_as_it_comes_back_by_three(yaw):
    short, whole = run("trihedral", 2, yaw, size=0.12), run("trihedral", 3, yaw, size=0.12)
    assert whole.detections.snr.max() > 35.0 and np.abs(whole.detections.range - 8.0).min() < 0.1
    assert np.abs(short.detections.range - 8.0).min() > 1.0
    assert short.ledger["further bounces"].kind == SEEN
    assert told(short) == [
        "left out, of unknown level: further bounces: waves over corner come back by 3 interactions (model.max_bounces)"
    ]
    assert told(whole) == []


def test_a_corner_alone_is_told_though_nothing_is_detected():
    short, whole = (run("trihedral", n, height=0.7, alone=True, size=0.15) for n in (2, 3))
    assert not len(short.detections.range) and np.abs(whole.detections.range - 8.0).min() < 0.1
    assert len(told(short)) == 1 and "waves over corner come back by 3 interactions" in told(short)[0]


@pytest.mark.parametrize(("shape", "bounces"), [("dihedral", 2), ("trihedral", 3)])
def test_a_corner_of_thin_glass_is_told_by_one_bounce_too_few_and_not_by_enough(shape, bounces):
    thin = {"height": 0.5, "alone": True, "material": "car_glass", "power": 1.0, "size": 0.2}
    short, whole = run(shape, bounces - 1, **thin), run(shape, bounces, **thin)
    assert whole.detections.snr.max(initial=0.0) > 20.0
    assert f"waves over corner come back by {bounces} interactions" in told(short)[0]
    assert told(whole) == []


@pytest.mark.parametrize("shape", ["dihedral", "trihedral"])
def test_a_corner_behind_a_pane_is_told_as_without_it(shape):
    bounces = {"dihedral": 1, "trihedral": 2}[shape]
    pane = rc.Body(
        name="pane", shape="plate", params={"width": 2.0, "height": 2.0}, position=(1.0, 0.0, 0.5), yaw_deg=160.0,
        material="car_glass",
    )  # fmt: skip
    corner = rc.Body(name="corner", shape=shape, params={"size": 0.2}, position=(8.0, 0.0, 0.5), yaw_deg=180.0)
    wave = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=40e-6, n_chirps=16, n_samples=64)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.5))
    scene = rc.Scene(bodies=[pane, corner], radar=radar, model={"max_bounces": bounces, "tolerance_db": 1.0})
    assert f"come back by {bounces + 1} interactions" in told(rc.simulate(scene))[0]


@pytest.mark.parametrize("bounces", [2, 3])
def test_bodies_that_send_nothing_back_are_not_told(bounces):
    assert told(run("box", bounces, 30.0)) == told(run("dihedral", bounces, size=0.2)) == []


def test_a_dihedral_with_one_bounce_is_told_as_it_comes_back_by_two():
    assert "over corner come back by 2 interactions" in told(run("dihedral", 1, height=0.5, size=0.2))[0]
    assert told(run("plate", 1, alone=True)) == told(run("sphere", 1, alone=True)) == []


def beside(shape, bounces, **params):
    """Return a run with the receiver a few centimetres beside the transmitter, at 24 GHz."""
    body = rc.Body(name="body", shape=shape, params=params, position=(4.0, 0.2, 0.5), yaw_deg=170.0)
    wave = rc.Waveform(carrier=24.1e9, bandwidth=1e9, chirp_duration=30e-6, n_chirps=16, n_samples=128)
    radar = rc.Radar(wave, position=(0, 0, 0.5), rx_position=(0.05, 0.12, 0.52), power=5.0)
    return rc.simulate(rc.Scene(bodies=[body], radar=radar, model={"max_bounces": bounces, "tolerance_db": 1.0}))


@pytest.mark.parametrize(("shape", "bounces"), [("dihedral", 1), ("trihedral", 2)])
def test_a_corner_is_told_that_a_receiver_beside_the_transmitter_sees_by_one_bounce_more(shape, bounces):
    short, whole = beside(shape, bounces, size=0.25), beside(shape, bounces + 1, size=0.25)
    assert whole.detections.snr.max() > short.detections.snr.max() + 20.0
    assert "over body come back by" in told(short)[0] and told(whole) == []


def test_the_line_of_sight_tells_nothing_of_further_bounces():
    found = beside("box", 1, length=0.3, width=0.3, height=0.3)
    assert found.ledger["further bounces"].kind == "none" and told(found) == []
    assert not [line for line in found.warnings if "further bounces" in line]


@pytest.mark.parametrize("alone", [True, False])
@pytest.mark.parametrize(("shape", "bounces", "height"), [("trihedral", 3, 0.4), ("dihedral", 2, 0.5)])
def test_a_corner_that_sent_all_rays_back_tells_of_no_further_bounces(shape, bounces, height, alone):
    found = run(shape, bounces, height=height, alone=alone, size=0.15)
    assert found.detections.snr.max() > 35.0 and np.abs(found.detections.range - 8.0).min() < 0.1
    assert not [line for line in found.warnings if "further bounces" in line]


def test_a_target_that_only_a_mirror_shows_is_told_though_no_path_of_two_bounces_comes_back():
    places = {"mirror": (5.0, 0.0, 135.0, 0.8), "target": (5.0, 3.0, 270.0, 0.4), "wall": (2.5, 1.5, 211.0, 0.6)}
    bodies = [
        rc.Body(name=name, shape="plate", params={"width": s, "height": s}, position=(x, y, 0.5), yaw_deg=yaw)
        for name, (x, y, yaw, s) in places.items()
    ]
    radar = rc.Radar(rc.Waveform(24e9, 500e6, 40e-6, n_chirps=8, n_samples=64), position=(0.0, 0.0, 0.5))
    model = {"tolerance_db": 1.0}
    short, whole = (rc.simulate(rc.Scene(bodies=bodies, radar=radar, model=model), max_bounces=n) for n in (2, 3))
    assert np.abs(whole.detections.range - 8.0).min() < 0.1 < np.abs(short.detections.range - 8.0).min()
    assert "waves over mirror > target > mirror come back by 3 interactions" in told(short)[0] and told(whole) == []
    assert not [line for line in whole.warnings if "further bounces" in line]
