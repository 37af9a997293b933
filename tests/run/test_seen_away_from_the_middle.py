"""Echoes that a frame traced several times has, but not at its middle: another tracing explains them."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import db

FRAME = 512 * 50e-6
WAVE = rc.Waveform(77e9, 300e6, 20e-6, 50e-6, n_chirps=512, n_samples=64)
TURNED = np.deg2rad(160.0)
SCREEN = rc.Body(
    "screen", shape="plate", params={"width": 2.0, "height": 2.0}, position=(3.0, -1.0, 0.5), yaw_deg=160.0
)
POINT = {"shape": "plate", "params": {"width": 0.002, "height": 0.002}, "rcs_dbsm": 5.0, "yaw_deg": 180.0}


def behind(share: float, speed: float = 9.0, **given) -> rc.Body:
    """Return a body 12 m away that is seen beside the screen's edge for the last share of a frame."""
    edges = (np.array([3.0, -1.0]) + s * np.array([-np.sin(TURNED), np.cos(TURNED)]) for s in (-1.0, 1.0))
    at = max(float(np.arctan2(y, x)) for x, y in edges)
    velocity = np.array([-3.0, speed, 0.0])
    place = 12.0 * np.array([np.cos(at), np.sin(at), 0.0]) - velocity * (1.0 - share) * FRAME
    return rc.Body("t", position=(place[0], place[1], 0.5), velocity=tuple(velocity), **given)


def far(bodies, retrace="auto", wave=WAVE, **radar):
    """Return the run of bodies, and the explanations of its detections beyond the screen."""
    model = {"retrace": retrace, "max_bounces": 1}
    result = rc.simulate(rc.Scene(bodies, radar=rc.Radar(wave, **{"power": 100.0} | radar), model=model), seed=1)
    return result, [p for p in result.provenance if p.range > 8.0]


SHAPES = {
    "plate": {"shape": "plate", "params": {"width": 0.05, "height": 0.1}, "yaw_deg": 180.0, "turn_rate_dps": 200.0},
    "box": {
        "shape": "box",
        "params": {"length": 0.06, "width": 0.06, "height": 0.1},
        "yaw_deg": 180.0,
        "turn_rate_dps": 200.0,
    },
}


@pytest.mark.parametrize("retrace", ["auto", 17])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_turning_body_that_comes_out_of_a_shadow_late_is_explained_by_a_late_tracing(shape, retrace):
    """They were clutter, noise, and nothing was predicted, at 52 and 51 dB."""
    result, found = far([SCREEN, behind(0.3, **SHAPES[shape])], retrace)
    assert found
    for why in found:
        # Those on its side lobes along rate are its, too.
        assert (why.label, why.bodies) == ("direct", "t")
    strongest = max(found, key=lambda x: x.power)
    assert db(strongest.predicted) == pytest.approx(db(strongest.power), abs=0.1)
    assert strongest.true_range == pytest.approx(strongest.range, abs=0.02)
    assert strongest.true_rate == pytest.approx(strongest.rate, abs=0.1)
    number = result.provenance.index(strongest) + 1
    asked = rc.explain(result, detection=number)
    assert (asked.label, asked.bodies) == ("direct", "t")
    # Its paths are those of the middle, which has none of it.
    assert not asked.paths.of(asked.contributions[0]).any()


@pytest.mark.parametrize("iq", [True, False])
@pytest.mark.parametrize("retrace", [9, 33])
def test_a_point_that_moves_is_explained_when_it_is_seen(retrace, iq):
    wave = rc.Waveform(77e9, 300e6, 20e-6, 50e-6, n_chirps=512, n_samples=128, complex_sampling=iq)
    _, found = far([SCREEN, behind(0.3, **POINT)], retrace, wave, power=10.0)
    assert found
    assert {(why.label, why.bodies) for why in found} == {("direct", "t")}
    strongest = max(found, key=lambda x: x.power)
    assert db(strongest.predicted) == pytest.approx(db(strongest.power), abs=0.1)
    assert strongest.true_range == pytest.approx(strongest.range, abs=0.03)
    assert strongest.true_rate == pytest.approx(strongest.rate, abs=0.1)


def test_a_body_at_rest_that_a_turning_screen_uncovers_late_is_explained_too():
    """The tracings are of the screen's turning; what it uncovers belongs to them as well."""
    edge = {"shape": "plate", "params": {"width": 2.0, "height": 2.0}}
    screen = rc.Body("screen", **edge, position=(3.0, -1.0, 0.5), yaw_deg=160.0, turn_rate_dps=-400.0)
    _, found = far([screen, rc.Body("post", **POINT, position=(12.0, -0.383, 0.5))], power=10.0)
    strongest = max(found, key=lambda x: x.power)
    assert (strongest.label, strongest.bodies) == ("direct", "post")
    assert db(strongest.predicted) == pytest.approx(db(strongest.power), abs=0.1)
    assert strongest.true_range == pytest.approx(12.006, abs=0.001)


def test_noise_stays_noise():
    """What no tracing has is clutter still."""
    model = {"retrace": 9, "max_bounces": 1}
    settings = rc.Processing(pfa=1e-2, min_snr_db=0.0)
    radar = rc.Radar(WAVE, power=1e-9, processing=settings)
    scene = rc.Scene([SCREEN, behind(0.3, **POINT)], radar=radar, model=model)
    result = rc.simulate(scene, seed=1)
    none = [p for p in result.provenance if not p.contributions]
    assert none
    assert {p.label for p in none} == {"clutter"}
