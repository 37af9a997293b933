"""Explanations of frames that are traced several times: what paths give is the level that the receiver reports."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import db

STEP = 0.5 * 299_792_458.0 / 77e9


def run(division: str, *, receivers: int = 8, iq: bool = True, beams: str = "coherent", speed: float = 9.0):
    """Return a run of a point that crosses near by, between cells of range, rate and angle."""
    wave = rc.Waveform(77e9, 4e8, 20e-6, 34e-6, n_chirps=96, n_samples=128, complex_sampling=iq)
    senders = {"none": 1, "tdm": 2, "ddm": 2}[division]
    lines = {"elements": rc.uniform_array(receivers, STEP)}
    if senders > 1:
        lines |= {"tx_elements": rc.uniform_array(senders, receivers * STEP), "multiplexing": division}
    if division == "ddm":
        lines["ddm_slots"] = 3
    settings = rc.Processing(beams=beams)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.5), noise=False, processing=settings, **lines)
    point = {"shape": "sphere", "params": {"radius": 0.01}, "rcs_dbsm": 10.0, "velocity": (speed, 21.0, 0.0)}
    body = rc.Body("point", position=(9.07, 3.1, 0.5), **point)
    return rc.simulate(rc.Scene([body], radar=radar, model={"max_bounces": 1, "retrace": 9}))


@pytest.mark.parametrize(("speed", "iq"), [(9.0, True), (-26.0, False)])
@pytest.mark.parametrize("division", ["none", "tdm", "ddm"])
def test_what_paths_give_is_the_level_at_the_peak_in_the_beam(division, iq, speed):
    """In the map cell alone it was 0.2 dB low, by Doppler division 3 dB, with only a share of the slots."""
    result = run(division, iq=iq, speed=speed)
    at = int(np.argmax(result.detections.power))
    why = result.provenance[at]
    assert (why.label, why.bodies) == ("direct", "point")
    assert db(why.predicted) == pytest.approx(db(why.power), abs=0.06)


@pytest.mark.parametrize(("receivers", "beams"), [(1, "coherent"), (8, "mean")])
def test_what_paths_give_is_the_mean_of_the_antennas_where_there_is_no_beam(receivers, beams):
    result = run("none", receivers=receivers, beams=beams)
    at = int(np.argmax(result.detections.power))
    why = result.provenance[at]
    assert db(why.predicted) == pytest.approx(db(why.power), abs=0.06)


def test_an_echo_at_rest_in_the_cell_of_one_that_crosses_counts_in_what_paths_give():
    wave = rc.Waveform(77e9, 4e8, 20e-6, 34e-6, n_chirps=96, n_samples=128)
    radar = rc.Radar(wave, position=(0.0, 0.0, 0.5), noise=False)
    point = {"shape": "sphere", "params": {"radius": 0.01}, "position": (9.07, 0.0, 0.5), "rcs_dbsm": 10.0}
    bodies = [rc.Body("post", **point), rc.Body("mover", velocity=(0.0, 9.0, 0.0), **point)]
    model = {"max_bounces": 1, "retrace": 9}
    both, alone = (rc.simulate(rc.Scene(some, radar=radar, model=model)) for some in (bodies, bodies[1:]))
    why, other = both.provenance[0], alone.provenance[0]
    assert db(why.predicted) == pytest.approx(db(why.power), abs=0.1)
    assert db(why.predicted / other.predicted) > 3.0
