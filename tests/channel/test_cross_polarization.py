"""Cross-polarised receivers: a dihedral at 45 deg turns the polarisation, a sphere does not."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.units import db

WAVE = rc.Waveform(77e9, 500e6, 15e-6, n_chirps=16, n_samples=128)


def scene(shape, params, roll_deg=0.0, **radar):
    body = rc.Body(
        name="target", shape=shape, params=params, position=(9.0, 0.0, 0.5), roll_deg=roll_deg, yaw_deg=180.0
    )
    given = {"position": (0.0, 0.0, 0.5), "noise": False, "rx_polarization": "both"} | radar
    return rc.Scene(bodies=[body], radar=rc.Radar(WAVE, **given))


def levels(made):
    """Peaks [W] of the co-polarised and of the cross-polarised map."""
    cube = rc.synthesize(rc.transfer(rc.trace(made), made.radar), made.radar)
    return [rc.range_doppler(cube, made.radar, cross).power.max() for cross in (False, True)]


@pytest.mark.parametrize(
    ("roll_deg", "cross_share"), [(0.0, 0.0), (90.0, 0.0), (45.0, 1.0), (22.5, 0.5), (-30.0, 0.75)]
)
def test_a_dihedral_turned_about_the_line_of_sight_gives_cross_polarisation_as_sine_squared_of_twice_the_turn(
    roll_deg, cross_share
):
    """S = [[cos 2a, sin 2a], [sin 2a, -cos 2a]] (Knott, Shaeffer, Tuley 2004; Cloude 2010)."""
    co, cross = levels(scene("dihedral", {"size": 0.1}, roll_deg))
    assert cross / (co + cross) == pytest.approx(cross_share, abs=0.01)


def test_a_sphere_gives_none():
    co, cross = levels(scene("sphere", {"radius": 0.2}))
    assert db(cross / co) < -50.0


def test_receivers_of_one_other_polarisation_are_the_cross_polarised_half_of_both():
    both = scene("dihedral", {"size": 0.1}, 30.0)
    alone = scene("dihedral", {"size": 0.1}, 30.0, rx_polarization="H")
    one, two = (rc.simulate(s, seed=1) for s in (alone, both))
    assert two.cube.samples.shape == (2, 16, 128)
    np.testing.assert_array_equal(two.cube.samples[1], one.cube.samples[0])
    again = rc.Scene.from_text(both.to_toml())
    assert again.radar.rx_polarization == "both"


def test_a_radar_without_cross_polarised_receivers_says_so():
    made = scene("sphere", {"radius": 0.2}, rx_polarization=None)
    cube = rc.synthesize(rc.transfer(rc.trace(made), made.radar), made.radar)
    with pytest.raises(ValueError, match='rx_polarization = "both"'):
        rc.range_doppler(cube, made.radar, cross=True)
    with pytest.raises(ValueError, match="V, H or both"):
        rc.Radar(WAVE, rx_polarization="L")
