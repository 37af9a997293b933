"""The bridge of a ship: plant, autopilot, programme and sensors of its scene, carried one step at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from raychan.dynamics import container, yacht
from raychan.dynamics.avoidance import Lookout, Prediction
from raychan.dynamics.kalman import Disturbance, Noise, kalman_filter
from raychan.dynamics.ship import (
    CORRECTED,
    DELTA,
    KNOT,
    OF_LINEAR,
    PRINTED,
    PSI,
    Array,
    LinearShip,
    U,
    X,
    Y,
    exact_step,
    over_ground,
)
from raychan.dynamics.steering import (
    PD,
    Autopilot,
    HeadingProgramme,
    StateFeedback,
    SteeringGear,
    WayPoints,
    lqr,
    pd_by_poles,
)
from raychan.dynamics.voyage import ContainerPlant, LinearPlant, Programme, Watch
from raychan.run.ship.schema import ProgrammeTable, ShipFile, ShipTable, SteeringNoiseTable, SteeringTable
from raychan.world.errors import SceneError

_PLACES = list(OF_LINEAR)
_YACHT_SPEED = 12.0 * KNOT
_TURNS = "a ship whose rudder turns it (any ship.model but 'printed')"
_CHOICE = 0.2  # seconds from one choice of heading to the next: each takes some milliseconds


@dataclass(frozen=True)
class Bridge:
    """What steers a ship: `plant`, `start` (10,), `ship` about its straight course, `autopilot`, `programme`.

    `watch`: how the autopilot learns the state (LQG), None: it knows it; `disturbance`: what acts on the ship, or None;
    `avoid`: how the ship answers headings, and the distance [m] that it keeps from echoes, or None.
    """

    plant: Any
    start: Array
    ship: LinearShip
    autopilot: Autopilot
    programme: Programme
    watch: Watch | None = None
    disturbance: Disturbance | None = None
    avoid: tuple[Prediction, float] | None = None

    @property
    def takes_shaft(self) -> bool:
        """Whether the ship's speed follows its shaft; the linear ship keeps its speed."""
        return hasattr(self.plant, "at_shaft")


def bridge_of(tables: ShipFile, dt: float) -> Bridge:
    """Return the bridge of a scene's tables, in steps of `dt` [s]. Raises: SceneError where they do not fit."""
    ship, steering = tables.ship, tables.steering
    plant, start, linear = _plant(ship, steering, dt)
    start[X], start[Y] = ship.position[0], -ship.position[1]
    noise = _noise(steering)
    watch = None
    if noise is not None and steering.controller == "lqg":
        allowed = f"{_TURNS}, or controller = 'pd'"
        watch = _tried("steering.controller", lambda: Watch(kalman_filter(linear, noise, dt), noise), allowed)
    autopilot, avoid = _autopilot(steering, linear), None
    if tables.avoidance is not None:
        avoid = Prediction.of(linear, autopilot.gain, _gear(steering)), tables.avoidance.distance_m
    return Bridge(
        plant=plant,
        start=start,
        ship=linear,
        autopilot=autopilot,
        avoid=avoid,
        programme=_programme(tables.programme, float(start[PSI])),
        watch=watch,
        disturbance=None if noise is None else Disturbance.of(linear, noise, dt),
    )


def _tried(key: str, make: Callable[[], Any], allowed: str = "") -> Any:
    """Return what is made; what does not fit is an error of the scene's key."""
    try:
        return make()
    except ValueError as error:
        raise SceneError(str(error), key=key, allowed=allowed) from error


def _plant(ship: ShipTable, steering: SteeringTable, dt: float) -> tuple[Any, Array, LinearShip]:
    """Return a model's plant, its full state (10,) at the start, and it about its straight course."""
    gear, heading = _gear(steering), float(np.radians(ship.heading_deg))
    if ship.model == "container":
        speed = ship.speed_mps or 20.0 * KNOT
        machinery = container.Machinery(max_rudder=gear.max_angle, max_rudder_rate=gear.max_rate)
        shaft = container.service_shaft_speed(speed)
        if shaft > machinery.max_shaft:
            fastest = (
                f"at most {machinery.max_shaft * 60.0:.0f} rev/min of the shaft; this speed wants {shaft * 60.0:.0f}"
            )
            raise SceneError(f"{speed} m/s is not possible", key="ship.speed_mps", value=speed, allowed=fastest)
        plant = ContainerPlant(shaft=shaft, dt=dt, machinery=machinery)
        return plant, container.straight(speed, heading), container.linearised(speed)
    if ship.model == "yacht":
        speed = ship.speed_mps or _YACHT_SPEED
        if speed > yacht.TOP_SPEED:
            fastest = f"at most {yacht.TOP_SPEED:.1f} m/s"
            raise SceneError(f"{speed} m/s is not possible", key="ship.speed_mps", value=speed, allowed=fastest)
        return yacht.plant(speed, dt, gear), yacht.straight(speed, heading), yacht.linear(speed)
    linear = CORRECTED if ship.model == "corrected" else PRINTED
    if ship.speed_mps is not None:
        linear = replace(linear, speed=ship.speed_mps)
    start = np.zeros(10)
    start[U], start[PSI] = linear.speed, heading
    return LinearPlant(exact_step(linear, dt), gear), start, linear


def _gear(steering: SteeringTable) -> SteeringGear:
    angle, rate = np.radians([steering.max_rudder_deg, steering.max_rudder_rate_dps])
    return SteeringGear(float(angle), float(rate))


