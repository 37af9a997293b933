"""A wall through the plane of an antenna that sends ahead only: tubes end there with the gain, and levels converge."""

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
