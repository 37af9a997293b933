"""A motor yacht of 11 m and 3 t with 2 x 250 hp, for the shape of a sea trial: Nomoto's yaw, heel by static stability.

The hull and its power are the ship paper's; all else is assumed, as each constant says. Displacement speeds: the hull
heels away from the turn; a planing hull would lean into it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from raychan.dynamics.ship import (
    KNOT,
    PSI,
    Array,
    ExactStep,
    LinearShip,
    N,
    U,
    X,
    Y,
    exact_step,
    over_ground,
)
from raychan.dynamics.steering import SteeringGear
from raychan.dynamics.voyage import steered

LENGTH, MASS, POWER, TOP_SPEED = 11.0, 3000.0, 2 * 250 * 745.7, 35.0 * KNOT
"""Length [m], mass [kg], power [W], top speed [m/s]: as the ship paper prints them."""
GRAVITY = 9.81
GM, GYRADIUS, HEEL_ARM = 1.2, 1.3, 0.9
"""Metacentric height [m], roll gyradius with added mass [m], and how far [m] the centre of gravity lies above that of
the sideways force of the water: assumed for a beam of 3.5 m (gyradius 0.37 of it)."""
ROLL_DAMPING = 0.15
"""Damping ratio of roll; assumed: hulls with chines have 0.1 to 0.2."""
TURNING, LAG = 1.0, 1.0
"""Nomoto's K L/U and T U/L; assumed: a steady circle of 3.8 lengths across at 30 deg of rudder, and Norrbin's heading
change in one length per rudder angle, K'/(2 T'), of 0.5."""
PIVOT = 0.3
"""Pivot point ahead of amidships in lengths; assumed, as for most ships in a steady turn."""
PROPULSION = 0.5
"""Thrust power over engine power; assumed."""
TOP_SHAFT = 30.0
"""Shaft speed [rev/s] at top speed; assumed, 1800 rev/min. Speed held is in proportion to it."""


def linear(speed: float) -> LinearShip:
    """Return the yacht about a straight course at `speed` [m/s]; a positive rudder turns to starboard.

    T dr/dt + r = K delta with K = K' U/L and T = T' L/U. Sway follows the pivot point: v = -0.3 L r, with yaw's lag.
    Roll: k^2 d2phi/dt2 + ... + g GM phi = -U r h, so that a steady turn heels outward by U r h / (g GM).
    Source: Nomoto et al. 1957; Fossen 2011, sections 7.2 and 4.3.
    """
    k, t = TURNING * speed / LENGTH, LAG * LENGTH / speed
    stiffness = GRAVITY * GM / GYRADIUS**2
    a, b = np.zeros((5, 5)), np.zeros(5)
    a[0, 0], a[0, 2] = -1.0 / t, -PIVOT * LENGTH / t
    a[1, 1], a[1, 2], a[1, 3] = -2.0 * ROLL_DAMPING * np.sqrt(stiffness), -speed * HEEL_ARM / GYRADIUS**2, -stiffness
    a[2, 2], b[2] = -1.0 / t, k / t
    a[3, 1] = a[4, 2] = 1.0
    return LinearShip(a=a, b=b, speed=speed)


def shaft_speed(speed: float) -> float:
    """Return the shaft speed [rev/s] that holds a speed [m/s]."""
    return TOP_SHAFT * speed / TOP_SPEED


def surge_lag(speed: float) -> float:
    """Return the time constant [s] of surge about a speed [m/s]: m / (2 D U) with a drag D U^2 that takes the thrust
    power at top speed."""
    drag = PROPULSION * POWER / TOP_SPEED**3
    return MASS / (2.0 * drag * speed)


@dataclass(frozen=True)
class YachtPlant:
    """The yacht at an ordered shaft speed [rev/s]: exact steps of sway, roll and yaw at the coefficients of one speed,
    and a surge that follows the shaft with `lag` [s]."""

    step: ExactStep
    shaft: float
    lag: float
    gear: SteeringGear = field(default_factory=SteeringGear)

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self.step.dt

    def advance(self, state: Array, order: float) -> Array:
        """Return the full state (10,) one step on."""
        after = steered(self.step, self.gear, state, order)
        held = self.shaft / TOP_SHAFT * TOP_SPEED
        after[U] = held + (state[U] - held) * np.exp(-self.dt / self.lag)
        after[N] = self.shaft
        after[[X, Y]] += 0.5 * self.dt * (over_ground(state) + over_ground(after))
        return after

    def at_shaft(self, shaft: float) -> YachtPlant:
        """Return the plant at another shaft speed [rev/s]. Raises: ValueError beyond what the engines turn."""
        if not 0.0 <= shaft <= TOP_SHAFT:
            raise ValueError(f"shaft speed {shaft} rev/s; allowed: 0 to {TOP_SHAFT:g}")
        return replace(self, shaft=shaft)


def plant(speed: float, dt: float, gear: SteeringGear) -> YachtPlant:
    """Return the yacht held at `speed` [m/s], in steps of `dt` [s]."""
    return YachtPlant(step=exact_step(linear(speed), dt), shaft=shaft_speed(speed), lag=surge_lag(speed), gear=gear)


def straight(speed: float, heading: float = 0.0) -> Array:
    """Return the full state (10,) of the yacht straight ahead at a speed [m/s]."""
    state = np.zeros(10)
    state[U], state[PSI], state[N] = speed, heading, shaft_speed(speed)
    return state
