"""Frames in which bodies turn: few tracings against tracing every chirp, and against the circle a point runs on."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.moving_frames import energy_db, every_chirp

import raychan as rc
from raychan.processing.range_doppler import range_doppler
from raychan.records import Cube
from raychan.run.micro_doppler import retraced
from raychan.run.sequence import frames
from raychan.run.simulate import simulate
from raychan.run.turning import bend, needed
from raychan.signal.baseband import synthesize
from raychan.units import C0

WAVE = {"bandwidth_mhz": 300.0, "chirp_us": 30.0, "chirps": 64, "samples": 64}


def rotor(blades=3, radius=1.0, pitch_deg=15.0):
    """Blades in the body's y-z plane that turn about its x axis."""
    parts = []
    for i in range(blades):
        blade = trimesh.creation.box((0.01 * radius, 0.1 * radius, 0.9 * radius))
        blade.apply_transform(trimesh.transformations.rotation_matrix(np.radians(pitch_deg), (0, 0, 1)))
        blade.apply_translation((0, 0, 0.55 * radius))
        blade.apply_transform(trimesh.transformations.rotation_matrix(2.0 * np.pi * i / blades, (1, 0, 0)))
        parts.append(blade)
    return trimesh.util.concatenate(parts)


def scene(rpm=200.0, *more, model=None, **radar):
    turning = rc.Body(name="rotor", mesh=rotor(), position=(10, 0, 2), yaw_deg=60.0, spin_dps=(6.0 * rpm, 0, 0))
    given = {"position": [0, 0, 1.5], "noise": False, "antenna": {"kind": "isotropic"}, "waveform": WAVE} | radar
    return rc.Scene(bodies=[turning, *more], radar=given, model={"max_bounces": 2} | (model or {}))


def power(samples, wave):
    return range_doppler(
        Cube(samples=samples.astype(np.complex64), noise_power=0.0), wave, "hann", "hann", (2, 2)
    ).power


MOVING = rc.Body(
    name="post", shape="box", params={"length": 0.3, "width": 0.3}, position=(8, 1.5, 0), velocity=(-6, 0, 0)
)
GROUND = rc.Body(name="ground", shape="ground", params={"size": 40.0})


@pytest.mark.parametrize(
    ("rpm", "more"), [(200.0, ()), (20.0, ()), (200.0, (MOVING, GROUND))], ids=["fast", "slow", "over ground"]
)
def test_few_tracings_give_the_spectrum_of_tracing_every_chirp_within_the_stated_error(rpm, more):
    turning = scene(rpm, *more)
    truth, rule = every_chirp(turning)
    few = retraced(turning, rule, turning.model)
    assert len(few.times) <= 4 and few.reached
    wave = turning.radar.waveform
    # The ground under the radar is not what this is about.
    true, wrong, told = (power(x, wave)[:, 14:] for x in (truth, few.samples - truth, few.error))
    off, stated = (10.0 * np.log10(x.sum() / true.sum()) for x in (wrong, told))
    assert off < stated < -20.0, f"true {off:.1f} dB, stated {stated:.1f} dB"
    strong = true > 1e-3 * true.max()
    assert strong.sum() > 20
    # Cell by cell the stated error is a sample of what may be wrong: 6 dB of room for one cell, none for their sum.
    assert (wrong[strong] <= 4.0 * told[strong] + 1e-9 * true.max()).mean() > 0.9
    assert wrong[strong].sum() < told[strong].sum()


def test_one_tracing_with_rates_is_wrong_where_several_are_right():
    turning = scene(200.0)
    truth, rule = every_chirp(turning)
    frozen = synthesize(simulate(turning, tolerance_db=0.5).paths, turning.radar).samples
    # Paths are those of the middle, from which rates differ by half as much as from the start.
    assert energy_db(frozen - truth, truth) > -18.0
    assert energy_db(retraced(turning, rule, turning.model).samples - truth, truth) < -40.0


def test_the_number_of_tracings_may_be_given_and_more_of_them_differ_less():
    offs = []
    for count in (2, 3, 5):
        turning = scene(200.0, model={"retrace": count})
        truth, rule = every_chirp(turning) if not offs else (truth, rule)  # noqa: F821
        few = retraced(turning, rule, turning.model)
        assert len(few.times) == count
        offs.append(energy_db(few.samples - truth, truth))
    assert offs[0] > offs[1] > offs[2] and offs[2] < -50.0, offs


