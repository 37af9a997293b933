"""How far detections move as bodies turn and shift: closed forms of a sphere, a plate, and two spheres in one cell."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

import raychan as rc
from raychan.study import detection_tracks
from raychan.study.detection_tracks import NOISE, Sighting, Track, follow
from raychan.study.sensitivity import (
    ERROR,
    INTERMITTENT,
    SPECKLE,
    STEADY,
    Moves,
    Tolerances,
    drawn,
    sensitivity,
    write_csv,
)
from raychan.units import C0, db
from raychan.world.displaced import Displacement, displaced, movable

LAMBDA = C0 / 77e9
WAVE = {"bandwidth_mhz": 500.0, "chirp_us": 30.0, "chirps": 16, "samples": 128}
RADAR = {"position": [0, 0, 0], "antenna": {"kind": "isotropic"}, "power_dbm": 30.0, "waveform": WAVE}


def scene(*bodies, **radar):
    return rc.Scene(bodies=list(bodies), radar=RADAR | radar, model={"max_bounces": 1, "tolerance_db": 0.5})


def ball(name="ball", *place):
    return rc.Body(name=name, shape="sphere", params={"radius": 0.3}, position=place or (12, 0, 0))


def poses(given, track, body=0):
    """Return turns (k, 3) [rad] and shifts (k, 3) [m] of a body in the draws that see a detection."""
    moved = [drawn(given, 0, draw, body) for draw in sorted(track.seen)]
    return np.array([m.turn for m in moved]), np.array([m.shift for m in moved])


def test_the_level_of_a_lone_sphere_stays_while_its_range_moves_with_it():
    given = Tolerances(turn_deg=0.5, shift_mm=2.0, draws=12)
    done = sensitivity(scene(ball()), given)
    (one,) = done.moves
    level = one.track.column("level_dbm")
    assert one.count == 12 and one.spread() < 0.02
    assert np.abs(level - one.track.first.level_dbm).max() < 0.05
    assert one.verdict(0.5) == STEADY
    # Noise moves the range that is read by millimetres, as the phase of the echo turns against it.
    one = sensitivity(scene(ball(), noise=False), given).moves[0]
    _, shifts = poses(given, one.track)
    moved = np.linalg.norm(np.array([12.0, 0.0, 0.0]) + shifts, axis=1) - 12.0
    assert one.track.column("range") - one.track.first.range == pytest.approx(moved, abs=2e-4)


def test_a_plate_at_normal_incidence_moves_by_the_sinc_of_its_turns():
    width, height = 0.1, 0.08
    plate = rc.Body(
        name="plate", shape="plate", params={"width": width, "height": height}, position=(25, 0, 0), yaw_deg=180.0
    )
    given = Tolerances(turn_deg=0.3, shift_mm=0.0, draws=40)
    (one,) = sensitivity(scene(plate), given).moves
    turns, _ = poses(given, one.track)
    far = np.sinc(2.0 * width * np.sin(turns[:, 2]) / LAMBDA) * np.sinc(2.0 * height * np.sin(turns[:, 1]) / LAMBDA)
    asked = db(far**2)
    assert one.count == 40
    assert one.track.column("level_dbm") - one.track.first.level_dbm == pytest.approx(asked, abs=0.05)
    assert one.spread() == pytest.approx(np.std(asked, ddof=1), rel=0.02)
    # Of small turns: the mean over draws is that of sinc^2, 1 - x^2 / 3 with x = 2 pi width turn / wavelength.
    small = Tolerances(turn_deg=0.05, shift_mm=0.0, draws=40)
    (one,) = sensitivity(scene(plate), small).moves
    turns, _ = poses(small, one.track)
    across = (2.0 * np.pi / LAMBDA) ** 2 * ((width * turns[:, 2]) ** 2 + (height * turns[:, 1]) ** 2) / 3.0
    assert one.spread() == pytest.approx(10.0 / math.log(10.0) * np.std(across, ddof=1), rel=0.03)


def two_phasors(given, track):
    """Return the level over one sphere's (k,) [dB] of two equal spheres at the same range, by their phases alone."""
    ranges = [
        np.linalg.norm(np.array([12.0, side, 0.0]) + poses(given, track, body)[1], axis=1)
        for body, side in enumerate((0.8, -0.8))
    ]
    # A cell's phase is that at the middle of the ramp.
    middle = C0 / (77e9 + 250e6)
    return db(np.abs(1.0 + np.exp(-4j * np.pi / middle * (ranges[0] - ranges[1]))) ** 2)