def _noise(steering: SteeringTable) -> Noise | None:
    """Return the noise of the steering's table; LQG without one takes the table's defaults, the others none."""
    table = steering.noise or (SteeringNoiseTable() if steering.controller == "lqg" else None)
    if table is None:
        return None
    return Noise(
        p=float(np.radians(table.roll_rate_dps)),
        r=float(np.radians(table.yaw_rate_dps)),
        phi=float(np.radians(table.roll_deg)),
        psi=float(np.radians(table.heading_deg)),
        sway=table.sway_mps2,
        roll=float(np.radians(table.roll_dps2)),
        yaw=float(np.radians(table.yaw_dps2)),
    )


def _autopilot(steering: SteeringTable, linear: LinearShip) -> Autopilot:
    if steering.kp is not None and steering.kd is not None:
        return PD(kp=steering.kp, kd=steering.kd)
    if steering.controller == "pd":
        made = _tried("steering.controller", lambda: pd_by_poles(linear, steering.frequency, steering.damping))
    elif steering.gain is not None:
        made = StateFeedback(np.array(steering.gain))
    else:
        allowed = f"{_TURNS} with a weight of the heading above 0, or controller = 'pd', or steering.gain"
        made = _tried("steering.controller", lambda: lqr(linear, steering.weights, steering.rudder_weight), allowed)
    chosen: Autopilot = made
    return chosen


def _programme(table: ProgrammeTable, heading: float) -> Programme:
    """Return the programme; without headings and way-points, the heading at the start."""
    if table.way_points is not None:
        points = np.array(table.way_points) * [1.0, -1.0]  # y of the world is west
        return _tried(
            "programme.way_points",
            lambda: WayPoints(points, table.acceptance_m, table.lookahead_m),
            "two way-points or more, no two running the same",
        )
    if table.headings is None:
        return HeadingProgramme(np.zeros(1), np.array([heading]))
    times, headings = np.array(table.headings, float).T
    rate = np.inf if table.turn_rate_dps is None else np.radians(table.turn_rate_dps)
    if np.isinf(rate) and (np.abs(np.diff(headings)) > 180.0).any():
        allowed = "changes of at most 180 deg: longer turns need turn_rate_dps"
        raise SceneError("a change of heading is too large", key="programme.headings", allowed=allowed)
    return _tried(
        "programme.headings",
        lambda: HeadingProgramme(times, np.radians(headings), float(rate)),
        "times from 0 s on that grow",
    )


class Steered:
    """A ship under its bridge: `state` (10,) now, `estimate` (5,) of (v, p, r, phi, psi) as the autopilot has it."""

    def __init__(self, bridge: Bridge, rngs: tuple[np.random.Generator, np.random.Generator]) -> None:
        self.bridge, self._plant, self._programme = bridge, bridge.plant, bridge.programme
        self._sensors, self._sea = rngs
        self.state = np.array(bridge.start)
        self.estimate = self.state[_PLACES]
        self._helm: float | None = None
        self.wanted, self.ordered = float(self.state[PSI]), 0.0
        self.lookout = None if bridge.avoid is None else Lookout(*bridge.avoid)
        self._avoiding, self._k = 0.0, 0
        self._every = max(1, round(_CHOICE / bridge.plant.dt))
        self.order(None, None)

    def order(self, rudder: float | None, shaft: float | None) -> None:
        """Take the helm at a rudder angle [rad], and the shaft at a speed [rev/s]; None: as the scene says."""
        if shaft is not None and not self.bridge.takes_shaft:
            raise ValueError("the linear ship keeps its speed: it takes no order for the shaft")
        if rudder is not None and not np.isfinite(rudder):
            raise ValueError(f"rudder {rudder} rad; allowed: a finite angle")
        self._plant = self.bridge.plant if shaft is None else self.bridge.plant.at_shaft(shaft)
        self._helm = rudder

    def step(self) -> None:
        """Carry the ship one step on."""
        watch, before = self.bridge.watch, self.state
        if watch is None:
            self.estimate = before[_PLACES]
        else:
            self.estimate = watch.filter.update(self.estimate, watch.noise.measure(before[_PLACES], self._sensors))
        self.wanted, self._programme = self._programme.at(self._k * self._plant.dt, before[[X, Y]])
        if self.lookout is not None:
            if self._k % self._every == 0:
                self._avoiding = self.lookout.heading(before, self.wanted, self._k * self._plant.dt) - self.wanted
            self.wanted += self._avoiding
        steered = self.bridge.autopilot.order(self.estimate, self.wanted)
        self.ordered = steered if self._helm is None else self._helm
        self.state = self._plant.advance(before, self.ordered)
        if watch is not None:
            self.estimate = watch.filter.predict(self.estimate, float(before[DELTA]), float(self.state[DELTA]))
        if self.bridge.disturbance is not None:
            self.state[_PLACES] += self.bridge.disturbance.draw(self._sea)
        self._k += 1


def hermite(share: Array, dt: float) -> Array:
    """Return the weights (n, 4) of pose and rates before and after a step of `dt` [s], at shares (n,) of it.

    Hermite's cubic keeps the printed ship's roll of 0.3 s to 1e-5 of its amplitude within a step of 1/75 s.
    """
    s, t = share, 1.0 - share
    return np.stack([t * t * (1.0 + 2.0 * s), dt * s * t * t, s * s * (1.0 + 2.0 * t), -dt * s * s * t], axis=1)


def pose_and_rates(state: Array) -> Array:
    """Return x, y, z [m], yaw, pitch, roll [rad] in the world of a full state (10,), and their rates: (2, 6)."""
    north, east = over_ground(state).tolist()
    _, _, r, x, y, psi, p, phi, _, _ = state.tolist()
    return np.array([[x, -y, 0.0, -psi, 0.0, phi], [north, -east, 0.0, -r, 0.0, p]])
