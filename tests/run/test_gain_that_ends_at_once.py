"""Walls and floors through the plane of an antenna that sends ahead only: tubes end there with the gain, and levels
converge."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.radar.beam_table import beam_of

WAVE = rc.Waveform(carrier=77e9, bandwidth=300e6, chirp_duration=30e-6, n_chirps=16, n_samples=64)


def wall_beside(tolerance_db: float, **radar: object) -> rc.Result:
    """Return what a radar hears of a wall 3 m to its right, from behind it to 2 m ahead."""
    wall = rc.Body("wall", shape="wall", params={"length": 4.0, "height": 2.0}, position=(0.3, -3.0, 0.0), yaw_deg=180)
    set_up = rc.Radar(WAVE, (0, 0, 1.0), noise=False, **radar)
    return rc.simulate(rc.Scene(bodies=[wall], radar=set_up, model={"tolerance_db": tolerance_db, "max_bounces": 1}))


@pytest.mark.parametrize("radar", [{}, {"rx_position": (0.8, -1.0, 1.0)}])
def test_the_level_of_a_wall_beside_the_radar_is_known_to_the_tolerance(radar):
    found, finer = wall_beside(0.5, **radar), wall_beside(0.1, **radar)
    strongest = int(np.argmax(found.detections.snr))
    at = tuple(found.detections.cell[strongest])
    assert found.detections.error_db[strongest] <= 0.5
    off = abs(10.0 * np.log10(found.rdmap.power[at] / finer.rdmap.power[at]))
    assert off <= found.detections.error_db[strongest] + finer.detections.error_db.min()


def test_the_gain_of_an_antenna_on_both_sides_or_falling_to_nothing_does_not_end_at_once():
    for one in (rc.IsotropicAntenna(), rc.CosineAntenna(60.0, 20.0)):
        assert len(beam_of(rc.Radar(WAVE, tx_antenna=one, rx_antenna=one)).ends) == 0
    assert beam_of(rc.Radar(WAVE, yaw_deg=90.0)).ends == pytest.approx(np.array([[0.0, 1.0, 0.0]]), abs=1e-12)


def floor_below(x: float, **model: object) -> rc.Detections:
    """Return the echoes of a floor under the radar, which stands over its plane at x [m], as its gain ends there and as
    it is alike all around."""
    floor = rc.Body("floor", shape="box", params={"length": 9.0, "width": 7.0, "height": 0.2}, position=(3.5, 0, -0.2))
    kind = rc.IsotropicAntenna() if model.pop("all_around", False) else rc.IsotropicAntenna(front=True)
    radar = rc.Radar(WAVE, (x, 0, 0.9), tx_antenna=kind, rx_antenna=kind, noise_figure_db=14.0)
    return rc.simulate(rc.Scene(bodies=[floor], radar=radar, model={"max_bounces": 1, **model})).detections


@pytest.mark.parametrize("x", [-0.3, 0.0, 0.3])
@pytest.mark.parametrize("model", [{"tolerance_db": 0.15}, {"mode": "preview"}], ids=["run", "preview"])
def test_half_a_mirror_point_under_twice_the_gain_returns_what_a_whole_one_does(x, model):
    found, whole = floor_below(x, **model), floor_below(x, tolerance_db=0.15, all_around=True)
    i, k = int(np.argmax(found.snr)), int(np.argmax(whole.snr))
    assert found.range[i] == pytest.approx(0.9, abs=0.05)
    assert found.error_db[i] <= (0.15 if "mode" not in model else 4.1)
    # What a preview prunes of one plane is less than what it states of any scene.
    off = abs(10.0 * np.log10(found.power[i] / whole.power[k]))
    assert off <= (found.error_db[i] + whole.error_db[k] if "mode" not in model else 1.0)


@pytest.mark.parametrize(("body", "radius", "carrier"), [("cylinder", 0.197, 24e9), ("sphere", 0.1, 77e9)])
def test_levels_of_curved_bodies_partly_behind_the_plane_are_within_what_is_stated(body, radius, carrier):
    """Facets bulge over the straight lines between their corners: corners of cuts by these lay behind the plane, where
    there is no field, or before it."""
    wave = rc.Waveform(carrier=carrier, bandwidth=150e6, chirp_duration=40e-6, n_chirps=16, n_samples=64)
    form = {"radius": radius, "max_sag": 3e-4} | ({"height": 1.0} if body == "cylinder" else {})
    for ahead in (-0.2, 0.05, 0.35):
        at = (ahead * radius, 1.4, 0.7 if body == "cylinder" else 1.2)
        one = rc.Body("one", shape=body, params=form, position=at)
        radar = rc.Radar(wave, (0, 0, 1.2), noise=False)
        found, finer = (
            rc.simulate(rc.Scene(bodies=[one], radar=radar, model={"tolerance_db": tolerance, "max_bounces": 1}))
            for tolerance in (0.5, 0.02)
        )
        strongest = int(np.argmax(found.detections.snr))
        cell = tuple(found.detections.cell[strongest])
        off = abs(10.0 * np.log10(found.rdmap.power[cell] / finer.rdmap.power[cell]))
        assert off <= found.detections.error_db[strongest]
