"""The container ship S-175 of Son and Nomoto: surge, sway, yaw and roll with cubic hull forces, rudder and shaft.

A positive rudder turns to starboard. Forces are non-dimensional by speed U and length L (the prime system): force by
rho L^2 U^2 / 2, moment by rho L^3 U^2 / 2, time by L / U.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass

import numpy as np

from raychan.dynamics.ship import DELTA, OF_LINEAR, PSI, Array, LinearShip, N, U, frozen

LENGTH, VOLUME = 175.0, 21222.0
"""Length [m] and displaced volume [m3]."""
GRAVITY = 9.81
METACENTRIC_HEIGHT = 0.3
"""GM [m]: low, so that the ship heels far in a turn."""

MASS, ADDED_SURGE, ADDED_SWAY = 0.00792, 0.000238, 0.007049
INERTIA = frozen(
    (
        (MASS + ADDED_SWAY, -ADDED_SWAY * 0.0313, ADDED_SWAY * 0.05),
        (-ADDED_SWAY * 0.0313, 0.0000176 + 0.0000034, 0.0),
        (ADDED_SWAY * 0.05, 0.0, 0.000456 + 0.000419),
    ),
    (3, 3),
    "inertia",
)
"""Of (sway, roll, yaw), added mass with its lever arms l_y = 0.0313 and alpha_y = 0.05 included."""
_INVERSE_ROWS = np.linalg.inv(INERTIA).tolist()

HULL = frozen(
    np.array(
        (
            # sway Y, roll K, yaw N
            (-0.0116, 0.0003026, -0.0038545),  # v
            (0.00242, -0.000063, -0.00222),  # r
            (0.0, -0.0000075, 0.000213),  # p
            (-0.000063, -0.000021, -0.0001424),  # phi
            (-0.109, 0.002843, 0.001492),  # v v v
            (0.00177, -0.0000462, -0.00229),  # r r r
            (0.0214, -0.000588, -0.0424),  # v v r
            (-0.0405, 0.0010565, 0.00156),  # v r r
            (0.04605, -0.0012012, -0.019058),  # v v phi
            (0.00304, -0.0000793, -0.0053766),  # v phi phi
            (0.009325, -0.000243, -0.0038592),  # r r phi
            (-0.001368, 0.00003569, 0.0024195),  # r phi phi
        )
    ).T,
    (3, 12),
    "hull",
)
"""Hull derivatives of sway force Y, roll moment K and yaw moment N."""
_HULL_ROWS = HULL.tolist()
X_UU, X_VR, X_RR, X_PHIPHI, X_VV = -0.0004226, -0.00311, 0.00020, -0.00020, -0.00386
"""Hull derivatives of the surge force."""

PROPELLER_DIAMETER, THRUST_DEDUCTION, WAKE, PROPELLER_POSITION, TAU = 6.533, 0.175, 0.184, -0.526, 1.09
KT_0, KT_J = 0.527, -0.455
"""Thrust coefficient KT = KT_0 + KT_J J of the advance ratio J."""
RUDDER_AREA, ASPECT_RATIO = 33.0376, 1.8219
HULL_LIFT, RUDDER_POSITION, HULL_LIFT_POSITION, RUDDER_HEIGHT, RUDDER_DRAG = 0.237, -0.5, -0.48, 0.033, 0.71
RACE, RUDDER_WAKE, FLOW_STRAIGHTENING = 0.631, 0.921, 0.088
FLOW_R, FLOW_RRR, FLOW_RRV = -0.156, -0.275, 1.96


@dataclass(frozen=True)
class Orders:
    """What the bridge orders: rudder angle `delta` [rad], positive to starboard, and shaft speed `n` [rev/s]."""

    delta: float
    n: float


@dataclass(frozen=True)
class Machinery:
    """Limits and lags of steering gear and shaft: angle [rad], rate [rad/s], lag [s]; shaft speed [rev/s].

    Source: Fossen, MSS container.m (10 deg, 5 deg/s, 1 s, 160 rev/min).
    """

    max_rudder: float = np.radians(10.0)
    max_rudder_rate: float = np.radians(5.0)
    rudder_lag: float = 1.0
    max_shaft: float = 160.0 / 60.0

    def __post_init__(self) -> None:
        for name in ("max_rudder", "max_rudder_rate", "rudder_lag", "max_shaft"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be positive")

    def rates(self, delta: float, n: float, orders: Orders) -> tuple[float, float]:
        """Return the rates of rudder [rad/s] and shaft speed [rev/s^2] towards what is ordered."""
        ordered = min(max(orders.delta, -self.max_rudder), self.max_rudder)
        rate = (ordered - delta) / self.rudder_lag
        lag = 5.65 / n if n > 0.3 else 18.83
        shaft = min(max(orders.n, -self.max_shaft), self.max_shaft)
        return min(max(rate, -self.max_rudder_rate), self.max_rudder_rate), (shaft - n) / lag


def _rudder_normal_force(v: float, r: float, delta: float, inflow: float, race: float) -> float:
    """Return the normal force F_N on the rudder (prime system) in the propeller's inflow and its race squared."""
    across = FLOW_STRAIGHTENING * v + FLOW_R * r + FLOW_RRR * r**3 + FLOW_RRV * r * r * v
    # Of a propeller that brakes (far too slow for the ship's speed) the race comes to rest at most.
    along = RUDDER_WAKE * math.sqrt(max(inflow * inflow + race, 0.0))
    slope = 6.13 * ASPECT_RATIO / (ASPECT_RATIO + 2.25) * RUDDER_AREA / LENGTH**2
    return -slope * (along * along + across * across) * math.sin(delta + math.atan2(across, along))


