"""Levels of a frame that is traced once are those of its middle; the ledger tells how far they may be off the mean,
and by what phase constant rates are off."""

import numpy as np
import pytest

import raychan as rc


def run(distance, speed, **model):
    """Return a run of 51 ms that sees one point drive away."""
    point = rc.Body(
        name="p",
        shape="sphere",
        params={"radius": 0.01},
        position=(distance, 0, 0.5),
        rcs_dbsm=10,
        velocity=(speed, 0, 0),
    )
    wave = rc.Waveform(77e9, 150e6, 50e-6, n_chirps=1024, n_samples=64)
    radar = rc.Radar(wave, position=(0, 0, 0.5), antenna=rc.IsotropicAntenna())
    return rc.simulate(rc.Scene(bodies=[point], radar=radar, model={"max_bounces": 1, "tolerance_db": 0.5} | model))


@pytest.mark.parametrize(("distance", "speed"), [(8.0, 20.0), (15.0, -20.0)])
def test_a_level_is_that_of_several_tracings_and_the_ledger_tells_how_far_it_may_be_off(distance, speed):
    once, often = run(distance, speed), run(distance, speed, retrace=9)
    entry, grown = once.ledger["intra-frame motion"], abs(speed) * 1024 * 50e-6 / distance
    # The mean of 1 / R^2 over the frame is that of its middle but for the square of the change.
    assert entry.level_db == pytest.approx(20.0 * np.log10(0.25 * grown**2), abs=1.5)
    changed = 10.0 * np.log10(once.detections.power.max() / often.detections.power.max())
    assert abs(changed) < 20.0 * np.log10(1.0 + 10.0 ** (entry.level_db / 20.0)) + 0.01
    assert not any("intra-frame motion at most" in line for line in once.warnings)


def test_a_level_that_hardly_changes_moves_no_line():
    still = run(15.0, -0.5)
    assert still.ledger["intra-frame motion"].level_db < -50.0
    assert not any("intra-frame motion" in line for line in still.warnings)


def heard(velocity, rx_velocity, bodies):
    """Return the level [dB] that the ledger tells of the direct signal to a receiver 6 m aside, in 15 ms, and the
    phase [rad] of a radial acceleration of 1 m/s^2."""
    wave = rc.Waveform(77e9, 150e6, 30e-6, n_chirps=256, n_samples=32, repetition=60e-6)
    radar = rc.Radar(
        wave, position=(0, 0, 1), velocity=velocity, rx_position=(0, 6, 1), rx_velocity=rx_velocity, rx_yaw_deg=0.0,
        antenna=rc.IsotropicAntenna(),
    )  # fmt: skip
    found = rc.simulate(rc.Scene(bodies=bodies, radar=radar, model={"max_bounces": 1}))
    level = found.ledger["intra-frame motion"].level_db
    assert any("intra-frame motion at most" in line for line in found.warnings) == (level > -20.0)
    return level, np.pi * wave.middle / rc.units.C0 * wave.frame_duration**2 / 2.0


ROAD = rc.Body(name="road", shape="ground", material="asphalt")


@pytest.mark.parametrize("bodies", [[], [ROAD]])
def test_a_line_of_sight_bends_by_the_relative_velocity_across_it_over_its_length(bodies):
    level, phase = heard((-5.0, 4.0, 0.0), (15.0, 4.0, 0.0), bodies)
    assert level == pytest.approx(20.0 * np.log10(phase * 20.0**2 / 6.0 / 2.0), abs=0.01)
    assert heard((15.0, 4.0, 0.0), (15.0, 4.0, 0.0), [])[0] < -100.0


def test_over_a_mirror_the_image_of_the_transmitter_moves():
    # Both rise by 5 m/s: the image in the road, 2 m below, falls.
    level, phase = heard((0.0, 0.0, 5.0), (0.0, 0.0, 5.0), [ROAD])
    across = 10.0 * 6.0 / np.hypot(6.0, 2.0)
    assert level == pytest.approx(20.0 * np.log10(phase * across**2 / np.hypot(6.0, 2.0) / 2.0), abs=0.1)


def test_the_smear_of_an_echo_is_told_beside_a_line_of_sight_a_million_times_as_strong():
    moves = {"position": (9.0, 3.0, 1.0), "velocity": (0.0, 25.0, 0.0)}
    point = rc.Body("p", shape="sphere", params={"radius": 0.01}, rcs_dbsm=-30.0, **moves)
    wave = rc.Waveform(77e9, 150e6, 30e-6, n_chirps=256, n_samples=64, repetition=60e-6)
    radar = rc.Radar(wave, position=(0, 0, 1), rx_position=(0, 6, 1), antenna=rc.IsotropicAntenna(), power=1.0)
    found = rc.simulate(rc.Scene(bodies=[point], radar=radar, model={"max_bounces": 1}))
    size = np.sort(np.abs(found.paths.amplitude))
    assert len(size) == 2 and size[1] > 1e3 * size[0]
    ways = np.array([9.0, 3.0 + 25.0 * wave.centre]), np.array([9.0, 25.0 * wave.centre - 3.0])
    bend = np.mean([(25.0 * 9.0) ** 2 / np.linalg.norm(way) ** 3 for way in ways])
    phase = 2.0 * np.pi * wave.middle / rc.units.C0 * bend * wave.frame_duration**2 / 4.0
    assert found.ledger["intra-frame motion"].level_db == pytest.approx(20.0 * np.log10(phase), abs=0.01)
