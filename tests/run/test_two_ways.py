"""Before several transmitters an echo that leaves and returns in different directions is no plane wave: runs say so."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.run.explanation.two_ways import apart
from raychan.run.result import Explanation

WAVE = rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=30e-6, n_chirps=48, n_samples=128)
BALL = rc.Body("ball", shape="sphere", params={"radius": 0.3}, position=(7.0, -1.0, 0.5))
WALL = rc.Body("wall", shape="plate", params={"width": 8.0, "height": 3.0}, position=(5.0, 3.0, 0.5), yaw_deg=-90.0)


def run(*bodies, transmitters=2, **radar):
    places = rc.mimo_array(max(transmitters, 2), 4, 2e-3)
    if transmitters == 1:
        places = {"elements": places["elements"]}
    of = rc.Radar(WAVE, (0.0, 0.0, 0.5), power=0.1, **places, **radar)
    return rc.simulate(rc.Scene(bodies=list(bodies), radar=of, model={"max_bounces": 3}))


def lines(result):
    return [line for line in result.warnings if "return from another" in line or "returns from another" in line]


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_a_wave_over_wall_and_ball_is_told_and_those_over_one_body_are_not(multiplexing):
    result = run(BALL, WALL, multiplexing=multiplexing)
    (line,) = lines(result)
    over_both = [i + 1 for i, why in enumerate(result.provenance) if len(set(why.bodies.split(" > "))) == 2]
    named = [int(x) for x in line.partition("(number")[2].partition(")")[0].strip("s ").split(",")]
    straight = [i + 1 for i, why in enumerate(result.provenance) if why.bodies == "wall > ball > wall"]
    assert named == [i for i in over_both if i not in straight] and named


def test_one_transmitter_and_single_bodies_have_no_such_line():
    assert not lines(run(BALL, WALL, transmitters=1))
    assert not lines(run(BALL, multiplexing="tdm"))


def test_explanations_hold_the_directions_of_their_strongest_path():
    """Over the wall to the ball and back from there, and the other way round; over the ball alone to it and back."""
    result = run(BALL, WALL, transmitters=1)
    to_ball = np.array([7.0, -1.0, 0.0]) / np.sqrt(50.0)
    (direct,) = (why for why in result.provenance if why.bodies == "ball")
    assert direct.departure == pytest.approx(tuple(to_ball), abs=0.02)
    assert direct.arrival == pytest.approx(direct.departure, abs=1e-6)
    image = np.array([7.0, 7.0, 0.0]) / np.sqrt(98.0)
    for why in result.provenance:
        if why.bodies in ("wall > ball", "ball > wall"):
            two = (image, to_ball) if why.bodies == "wall > ball" else (to_ball, image)
            assert why.departure == pytest.approx(tuple(two[0]), abs=0.05)
            assert why.arrival == pytest.approx(tuple(two[1]), abs=0.05)


@pytest.mark.parametrize(("apart_deg", "co_polar", "cross_polar"), [(0.0, 0, 0), (1.0, 0, 1), (40.0, 1, 1)])
def test_cross_polar_echoes_of_both_ways_are_told_where_these_lie_close(apart_deg, co_polar, cross_polar):
    """Their two ways differ in sign, so that no direction is that of a plane wave."""
    turned = np.radians(apart_deg)
    way = {"departure": (1.0, 0.0, 0.0), "arrival": (np.cos(turned), np.sin(turned), 0.0)}
    why = Explanation(9.0, 0.0, 0.0, 1e-12, 1e-12, 0.1, "multipath", (), **way)
    for rows, polarization in ((co_polar, None), (cross_polar, "H")):
        radar = rc.Radar(WAVE, multiplexing="tdm", rx_polarization=polarization, **rc.mimo_array(2, 4, 2e-3))
        assert len(apart([why], radar)) == rows
