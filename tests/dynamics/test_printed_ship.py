"""The ship paper's printed linear model: what its matrices say, and which of its lines cannot be."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from raychan.dynamics import ship
from raychan.dynamics.steering import lqr, riccati


def test_the_printed_ship_rolls_in_0_322_s():
    """C081: eigenvalues of equation 4."""
    roll = ship.PRINTED.poles()[np.argmax(ship.PRINTED.poles().imag)]
    period = 2 * np.pi / roll.imag
    assert period == pytest.approx(2 * np.pi / np.sqrt(379.9796), rel=1e-6) and round(period, 3) == 0.322


def test_the_printed_heading_is_out_of_the_rudders_reach():
    """C082: row 5 is zero, so that the rank is 4 and no LQR with a weight on the heading exists."""
    assert np.linalg.matrix_rank(ship.PRINTED.controllability()) == 4
    assert np.linalg.matrix_rank(ship.CORRECTED.controllability()) == 5
    with pytest.raises(ValueError, match="no stabilising solution"):
        lqr(ship.PRINTED)


def test_row_5_corrected_gives_the_printed_closed_loop_poles_without_the_printed_factor():
    """C083 and C084: eig(A - BK) is equation 7 with factor 1 in place of 1e5."""
    poles = np.sort_complex(ship.CORRECTED.poles(ship.PRINTED_GAIN))
    computed = (-0.1437, -0.1007 + 0.0393j, -0.1007 - 0.0393j, -0.0002 + 19.493j, -0.0002 - 19.493j)
    np.testing.assert_allclose(poles, np.sort_complex(np.array(computed)), rtol=0, atol=5e-4)
    np.testing.assert_allclose(poles, np.sort_complex(np.array(ship.PRINTED_POLES)), rtol=0, atol=5e-4)


def test_the_rudder_damps_with_minus_gain_times_state_only():
    """C085."""
    assert ship.CORRECTED.poles(ship.PRINTED_GAIN).real.max() < 0
    assert ship.CORRECTED.poles(-ship.PRINTED_GAIN).real.max() == pytest.approx(0.257, abs=1e-3)


def test_the_yaw_part_of_the_printed_gain_is_optimal_for_fitted_weights():
    """C086: sway, yaw and heading alone; Q = diag(22.61, 100.2, 1) and R = 1 are fitted, not printed."""
    yaw = [0, 2, 4]
    a, b = ship.CORRECTED.a[np.ix_(yaw, yaw)], ship.CORRECTED.b[yaw]
    gain = b @ riccati(a, b, np.diag([22.61, 100.2, 1.0]), 1.0)
    np.testing.assert_allclose(gain, ship.PRINTED_GAIN[yaw], rtol=1e-3)


def test_no_single_rudder_weight_joins_the_printed_riccati_solution_and_gain():
    """C087: B'S / K would be R in every column."""
    ratios = ship.CORRECTED.b @ ship.PRINTED_RICCATI / ship.PRINTED_GAIN
    np.testing.assert_allclose(ratios, [0.629, 14.784, 1.084, -0.867, 2.044], atol=1e-3)


def test_the_printed_hull_fills_more_than_its_block():
    """C089: Table 1."""
    assert ship.block_coefficient(175.0, 25.0, 4.6, 22.2e6) == pytest.approx(1.076, abs=0.01)


@pytest.mark.parametrize("dt", [0.01, 0.37, 5.0])
def test_an_exact_step_is_the_integral_of_the_equations(dt: float):
    model, x = ship.CORRECTED, np.array([0.3, -0.02, 0.01, 0.001, 0.4])
    before, after = 0.1, -0.05
    slow = solve_ivp(
        lambda t, y: model.a @ y + model.b * (before + (after - before) * t / dt),
        (0.0, dt),
        x,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
    )
    np.testing.assert_allclose(ship.exact_step(model, dt)(x, before, after), slow.y[:, -1], rtol=1e-8, atol=1e-9)


def test_two_exact_half_steps_are_one_step():
    whole, half = ship.exact_step(ship.CORRECTED, 0.4), ship.exact_step(ship.CORRECTED, 0.2)
    x = np.array([0.3, -0.02, 0.01, 0.001, 0.4])
    np.testing.assert_allclose(half(half(x, 0.1, 0.15), 0.15, 0.2), whole(x, 0.1, 0.2), rtol=1e-10, atol=1e-12)


def test_eulers_step_is_unstable_beyond_a_microsecond():
    poles = ship.PRINTED.poles()
    stiff = poles[np.argmax(poles.imag)]
    limit = -2 * stiff.real / abs(stiff) ** 2
    assert limit == pytest.approx(7.9e-7, rel=0.01)
    assert abs(1 + stiff * 1.1 * limit) > 1 > abs(1 + stiff * 0.9 * limit)


def test_the_world_pose_turns_left_where_the_heading_turns_left():
    state = np.zeros(10)
    state[ship.Y], state[ship.PSI], state[ship.PHI] = 7.0, 0.3, 0.1
    place, yaw, roll = ship.world_pose(state)
    assert place.tolist() == [0.0, -7.0, 0.0] and (yaw, roll) == (-0.3, 0.1)


def test_a_ship_refuses_what_is_no_ship():
    with pytest.raises(ValueError, match="shape"):
        ship.LinearShip(a=np.eye(4), b=np.zeros(5), speed=1.0)
    with pytest.raises(ValueError, match="not finite"):
        ship.LinearShip(a=np.full((5, 5), np.nan), b=np.zeros(5), speed=1.0)
    with pytest.raises(ValueError, match="speed"):
        ship.LinearShip(a=np.eye(5), b=np.zeros(5), speed=0.0)
    with pytest.raises(ValueError, match="dt"):
        ship.exact_step(ship.CORRECTED, 0.0)
