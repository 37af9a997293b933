"""What a drawing adds for the eye: a level for the scale, and marks for bodies too small to be seen."""

from __future__ import annotations

import numpy as np
import pytest

import raychan as rc
from raychan.view.scale import arcs
from raychan.view.scene import drawing_of

RADAR = rc.Radar(rc.Waveform(carrier=77e9, bandwidth=500e6, chirp_duration=20e-6), position=(0.0, 0.0, 1.0))


def seen(*bodies: rc.Body):
    return drawing_of(rc.Scene(bodies=bodies, radar=RADAR))


def ball(name: str, radius: float, x: float) -> rc.Body:
    return rc.Body(name=name, shape="sphere", params={"radius": radius}, position=(x, 0.0, 3.0))


def test_without_ground_the_scale_lies_level_with_the_lowest_of_a_scene_and_two_metres_around():
    low, high = seen(ball("a", 0.5, 20.0)).floor()
    np.testing.assert_allclose(low, [-2.0, -2.5, 1.0], atol=0.02)
    np.testing.assert_allclose(high, [22.5, 2.5, 1.0], atol=0.02)


def test_with_ground_the_scale_lies_on_it():
    drawing = seen(rc.Body(name="road", shape="ground", position=(0.0, 0.0, -0.3)), ball("a", 0.5, 20.0))
    corners = next(s.triangles for s in drawing.shapes if s.name == "ground").reshape(-1, 3)
    np.testing.assert_array_equal(drawing.floor(), [corners.min(axis=0), corners.max(axis=0)])
    assert corners[:, 2] == pytest.approx(-0.3)


@pytest.mark.parametrize("x", [20.0, 200.0, 5e4])
@pytest.mark.parametrize("yaw", [0.0, 180.0])
def test_every_range_has_an_arc_about_the_radar_wherever_it_stands_and_looks(x, yaw):
    place = (x, 0.0, 1.0)
    there = rc.Radar(RADAR.waveform, position=place, yaw_deg=yaw)
    drawn = arcs(drawing_of(rc.Scene(bodies=[ball("a", 0.5, 2.0 * x if yaw == 0.0 else 0.0)], radar=there)))
    steps = np.diff([0.0, *(arc.range for arc in drawn)])
    assert 4 <= len(drawn) <= 12 and np.ptp(steps) == 0.0
    assert drawn[-1].range + steps[0] > x
    for arc in drawn:
        for line in arc.lines:
            np.testing.assert_allclose(np.hypot(*(line - place)[:, :2].T), arc.range)
        ahead, left = (arc.label - place)[:2] * np.cos(np.radians(yaw))
        assert ahead > -1e-9 * x and left <= 0.0


def test_bodies_smaller_than_a_size_are_marked_where_they_are_in_their_colour_and_no_others():
    drawing = seen(ball("large", 0.5, 20.0), ball("small", 0.01, 10.0))
    (place, colour), *others = drawing.specks(0.1)
    assert not others and place == pytest.approx((10.0, 0.0, 3.01), abs=1e-3)
    assert colour == next(s.colour for s in drawing.shapes if s.name == "small")
    assert len(drawing.specks(2.0)) == 2
