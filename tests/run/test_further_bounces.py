"""What the ledger says of further bounces, against runs with more of them, and where other echoes stand beside."""

import numpy as np
import pytest

import raychan as rc
from raychan.run.ledger_entry import SEEN
from raychan.run.mechanisms import interactions

WAVE = rc.Waveform(carrier=24e9, bandwidth=1e9, chirp_duration=40e-6, n_chirps=16, n_samples=128)


def run(bodies, bounces, **radar):
    mount = rc.Radar(WAVE, position=(0.0, 0.0, 0.6), **({"power": 0.1} | radar))
    model = {"max_bounces": bounces, "tolerance_db": 1.0}
    return rc.simulate(rc.Scene(bodies=bodies, radar=mount, model=model), seed=1)


def told(result):
    return [line for line in result.warnings if "further bounces" in line]


def corner(size=0.1, position=(6.259, 1.931, 0.6), yaw_deg=153.16):
    return rc.Body(name="corner", shape="trihedral", params={"size": size}, position=position, yaw_deg=yaw_deg)


def test_what_a_third_bounce_changes_of_a_corner_over_ground_is_told_beside_the_foot_point():
    """The ground straight below the radar is 45 dB stronger, and no lower order of the corner's waves."""
    ground = rc.Body(name="ground", shape="ground", material="asphalt")
    short, whole = (run([corner(), ground], n) for n in (2, 3))
    levels, at = short.rdmap.power, tuple(short.detections.cell[1])
    assert short.detections.snr[0] > short.detections.snr[1] + 40.0
    assert abs(10.0 * np.log10(levels[at] / whole.rdmap.power[at])) > 4.0 > 4.0 * short.detections.error_db[1]
    assert told(short)
    assert short.ledger["further bounces"].level_db == pytest.approx(0.0, abs=6.0)


def test_what_a_wall_shows_of_a_ball_at_both_ends_is_told_beside_the_echo_of_the_wall():
    """The radar's foot point on the wall is 23 dB stronger, and not where waves to the ball meet the wall."""
    ball = rc.Body(name="ball", shape="sphere", params={"radius": 0.3}, position=(7.0, 0.3, 1.2))
    wall = rc.Body(name="wall", shape="wall", params={"length": 12.0}, position=(6.0, -2.5, 0.0))
    short, whole = (run([ball, wall], n) for n in (2, 3))
    assert short.detections.snr[0] > short.detections.snr[1] + 20.0
    levels, at = short.rdmap.power, tuple(whole.detections.cell[-1])
    assert whole.detections.snr[-1] > 25.0 and whole.rdmap.power[at] > 4.0 * levels[at]
    assert told(short) and -10.0 < short.ledger["further bounces"].level_db < 3.0


def test_an_echo_that_meets_nothing_else_does_not_change_the_estimate():
    """A plate square on above the radar returns its own echo alone, 30 dB over the corner's."""
    aside = rc.Body(
        name="aside", shape="plate", params={"width": 0.3, "height": 0.3}, position=(0.0, 0.0, 6.6), pitch_deg=90.0
    )
    level = []
    for bodies in ([corner(0.15, (5.0, 0.3, 0.6), 215.0)], [corner(0.15, (5.0, 0.3, 0.6), 215.0), aside]):
        found = run(bodies, 2)
        level.append(found.ledger["further bounces"].level_db + 10.0 * np.log10(found.detections.power.min()))
    assert found.detections.snr.max() > found.detections.snr.min() + 30.0
    assert level[0] == pytest.approx(level[1], abs=0.1)


def test_where_nothing_is_detected_further_bounces_stand_against_the_weakest_detection_possible():
    """A rail returns by three bounces what two leave undetected."""
    rail = rc.Body(
        name="rail", shape="guard_rail", params={"length": 1.93}, position=(7.214, -0.365, 0.0), yaw_deg=215.74
    )
    short, whole = (run([rail], n, power=0.07) for n in (2, 3))
    assert not len(short.detections.range) and len(whole.detections.range)
    (line,) = told(short)
    assert line.startswith("left out, below the weakest detection possible but may move one by over 1 dB: further")


def test_one_bounce_tells_that_waves_meet_a_second_surface_and_of_convex_bodies_nothing():
    behind = [corner(0.3, (8.0, 0.0, 0.6), 180.0)]
    short, whole = run(behind, 1), run(behind, 3)
    assert whole.detections.snr.max() > short.detections.snr.max(initial=0.0) + 20.0
    assert short.ledger["further bounces"].kind == SEEN
    assert told(short) == [
        "left out, of unknown level: further bounces: waves meet a second surface, but one bounce is modelled "
        "(model.max_bounces): nothing to extrapolate from"
    ]
    for shape in ("box", "sphere", "plate"):
        assert told(run([rc.Body(name="body", shape=shape, position=(8.0, 0.0, 0.6))], 1)) == []


def test_a_target_that_only_a_mirror_shows_has_no_lower_order_to_extrapolate_from():
    """Around a corner a target of given RCS returns by three interactions, not by two."""
    sheets = {"mirror": (5.0, 0.0, 135.0, 0.8), "wall": (2.5, 1.5, 211.0, 0.6)}
    bodies = [
        rc.Body(name=name, shape="plate", params={"width": s, "height": s}, position=(x, y, 0.6), yaw_deg=yaw)
        for name, (x, y, yaw, s) in sheets.items()
    ]
    target = rc.Body(name="target", shape="sphere", params={"radius": 0.01}, position=(5.0, 3.0, 0.6), rcs_dbsm=10.0)
    found = run([*bodies, target], 3)
    names = found.paths.bodies[interactions(found.paths) == 2]
    assert np.abs(found.detections.range - 8.0).min() < 0.1 and not (names == "target").any()
    how = "no path has 2 interactions over the same bodies: nothing to extrapolate from"
    assert found.ledger["further bounces"].how == how
