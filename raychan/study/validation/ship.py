"""Measures of the ship paper's printed linear ship, its gain, and the published container ship beside it."""

from __future__ import annotations

from typing import Any

import numpy as np

from raychan.dynamics import container, ship
from raychan.dynamics.steering import HeadingProgramme, StateFeedback, SteeringGear, lqr, riccati
from raychan.dynamics.voyage import LinearPlant, Track, sail
from raychan.study.validation.bench import Bench
from raychan.study.validation.measures import Seen, measure

_SPEED = 20.0 * ship.KNOT
_STEP, _LONG = 0.05, 200.0  # s: of the course change
_ROLLS = 0.2  # rad/s: a pole that turns faster is the roll's, not the steering's


def _model(row_5_corrected: bool) -> ship.LinearShip:
    return ship.CORRECTED if row_5_corrected else ship.PRINTED


@measure
def ship_roll_period(bench: Bench) -> Seen:
    """Return the roll period [s] of the printed ship."""
    return float(2.0 * np.pi / ship.PRINTED.poles().imag.max())


@measure
def ship_rank(bench: Bench, row_5_corrected: bool) -> Seen:
    """Return the rank of the controllability matrix."""
    return int(np.linalg.matrix_rank(_model(row_5_corrected).controllability()))


@measure
def ship_pole(bench: Bench, number: int, part: str, sign: float = 1.0) -> Seen:
    """Return the real or imaginary part [1/s] of a closed-loop pole, row 5 corrected; sign -1 for u = +K x.

    Poles are ordered by the real part, of pairs the upper one: 0 yaw, 1 sway and yaw, 2 roll.
    """
    poles = ship.CORRECTED.poles(sign * ship.PRINTED_GAIN)
    upper = poles[poles.imag > -1e-9]
    return float(getattr(upper[np.argsort(upper.real)][number], part))


@measure
def ship_pole_factor(bench: Bench) -> Seen:
    """Return the greatest closed-loop pole over the greatest printed one, without the printed factor."""
    poles = ship.CORRECTED.poles(ship.PRINTED_GAIN)
    return float(np.abs(poles).max() / np.abs(ship.PRINTED_POLES).max())


@measure
def ship_growth(bench: Bench, sign: float) -> Seen:
    """Return the greatest real part [1/s] of the closed-loop poles, for u = -K x (sign 1) or +K x (-1)."""
    return float(ship.CORRECTED.poles(sign * ship.PRINTED_GAIN).real.max())


@measure
def ship_optimal_gain(bench: Bench, state: int, weights: list[float]) -> Seen:
    """Return the gain of sway, yaw rate or heading (0, 1, 2) alone that is optimal for weights of these, and R = 1."""
    yaw = [0, 2, 4]
    a, b = ship.CORRECTED.a[np.ix_(yaw, yaw)], ship.CORRECTED.b[yaw]
    return float((b @ riccati(a, b, np.diag(weights), 1.0))[state])


@measure
def ship_rudder_weight(bench: Bench, state: int) -> Seen:
    """Return the rudder weight R that joins the printed Riccati solution and gain in one state: (B'S) / K."""
    return float((ship.CORRECTED.b @ ship.PRINTED_RICCATI / ship.PRINTED_GAIN)[state])


@measure
def ship_entry(bench: Bench, row: int, column: int) -> Seen:
    """Return an entry of A of the published container ship at 7 m/s, the speed of its publication."""
    return float(container.published_linear(7.0).a[row, column])


@measure
def ship_roll_stiffness(bench: Bench, coupled: bool) -> Seen:
    """Return the roll stiffness over inertia [1/s2] of the published container ship at 7 m/s, roll alone or coupled."""
    if coupled:
        return -float(container.published_linear(7.0).a[1, 3])
    return float(container.PUBLISHED_G[2] / container.PUBLISHED_M[2, 2] * (7.0 / container.LENGTH) ** 2)


@measure
def ship_block(bench: Bench, length: float, beam: float, draught: float, tonnes: float) -> Seen:
    """Return the block coefficient of a hull: lengths [m], displacement [t]."""
    return ship.block_coefficient(length, beam, draught, 1e3 * tonnes)


def _course_change(limit_deg: float | None) -> Track:
    """Return the voyage from north to east with the printed gain, the rudder limited or not."""
    gear = SteeringGear() if limit_deg is None else SteeringGear(max_angle=np.radians(limit_deg))
    start: Any = np.zeros(10)
    start[ship.U] = _SPEED
    plant = LinearPlant(ship.exact_step(ship.CORRECTED, _STEP), gear)
    east = HeadingProgramme(times=np.array([0.0]), headings=np.array([0.5 * np.pi]))
    return sail(plant, start, StateFeedback(ship.PRINTED_GAIN), east, _LONG)


@measure
def ship_settling(bench: Bench, limit_deg: float = 0.0) -> Seen:
    """Return the settling time [s] to 2 % of a course change by 90 deg, the rudder limited [deg], 0 for no limit."""
    return float(_course_change(limit_deg or None).settling_time())


@measure
def ship_first_order(bench: Bench) -> Seen:
    """Return the rudder [deg] that is ordered first for a course change by 90 deg, without its sign."""
    return float(abs(np.degrees(_course_change(None).order[0])))


@measure
def ship_roll_damping(bench: Bench, steered: bool) -> Seen:
    """Return the damping ratio of the roll of the published container ship at 20 knots, without and with its LQR."""
    model = container.published_linear(_SPEED)
    poles = model.poles(lqr(model).gain if steered else None)
    fast = poles[poles.imag > _ROLLS]
    return float(ship.natural_frequency_and_damping(complex(fast[np.argmax(fast.imag)]))[1])