def test_two_spheres_in_one_cell_move_as_two_phasors_of_uniform_phase_where_shifts_are_wide():
    pair = scene(ball("one", 12, 0.8, 0), ball("two", 12, -0.8, 0), power_dbm=50.0)
    # sigma of 1/50 of the wavelength: near their sum; of 0.8, turns of the phase by 14 rad: uniform.
    for shift, draws in ((0.08, 10), (3.0, 40)):
        given = Tolerances(turn_deg=0.0, shift_mm=shift, draws=draws)
        (one,) = sensitivity(pair, given).moves
        asked = two_phasors(given, one.track)
        level = one.track.column("level_dbm") - one.track.first.level_dbm + 20.0 * math.log10(2.0)
        strong = asked > -20.0
        assert one.count == draws and strong.mean() > 0.9
        assert level[strong] == pytest.approx(asked[strong], abs=0.1)
        assert one.spread() == pytest.approx(np.std(asked, ddof=1), rel=0.03)
        assert one.verdict(0.5) == (STEADY if shift < 1.0 else SPECKLE)
    # 2 |cos(phi / 2)| of a uniform phase: arccos is uniform from 0 to 1.
    phase = 2.0 / np.pi * np.arccos(np.minimum(0.5 * 10.0 ** (level / 20.0), 1.0))
    assert stats.kstest(phase, "uniform").pvalue > 0.01


def test_a_body_moved_alone_has_the_share_of_its_echo_in_the_cell():
    # Of phasors 1 and a in one cell, either turned by a small phase: levels move alike, so both have half.
    pair = scene(ball("one", 12, 0.8, 0), ball("two", 12, -0.8, 0), ball("far", 20, 3, 0), power_dbm=50.0)
    done = sensitivity(pair, Tolerances(0.0, 1.0, draws=6, each=True))
    near, far = sorted(done.moves, key=lambda m: m.track.first.range)
    assert set(near.shares) == {"one", "two", "far"} == set(done.bodies)
    assert sum(share for _, share in near.shares.values()) == pytest.approx(1.0)
    assert near.shares["one"][1] > 0.1 and near.shares["two"][1] > 0.1 and near.shares["far"][1] < 1e-3
    assert max(far.shares, key=lambda name: far.shares[name]) == "far"
    assert near.shares["far"][0] < 0.05 < near.shares["one"][0]


def test_equal_seeds_give_equal_bytes_and_the_first_draws_are_those_of_fewer(tmp_path):
    given = dataclasses.replace(Tolerances(), draws=4)
    files = [
        write_csv(sensitivity(scene(ball()), given, seed), tmp_path / f"{i}.csv") for i, seed in enumerate((1, 1, 2))
    ]
    one, same, other = (file.read_bytes() for file in files)
    assert one == same != other
    few, more = (sensitivity(scene(ball()), Tolerances(draws=n)).moves[0].track for n in (2, 4))
    assert list(few.column("level_dbm")) == list(more.column("level_dbm")[:2])


def test_a_detection_that_some_draws_do_not_see_is_counted_and_said_to_be_intermittent():
    flat = {"width": 0.3, "height": 0.3}
    plate = rc.Body(name="plate", shape="plate", params=flat, position=(20, 0, 0), yaw_deg=180.6)
    faint = scene(plate, power_dbm=20.0)
    level = rc.simulate(faint).detections.snr.max()
    faint = scene(plate, power_dbm=20.0 - level + 20.0)
    done = sensitivity(faint, Tolerances(0.05, 0.0, draws=12))
    (one,) = done.moves
    assert 0 < one.count < 12
    assert one.verdict(1e3) == INTERMITTENT and "1 " in done.summary()


def sighting(**given):
    return Sighting(
        **{"range": 10.0, "rate": 0.0, "azimuth": math.nan, "level_dbm": -80.0, "error_db": 0.1, "label": "direct"}
        | {"bodies": "car.tail", "met": frozenset(["car"])}
        | given
    )