def test_a_body_that_crosses_near_by_is_carried_on_if_asked_for():
    plate = {"shape": "plate", "params": {"width": 1.5, "height": 1.0}, "position": (12, 2, 1), "yaw_deg": 150.0}
    radar = {"position": [0, 0, 1], "noise": False, "antenna": {"kind": "isotropic"}}
    radar["waveform"] = {"bandwidth_mhz": 300.0, "chirp_us": 60.0, "chirps": 64, "samples": 64}
    body = rc.Body(name="door", velocity=(0, 15, 0), **plate)
    cached, thrice = (
        rc.Scene(bodies=[body], radar=radar, model={"max_bounces": 1, "retrace": count}) for count in (1, 3)
    )
    truth, _ = every_chirp(cached)
    off = [energy_db(simulate(s).cube.samples - truth, truth) for s in (cached, thrice)]
    # Traced once, at its middle, the phase is k a T^2 / 4 = 0.1 rad off at the frame's ends.
    assert off[0] > -30.0 and off[1] < -40.0, off


def test_a_point_like_corner_on_a_turning_arm_returns_at_the_range_of_every_instant():
    """A small sphere on an arm: its phase is that of its distance, found here by hand from the circle it runs on."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    ball.apply_translation((1.0, 0.0, 0.0))
    rate = 20.0
    body = rc.Body(name="arm", mesh=ball, position=(10, 0, 0), yaw_deg=90.0, turn_rate_dps=float(np.degrees(rate)))
    radar = {"position": [0, 0, 0], "noise": False, "antenna": {"kind": "isotropic"}, "waveform": WAVE}
    turning = rc.Scene(bodies=[body], radar=radar, model={"max_bounces": 1})
    result = simulate(turning)
    assert result.stats["tracings"] >= 3
    wave = turning.radar.waveform
    t = np.arange(wave.n_chirps) * wave.repetition
    middle = np.hypot(10.0 + np.cos(np.pi / 2 + rate * t), np.sin(np.pi / 2 + rate * t))
    first = result.cube.samples[0, :, 0].astype(complex)
    tau = 2.0 * (middle - 0.05) / C0
    turned = np.unwrap(np.angle(first * np.exp(2j * np.pi * (wave.carrier * tau - 0.5 * wave.slope * tau**2))))
    assert np.ptp(turned) < 0.05, "phase against that of the nearest point of the sphere"
    assert np.ptp(2.0 * np.pi * wave.carrier * tau) > 20.0, "while the sphere moves on by many wavelengths"


def test_a_frame_is_traced_again_only_where_turning_shows():
    edge = 0.3
    slow = scene(0.05)
    assert bend(slow, edge) < 1.0 and not needed(slow, "auto", edge)
    assert needed(scene(200.0), "auto", edge) and not needed(scene(200.0), 1, edge) and needed(slow, 4, edge)
    assert not needed(rc.Scene(bodies=[MOVING], radar={"waveform": WAVE}), "auto", edge)
    assert simulate(slow).stats["tracings"] == 1


def test_the_run_says_how_often_it_traced_and_what_that_leaves():
    result = simulate(scene(200.0), seed=1)
    assert 3 <= result.stats["tracings"] <= 4
    entry = result.ledger["intra-frame motion"]
    assert entry.kind == "estimate" and -80.0 < entry.level_db < -20.0 and "within the frame" in entry.how
    alone = simulate(scene(200.0, model={"retrace": 1}), seed=1)
    assert alone.stats["tracings"] == 1


def test_what_a_rotor_brings_to_cells_far_from_its_first_rate_is_told_to_be_its_own():
    loud = scene(200.0, GROUND, noise=True, power_dbm=70.0, waveform=WAVE | {"chirps": 256})
    result = simulate(loud, seed=1)
    bodies = [why.bodies for why in result.provenance]
    blades = [i for i, name in enumerate(bodies) if name == "rotor"]
    assert "noise" not in bodies and len(blades) >= 3
    assert np.ptp(result.detections.rate[blades]) > 5.0
    assert all(result.provenance[i].label == "direct" and result.provenance[i].error_db < 20.0 for i in blades)


def test_equal_seeds_give_equal_bytes_and_noise_comes_on_top():
    noisy = [simulate(scene(200.0, noise=True), seed=s).cube for s in (1, 1, 2)]
    np.testing.assert_array_equal(noisy[0].samples, noisy[1].samples)
    quiet = simulate(scene(200.0)).cube.samples
    spread = np.concatenate([(c.samples - quiet).ravel() for c in (noisy[0], noisy[2])])
    assert np.mean(np.abs(spread) ** 2) == pytest.approx(noisy[0].noise_power, rel=0.05)


def test_the_next_frame_begins_where_the_rotor_has_turned_to():
    turning = scene(200.0)
    late = list(frames(turning, 2, 0.025, seed=3))[1].result
    np.testing.assert_array_equal(late.cube.samples, simulate(turning.at(0.025), seed=4).cube.samples)
    # 25 ms at 200 rpm are 30 deg: not where a blade was before.
    assert energy_db(late.cube.samples - simulate(turning).cube.samples, late.cube.samples) > -10.0


def test_real_sampling_keeps_real_samples():
    assert not simulate(scene(200.0, waveform=WAVE | {"iq": False})).cube.samples.imag.any()