def accelerations(state: Array) -> tuple[float, float, float, float]:
    """Return the rates of u, v [m/s^2], p and r [rad/s^2] of a full state (10,) of `ship.STATE`.

    Raises: ValueError where the ship does not go ahead under power: the model's coefficients hold ahead only.
    Source: Son and Nomoto 1982, Naval Architecture and Ocean Engineering 20, 73-83; coefficients as in MSS container.m.
    """
    # Python's own numbers: numpy's take five times as long one by one (a closed loop calls this 300 times a second).
    surge, sway, r_, _, _, _, p_, phi, delta, shaft = state.tolist()
    speed = math.hypot(surge, sway)
    if not (surge > 0.0 and shaft > 0.0):
        raise ValueError(f"u = {surge} m/s, n = {shaft} rev/s: the ship must go ahead with its propeller turning")
    per = LENGTH / speed
    u, v = surge / speed, sway / speed
    p, r = p_ * per, r_ * per
    inflow = u * (1.0 - WAKE + TAU * (v + PROPELLER_POSITION * r) ** 2)
    advance = inflow * speed / (shaft * PROPELLER_DIAMETER)
    coefficient = KT_0 + KT_J * advance
    race = 8.0 * RACE * coefficient / math.pi * (shaft * PROPELLER_DIAMETER / speed) ** 2
    normal = _rudder_normal_force(v, r, delta, inflow, race)
    thrust = 2.0 * PROPELLER_DIAMETER**4 / (speed * LENGTH) ** 2 * coefficient * shaft * shaft

    ahead = X_UU * u * u + (1.0 - THRUST_DEDUCTION) * thrust + X_VR * v * r + X_VV * v * v + X_RR * r * r
    ahead += X_PHIPHI * phi * phi + RUDDER_DRAG * normal * math.sin(delta) + (MASS + ADDED_SWAY) * v * r
    terms = (v, r, p, phi, v**3, r**3, v * v * r, v * r * r, v * v * phi, v * phi * phi, r * r * phi, r * phi * phi)
    side, heel, turn = (sum(map(operator.mul, row, terms)) for row in _HULL_ROWS)
    across = normal * math.cos(delta)
    weight = 2.0 * GRAVITY * VOLUME / (LENGTH * speed) ** 2
    side += (1.0 + HULL_LIFT) * across - (MASS + ADDED_SURGE) * u * r
    heel += -(1.0 + HULL_LIFT) * RUDDER_HEIGHT * across + ADDED_SURGE * 0.0313 * u * r
    heel -= weight * METACENTRIC_HEIGHT / LENGTH * phi
    turn += (RUDDER_POSITION + HULL_LIFT * HULL_LIFT_POSITION) * across
    dv, dp, dr = (a * side + b * heel + c * turn for a, b, c in _INVERSE_ROWS)
    return ahead / (MASS + ADDED_SURGE) * speed / per, dv * speed / per, dp / per**2, dr / per**2


def rates(state: Array, orders: Orders, machinery: Machinery) -> Array:
    """Return the time derivative (10,) of a full state (10,) of `ship.STATE`."""
    u, v, r, _, _, psi, p, phi, delta, n = state.tolist()
    du, dv, dp, dr = accelerations(state)
    ddelta, dn = machinery.rates(delta, n, orders)
    c, s, upright = math.cos(psi), math.sin(psi), math.cos(phi)
    north, east = c * u - s * upright * v, s * u + c * upright * v
    return np.array([du, dv, dr, north, east, upright * r, dp, p, ddelta, dn])