@pytest.mark.parametrize(
    ("spread", "error", "count", "bodies", "said"),
    [
        (0.1, 0.2, 4, "car", STEADY),
        (2.0, 0.2, 4, "car", SPECKLE),
        (2.0, 2.0, 4, "car", SPECKLE),
        (2.0, 3.0, 4, "car", ERROR),
        (2.0, math.nan, 4, "car", ERROR),
        (2.0, 0.2, 3, "car", SPECKLE),
        (0.1, 3.0, 4, "car", ERROR),
        (0.1, math.nan, 4, "car", ERROR),
        (0.1, 0.2, 3, "car", INTERMITTENT),
        (0.0, 0.2, 1, "car", INTERMITTENT),
        (2.0, 3.0, 3, "car", ERROR),
        (0.1, 3.0, 3, "car", ERROR),
        (0.0, 3.0, 1, "car", ERROR),
        (0.1, math.nan, 3, "car", ERROR),
        (2.0, 0.2, 4, "noise", NOISE),
    ],
)
def test_a_verdict_is_speckle_where_the_spread_exceeds_tolerance_and_stated_error(spread, error, count, bodies, said):
    seen = {i: sighting(level_dbm=-80.0 + spread * (-1) ** i, error_db=error) for i in range(count)}
    moved = Moves(Track(sighting(bodies=bodies), seen), True, 4, {})
    assert moved.verdict(0.5) == said
    # What the legend says of a verdict holds.
    if said in (STEADY, INTERMITTENT):
        assert moved.stated_db <= 0.5 and not moved.spread() > 0.5


def test_the_stated_error_of_a_level_is_the_median_over_the_draws():
    seen = {i: sighting(error_db=e) for i, e in enumerate((0.2, math.nan, 0.4, 0.3, math.nan))}
    assert Moves(Track(sighting(error_db=math.nan), seen), True, 5, {}).stated_db == 0.4
    assert Moves(Track(sighting(error_db=math.nan), {}), True, 5, {}).stated_db == math.inf


def test_detections_are_matched_by_cell_and_bodies_not_by_order(monkeypatch):
    result = rc.simulate(scene(ball()))
    wave = result.receiver.waveform
    step, period = wave.range_resolution, 2.0 * result.rdmap.unambiguous_rate
    first = [sighting(bodies="a", met=frozenset("a")), sighting(bodies="b", met=frozenset("b"))]
    first += [sighting(range=30.0, rate=0.5 * period - 0.01)]
    then = [
        sighting(bodies="b", met=frozenset("b"), range=10.0 + 0.4 * step),
        sighting(bodies="a > road", met=frozenset(["a", "road"]), range=10.0 + step),
        sighting(range=30.0, rate=-0.5 * period + 0.01),
        sighting(range=10.0 + 3.0 * step),
        sighting(bodies="noise", met=frozenset(["noise"])),
    ]
    tracks: list[Track] = []
    for run, found in enumerate((first, then)):
        monkeypatch.setattr(detection_tracks, "sightings", lambda _, found=found: found)
        follow(tracks, run, result)
    assert [sorted(t.seen) for t in tracks] == [[0, 1], [0, 1], [0, 1], [1], [1]]
    assert [t.seen[1] for t in tracks] == [then[1], then[0], then[2], then[3], then[4]]


def test_bodies_turn_about_their_middles_with_their_meshes_and_the_ground_stays():
    road = rc.Body(name="road", shape="ground")
    box = rc.Body(
        name="box", shape="box", params={"length": 2.0}, position=(9, 3, 0.5), yaw_deg=30.0, spin_dps=(0, 9, 0)
    )
    walker = rc.Body(name="who", shape="walker", position=(15, -2, 0))
    still = scene(road, box, walker, position=[0, 0, 1])
    assert movable(still) == ("box", "who")
    by = Displacement(np.radians([1.0, 2.0, 3.0]), np.array([0.01, 0.02, 0.03]))
    moved = displaced(still, {"box": by, "who": by})
    was, now = (s.bodies[1].motion for s in (still, moved))
    middle = still.bodies[1].geometry.bounds.mean(axis=0)
    assert now.to_world(middle) - was.to_world(middle) == pytest.approx(by.shift, abs=1e-12)
    turn = now.rotation() @ was.rotation().T
    angle = np.arccos(0.5 * (np.trace(turn) - 1.0))
    assert angle == pytest.approx(np.linalg.norm(by.turn)) and turn @ by.turn == pytest.approx(by.turn)
    assert moved.bodies[1].geometry is still.bodies[1].geometry and moved.bodies[0] is still.bodies[0]
    assert now.own_spin == was.own_spin
    # All limbs of a walker as one rigid body, now and later.
    for time in (0.0, 0.3):
        spots = [
            np.array([b.motion.to_world(b.geometry.bounds, time) for b in s.bodies[2:]]).reshape(-1, 3)
            for s in (still, moved)
        ]
        apart = [np.linalg.norm(x[:, None] - x, axis=2) for x in spots]
        np.testing.assert_allclose(*apart, atol=1e-9)
    assert len({id(b.motion.whole) for b in moved.bodies[2:]}) == 1
