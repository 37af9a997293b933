"""Flat bodies that turn, seen at half their height: the corners of a tall footprint are alike in range there, and its
middle is nearer. Chirp by chirp against a sum over points of physical optics, and no echo is faster than the body."""

import numpy as np
import pytest
from support.moving_frames import energy_db

import raychan as rc
from raychan.run import between_chirps
from raychan.run.micro_doppler import stretches
from raychan.run.rules import fine_rule
from raychan.units import C0, db

WAVE = {"carrier_ghz": 76.85, "bandwidth_mhz": 300.0, "chirp_us": 40.0, "repetition_us": 50.0, "samples": 64}
BOX = {"length": 1.0, "width": 0.5, "height": 1.0}
RANGE, HEIGHT, MIDDLE = 10.0, 1.0, 32  # m, m, the sample in the middle of a ramp


def scene(spin: float, yaw: float, shape: str = "box", params=BOX, at=(RANGE, 0.0, 0.0), chirps: int = 256) -> rc.Scene:
    body = rc.Body(name="b", shape=shape, params=params, position=at, turn_rate_dps=spin, yaw_deg=yaw)
    radar = {"position": [0.0, 0.0, 0.5], "noise": False, "power_dbm": 30.0, "antenna": {"kind": "isotropic"}}
    return rc.Scene(
        bodies=[body],
        radar=radar | {"waveform": WAVE | {"chirps": chirps}},
        model={"max_bounces": 1, "tolerance_db": 0.5},
    )


def upright(far: np.ndarray, k: float) -> np.ndarray:
    """Return the sum over the height of exp(-2 j k r) / r^3, of points at horizontal distances `far` [m]; from a table
    of its slow part."""
    z = (np.arange(1000) + 0.5) / 1000 * HEIGHT - 0.5 * HEIGHT
    knots = np.linspace(RANGE - 0.6, RANGE + 0.6, 200)
    r = np.hypot(knots[:, None], z)
    slow = (np.exp(-2j * k * (r - knots[:, None])) / r**3).mean(axis=1) * HEIGHT
    return (np.interp(far, knots, slow.real) + 1j * np.interp(far, knots, slow.imag)) * np.exp(-2j * k * far)


def physical_optics(turn: np.ndarray, frequency: float) -> np.ndarray:
    """Return the amplitudes (t,) [sqrt(W)] that 1 W brings from a conducting box turned by angles (t,) [rad]: 1 / 4 pi
    of the integral of the cosine of incidence over r^2, of what is lit."""
    k, out = 2.0 * np.pi * frequency / C0, np.zeros(len(turn), complex)
    for deep, half, side in ((0.5, 0.25, 0.0), (0.25, 0.5, 90.0), (0.5, 0.25, 180.0), (0.25, 0.5, 270.0)):
        a = (turn + np.radians(side))[:, None]
        s = ((np.arange(3000) + 0.5) / 1500.0 - 1.0) * half
        x, y = RANGE + deep * np.cos(a) - s * np.sin(a), deep * np.sin(a) + s * np.cos(a)
        facing = np.maximum(-(x * np.cos(a) + y * np.sin(a)), 0.0)
        out += (facing * upright(np.hypot(x, y), k)).mean(axis=1) * 2.0 * half
    return out / (4.0 * np.pi)


@pytest.mark.parametrize(("spin", "yaw"), [(720.0, 86.0), (180.0, 89.0)])
def test_each_chirp_of_a_turning_box_seen_at_half_its_height_is_the_physical_optics_of_its_faces(spin, yaw):
    given = scene(spin, yaw)
    found = rc.simulate(given)
    wave = given.radar.waveform
    when = np.arange(256) * wave.repetition + MIDDLE * wave.chirp_duration / 64
    frequency = wave.carrier + wave.slope * MIDDLE * wave.chirp_duration / 64
    truth = physical_optics(np.radians(yaw + spin * when), frequency)
    samples = found.cube.samples[0, :, MIDDLE].astype(complex)
    # Where a ramp begins its beat has a phase of its own, alike for all chirps.
    truth *= np.exp(1j * np.angle(np.vdot(truth, samples)))
    assert energy_db(samples - truth, truth) < -45.0
    # Levels hold between lobes, too, down to 30 dB below the strongest chirp; single chirps were off by 16 dB.
    assert db(np.abs(samples / truth) ** 2) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize(
    ("shape", "params", "at", "spin", "yaw"),
    [
        ("box", BOX, (10.0, 0.0, 0.0), 720.0, 86.0),
        ("plate", {}, (8.0, 0.0, 0.5), 720.0, -4.0),
        ("wall", {"length": 4.0, "height": 1.0, "thickness": 0.2}, (12.0, 0.0, 0.0), 90.0, 89.0),
    ],
)
def test_no_echo_of_a_turning_body_seen_at_half_its_height_is_faster_than_its_fastest_point(
    shape, params, at, spin, yaw
):
    """Side lobes of the window are -70 dB and less there; echoes were at -11 to -46 dB."""
    given = scene(spin, yaw, shape, params, at)
    found, corners = rc.simulate(given).detections, given.bodies[0].geometry.vertices
    fastest = np.radians(spin) * np.hypot(corners[:, 0], corners[:, 1]).max()
    beyond = np.abs(found.rate) > fastest + given.radar.waveform.rate_resolution
    level = db(found.power / found.power.max())
    assert level.max() == 0.0 and (level[beyond] < -65.0).all()


@pytest.mark.parametrize("spin", [90.0, 720.0])
def test_poses_between_chirps_carry_large_footprints_that_turn_fast(spin, monkeypatch):
    """A box of 1 m at 720 degrees a second was -10 dB off between poses 0.6 ms apart."""
    given = scene(spin, 80.0, chirps=500)
    rule = fine_rule(given.radar, given.processing, given.model)

    def samples(drift: float) -> np.ndarray:
        monkeypatch.setattr(between_chirps, "_DRIFT", drift)
        return np.concatenate([part for part, _ in stretches(given, rule, given.model, 3)], axis=1)

    usual, exact = samples(between_chirps._DRIFT), samples(-1.0)
    assert energy_db(usual - exact, exact) < -60.0
