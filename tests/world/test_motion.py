"""Motion: poses at a time, and velocities as their derivative."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from raychan.poses import rotation
from raychan.world.motion import Motion

angle = st.floats(-3.0, 3.0)
MOVING = Motion((1.0, 2.0, 3.0), 0.4, 0.1, -0.2, (5.0, -1.0, 0.5), 0.7)


@given(angle, angle, angle, st.floats(-5.0, 5.0))
def test_world_and_body_coordinates_undo_each_other(yaw, pitch, roll, time):
    motion = Motion((1.0, -2.0, 0.5), yaw, pitch, roll, (3.0, 4.0, 0.0), 0.2)
    p = np.array([[0.3, -0.7, 2.0]])
    np.testing.assert_allclose(motion.to_body(motion.to_world(p, time), time), p, atol=1e-9)


def test_velocity_is_the_derivative_of_the_place():
    p, t, h = np.array([2.0, 0.5, 1.0]), 0.3, 1e-5
    slope = (MOVING.to_world(p, t + h) - MOVING.to_world(p, t - h)) / (2 * h)
    np.testing.assert_allclose(MOVING.velocity_at(MOVING.to_world(p, t), t), slope, rtol=1e-8)


def test_origin_goes_straight_while_the_body_turns():
    np.testing.assert_allclose(MOVING.origin(2.0), [11.0, 0.0, 4.0])
    np.testing.assert_allclose(MOVING.rotation(1.0), rotation(1.1, 0.1, -0.2))
    assert MOVING.heading(1.0) == pytest.approx(1.1)
