"""Explanations of near bodies before wide arrays: their waves are spherical in the beam, as they are in the samples."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.processing.scan import Scan
from raychan.units import db

WAVE = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=30e-6, n_chirps=8, n_samples=64)


@pytest.mark.parametrize("yaw_deg", [190.0, 191.0, 193.0])
@pytest.mark.parametrize("array", ["line", "transmitters"])
def test_a_plate_whose_glint_lies_beside_the_middle_of_a_wide_array_is_named(array, yaw_deg):
    given = {"elements": rc.uniform_array(32, 0.5 / 31)}
    if array == "transmitters":
        given = {"elements": rc.uniform_array(8, 0.5 / 31), "tx_elements": rc.uniform_array(4, 4.0 / 31)}
        given["multiplexing"] = "tdm"
    radar = rc.Radar(waveform=WAVE, position=(0.0, 0.0, 1.0), noise=False, **given)
    plate = {"width": 0.1, "height": 0.1}
    body = rc.Body(name="plate", shape="plate", params=plate, position=(1.7, 0.22, 0.95), yaw_deg=yaw_deg)
    result = rc.simulate(rc.Scene(bodies=[body], radar=radar, model={"max_bounces": 1, "tolerance_db": 0.2}))
    strongest = int(np.argmax(result.detections.power))
    why = result.provenance[strongest]
    assert (why.label, why.bodies) == ("direct", "plate")
    assert db(why.predicted) == pytest.approx(db(why.power), abs=0.3)


@pytest.mark.parametrize(
    ("elements", "width", "away", "azimuth", "size", "turned"),
    [(14, 0.86, 8.5, 27.36, (0.09, 0.05), 1.39), (10, 0.92, 11.1, -27.54, (0.15, 0.30), -1.19)],
)
@pytest.mark.parametrize("senders", [1, 2])
def test_what_paths_give_spreads_to_each_element(elements, width, away, azimuth, size, turned, senders):
    """Waves from all over a tilted plate nearly cancel; where elements saw them as strong as the middle, what paths
    gave was 0.16 and 0.11 dB above the level."""
    wave = rc.Waveform(77e9, 150e6, 20e-6, n_chirps=16, n_samples=128)
    lines = {"elements": rc.uniform_array(elements, width / (elements - 1))}
    if senders > 1:
        step = width / (elements - 1)
        lines = {"elements": rc.uniform_array(elements // 2, step), "multiplexing": "tdm"}
        lines["tx_elements"] = rc.uniform_array(2, elements // 2 * step)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.5), noise=False, power=10.0, **lines)
    at = np.radians(azimuth)
    body = rc.Body(
        "plate",
        shape="plate",
        params={"width": size[0], "height": size[1]},
        position=(away * np.cos(at), away * np.sin(at), 0.5),
        yaw_deg=180.0 + azimuth + turned,
    )
    result = rc.simulate(rc.Scene([body], radar=radar, model={"max_bounces": 1}), seed=1)
    strongest = int(np.argmax(result.detections.power))
    why = result.provenance[strongest]
    assert db(why.predicted) == pytest.approx(db(why.power), abs=0.01)


@pytest.mark.parametrize(("doa", "count"), [("bartlett", 1), ("music", 2)])
def test_a_near_wave_is_one_echo_as_spherical_and_ambiguous_parts_as_plane(doa, count, monkeypatch):
    """A wave from 1.6 m is curved by five radians over 0.37 m: its peak splits into two beams of plane waves."""
    if doa == "music":  # else beams of spherical waves are tried beside it
        monkeypatch.setattr(Scan, "fronts", lambda scan, *_: [scan])
    wave = rc.Waveform(carrier=24e9, bandwidth=150e6, chirp_duration=30e-6, n_chirps=8, n_samples=48)
    line = rc.uniform_array(60, 0.5 * 299_792_458.0 / wave.middle)
    radar = rc.Radar(waveform=wave, position=(0.0, 0.0, 1.0), noise=False, elements=line)

    def seen(away):
        ball = rc.Body(name="ball", shape="sphere", params={"radius": 0.06}, position=(away, 0.1 * away, 1.0))
        scene = rc.Scene(bodies=[ball], radar=radar, model={"max_bounces": 1}, processing=rc.Processing(doa=doa))
        return rc.simulate(scene).detections

    near, far = seen(1.6), seen(80.0)
    assert len(near.range) == count and (near.ambiguous == (count > 1)).all()
    assert count > 1 or near.azimuth[0] == pytest.approx(np.arctan2(0.1, 1.0), abs=0.01)
    assert len(far.range) == 1 and not far.ambiguous.any()


@pytest.mark.parametrize(
    ("division", "senders", "iq"), [("none", 1, True), ("none", 1, False), ("tdm", 3, False), ("ddm", 2, True)]
)
@pytest.mark.parametrize(("width", "bandwidth", "azimuth"), [(0.8, 5e8, 50.0), (0.9, 1e9, -65.0)])
def test_what_paths_give_has_the_range_of_each_element(width, bandwidth, azimuth, division, senders, iq):
    """A lone point: its range differs over the elements by 1 to 2.7 cells, by which a beam reads 0.6 to 3 dB less."""
    receivers = 24 // senders
    step = width / (senders * receivers - 1)
    wave = rc.Waveform(24e9, bandwidth, 20e-6, 30e-6, n_chirps=24, n_samples=512, complex_sampling=iq)
    lines = {"elements": rc.uniform_array(receivers, step)}
    if senders > 1:
        lines |= {"tx_elements": rc.uniform_array(senders, receivers * step), "multiplexing": division}
    if division == "ddm":
        lines["ddm_slots"] = 3
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.0), noise=False, **lines)
    place = 34.04 * np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
    point = rc.Body("point", shape="sphere", params={"radius": 0.01}, position=place, rcs_dbsm=10.0)
    result = rc.simulate(rc.Scene([point], radar=radar, model={"max_bounces": 1}))
    at = int(np.argmax(result.detections.power))
    why = result.provenance[at]
    assert db(why.predicted) == pytest.approx(db(why.power), abs=0.15)
    told = rc.explain(result, detection=at + 1)
    assert abs(told.paths.wave.sum()) ** 2 == pytest.approx(why.predicted, rel=1e-3)