def advance(state: Array, orders: Orders, dt: float, machinery: Machinery | None = None) -> Array:
    """Return the state (10,) after `dt` [s], by one Runge-Kutta step of fourth order."""
    gear = machinery or Machinery()
    k1 = rates(state, orders, gear)
    k2 = rates(state + 0.5 * dt * k1, orders, gear)
    k3 = rates(state + 0.5 * dt * k2, orders, gear)
    k4 = rates(state + dt * k3, orders, gear)
    return np.asarray(state + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))


def service_shaft_speed(speed: float) -> float:
    """Return the shaft speed [rev/s] that holds a speed [m/s] straight ahead: the root of thrust = resistance."""
    if not 0.0 < speed < np.inf:
        raise ValueError(f"speed is {speed} m/s; it must be positive")
    lost = X_UU * (speed * LENGTH) ** 2 / (2.0 * PROPELLER_DIAMETER**4 * (1.0 - THRUST_DEDUCTION))
    linear = KT_J * (1.0 - WAKE) * speed / PROPELLER_DIAMETER
    return float((-linear + np.sqrt(linear * linear - 4.0 * KT_0 * lost)) / (2.0 * KT_0))


def straight(speed: float, heading: float = 0.0) -> Array:
    """Return the full state (10,) of the ship straight ahead at a speed [m/s] that its propeller holds."""
    state = np.zeros(10)
    state[U], state[PSI], state[N] = speed, heading, service_shaft_speed(speed)
    return state


def linearised(speed: float) -> LinearShip:
    """Return the ship about straight running at `speed` [m/s], by central differences.

    Step 1e-5 in units of speed, of speed over length and of a radian: cubic terms then add 1e-10 of a coefficient.
    """
    about = straight(speed)
    scale = np.array([speed, speed / LENGTH, speed / LENGTH, 1.0, 1.0, 1.0]) * 1e-5
    columns = []
    for place, step in zip((*OF_LINEAR, DELTA), scale, strict=True):
        nudge = np.zeros(10)
        nudge[place] = step
        ahead, behind = accelerations(about + nudge), accelerations(about - nudge)
        columns.append([(ahead[k] - behind[k]) / (2.0 * step) for k in (1, 2, 3)])
    a = np.zeros((5, 5))
    b = np.zeros(5)
    a[:3] = np.array(columns[:5]).T
    a[3, 1] = a[4, 2] = 1.0
    b[:3] = columns[5]
    return LinearShip(a=a, b=b, speed=speed)


PUBLISHED_M = frozen(
    ((0.01497, 0.0003525, -0.0002205), (0.0003525, 0.000875, 0.0), (-0.0002205, 0.0, 0.0000210)), (3, 3), "M"
)
PUBLISHED_N = frozen(
    ((0.012035, 0.00522, 0.0), (0.0038436, 0.00243, -0.000213), (-0.000314, 0.0000692, 0.0000075)), (3, 3), "N"
)
PUBLISHED_G = frozen((0.0000704, 0.0001468, 0.0004966), (3,), "G")
PUBLISHED_B = frozen((-0.002578, 0.00126, 0.0000855), (3,), "b")
"""Inertia, damping, roll stiffness and rudder of (v, r, p) of the published linear ship, prime system at 7 m/s."""


def published_linear(speed: float) -> LinearShip:
    """Return the linear container ship that MSS publishes, scaled to `speed` [m/s].

    Its roll stiffness is scaled with speed squared like a hull force, though buoyancy does not grow with speed: it is
    right at 7 m/s, and 2.2 times too stiff at 20 knots.
    Source: Fossen, MSS Lcontainer.m, after Son and Nomoto 1982.
    """
    size = np.diag([1.0, 1.0 / LENGTH, 1.0 / LENGTH])
    per = speed / LENGTH
    solved = np.linalg.solve(PUBLISHED_M, np.column_stack([PUBLISHED_N, PUBLISHED_G, PUBLISHED_B]))
    damping = -per * size @ solved[:, :3] @ np.diag([1.0, LENGTH, LENGTH])
    stiffness = -(per**2) * LENGTH * size @ solved[:, 3]
    rudder = per * speed * size @ solved[:, 4]
    a, b = np.zeros((5, 5)), np.zeros(5)
    order = [0, 2, 1]  # (v, r, p) to (v, p, r)
    a[:3, :3] = damping[np.ix_(order, order)]
    a[:3, 3], b[:3] = stiffness[order], rudder[order]
    a[3, 1] = a[4, 2] = 1.0
    return LinearShip(a=a, b=b, speed=speed)
