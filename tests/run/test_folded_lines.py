"""Lines on folded echoes: one limit, and places where echoes do appear."""

import re

import numpy as np
import pytest

import raychan as rc
from raychan.units import C0

HALF = 0.5 * C0 / 77e9


def lines(rate, elements, power=100.0, rcs=25.0, **waveform):
    """Return the lines on folds of a point target's run, and the rate [m/s] of its strongest detection."""
    ball = rc.Body(
        "ball", shape="sphere", params={"radius": 0.05}, position=(60.0, 0.0, 0.5), velocity=(rate, 0.0, 0.0),
        rcs_dbsm=rcs,
    )  # fmt: skip
    wave = rc.Waveform(77e9, 40e6, 20e-6, n_samples=64, **{"n_chirps": 96, **waveform})
    scene = rc.Scene([ball], radar=rc.Radar(wave, power=power, **elements))
    found = rc.simulate(scene)
    said = [x for x in (*scene.warnings, *found.warnings) if "unambiguous" in x or "shows elsewhere" in x]
    return list(dict.fromkeys(said)), float(found.detections.rate[0])


@pytest.mark.parametrize("multiplexing", ["tdm", "ddm"])
def test_several_transmitters_name_one_limit_the_rate_up_to_which_folds_are_told_apart(multiplexing):
    array = rc.mimo_array(2, 4, HALF)
    said, seen = lines(58.4, {"multiplexing": multiplexing, **array})
    body, folded = said
    assert "beyond the unambiguous range rate 48.66 m/s" in body and re.search(r"or 48\.6\d m/s an echo", folded)
    assert float(re.search(r"appears near (\S+) m/s", body)[1]) == pytest.approx(seen, abs=0.5)
    said, seen = lines(30.0, {"multiplexing": multiplexing, **array})
    assert said == [] and seen == pytest.approx(30.0, abs=0.2)


def test_one_receiver_names_the_limit_of_one_channel():
    one = {"multiplexing": "tdm", **rc.mimo_array(2, 1, HALF)}
    (body, folded), seen = lines(30.0, one)
    assert "beyond the unambiguous range rate 24.3" in body and re.search(r"or 24\.3\d m/s an echo", folded)
    assert float(re.search(r"appears near (\S+) m/s", body)[1]) == pytest.approx(seen, abs=0.5)


def test_staggered_ramps_name_a_rate_only_where_all_folds_are_tested():
    (body, *_), _ = lines(1022.0, {}, power=1e5, stagger=(30e-6, 37e-6))
    assert "it appears at another rate" in body
    (body, folded), seen = lines(-130.0, {}, power=1e4, stagger=(40e-6, 50e-6, 60e-6))
    assert float(re.search(r"appears near (\S+) m/s", body)[1]) == pytest.approx(seen, abs=0.5)
    assert re.search(r"or 97\.\d+ m/s an echo shows elsewhere; number 1", folded)


def test_a_fold_that_noise_leaves_open_is_told_as_such():
    said, seen = lines(60.0, {}, power=0.1, stagger=(30e-6, 30.5e-6))
    assert not np.isclose(seen, 60.0, atol=1.0)
    assert "shows elsewhere, and a slower one where noise leaves its fold open; number 1 is at" in said[-1]
