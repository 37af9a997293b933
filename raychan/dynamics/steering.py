"""Who holds the helm: PD, LQR and LQG autopilots, the steering gear's limits, heading and way-point programmes.

An autopilot orders a rudder angle from the measured state (v, p, r, phi, psi) and the heading wanted. Gains carry the
sign of the ship's rudder: where a positive rudder turns to port (the paper's printed ship), PD gains are negative.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import LinAlgError, solve_continuous_are

from raychan.dynamics.ship import Array, LinearShip, frozen


def turn(to: float, of: float) -> float:
    """Return the shorter turn [rad] from heading `of` to heading `to`, in (-pi, pi]."""
    return float(-((of - to + np.pi) % (2.0 * np.pi) - np.pi))


@dataclass(frozen=True)
class SteeringGear:
    """Limits of the rudder: angle [rad] and rate [rad/s]; infinite by default.

    Raises: ValueError for limits that are not positive.
    """

    max_angle: float = np.inf
    max_rate: float = np.inf

    def __post_init__(self) -> None:
        if not (self.max_angle > 0.0 and self.max_rate > 0.0):
            raise ValueError(f"limits {self.max_angle} rad and {self.max_rate} rad/s; both must be positive")

    def toward(self, delta: float, order: float, dt: float) -> float:
        """Return the rudder [rad] after `dt` [s] from `delta` towards what is ordered."""
        wanted = min(max(order, -self.max_angle), self.max_angle)
        reach = self.max_rate * dt
        return delta + min(max(wanted - delta, -reach), reach)


class Autopilot(Protocol):
    """What orders a rudder angle [rad], of the state (5,) and the heading wanted [rad], by a linear feedback."""

    @property
    def gain(self) -> Array: ...  # noqa: D102

    def order(self, state: Array, heading: float) -> float: ...  # noqa: D102


@dataclass(frozen=True)
class PD:
    """delta = kp (heading error) - kd r, with kp [rad/rad] and kd [s]."""

    kp: float
    kd: float

    @property
    def gain(self) -> Array:
        """The same as a feedback (5,) of (v, p, r, phi, psi)."""
        return np.array([0.0, 0.0, self.kd, 0.0, self.kp])

    def order(self, state: Array, heading: float) -> float:
        """Return the rudder ordered [rad] of the state (v, p, r, phi, psi) and the heading wanted [rad]."""
        return self.kp * turn(heading, float(state[4])) - self.kd * float(state[2])


@dataclass(frozen=True)
class StateFeedback:
    """delta = -gain x, with the heading in x taken from the heading wanted; `gain` (5,)."""

    gain: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", frozen(self.gain, (5,), "gain"))

    def order(self, state: Array, heading: float) -> float:
        """Return the rudder ordered [rad] of the state (v, p, r, phi, psi) and the heading wanted [rad]."""
        return float(-self.gain[:4] @ state[:4] + self.gain[4] * turn(heading, float(state[4])))


def nomoto(ship: LinearShip) -> tuple[float, float]:
    """Return K [1/s] and T [s] of T dr/dt + r = K delta that agree with the ship at low frequency.

    K is the yaw rate per rudder angle of a steady turn, T = T1 + T2 - T3 (+ roll's share): G(0) and -G'(0)/G(0).
    Raises: ValueError for a ship whose steady turn is undefined.
    Source: Nomoto, Taguchi, Honda and Hirano 1957, International Shipbuilding Progress 4.
    """
    a, b = ship.a[:4, :4], ship.b[:4]
    if np.linalg.matrix_rank(a) < 4:
        raise ValueError("sway, yaw and roll have no steady turn: their matrix is singular")
    once = np.linalg.solve(a, b)
    twice = np.linalg.solve(a, once)
    return float(-once[2]), float(-twice[2] / once[2])


def pd_by_poles(ship: LinearShip, frequency: float, damping: float) -> PD:
    """Return the PD whose heading loop on the ship's Nomoto model has this natural frequency [rad/s] and damping.

    Source: Fossen 2011, section 12.2 (pole placement).
    """
    k, t = nomoto(ship)
    return PD(kp=t * frequency**2 / k, kd=(2.0 * damping * frequency * t - 1.0) / k)


def riccati(a: Array, b: Array, q: Array, r: float) -> Array:
    """Return the stabilising S of A'S + SA - S b b' S / r + Q = 0, for A (n, n), b (n,), Q (n, n).

    Raises: ValueError where none exists, as for a state that the rudder does not reach and that does not decay.
    """
    none = "the Riccati equation has no stabilising solution: the rudder does not reach a state that does not decay"
    try:
        s = solve_continuous_are(a, b[:, None], q, np.array([[r]]))
    except LinAlgError as error:
        raise ValueError(none) from error
    if np.linalg.eigvals(a - np.outer(b, b @ s) / r).real.max() >= 0.0:
        raise ValueError(none)
    return np.asarray(s)


def lqr(ship: LinearShip, weights: ArrayLike = (1.0, 1.0, 1.0, 1.0, 1.0), rudder: float = 1.0) -> StateFeedback:
    """Return the feedback that minimises the integral of sum(weights x^2) + rudder delta^2.

    Args: `weights` (5,) of (v, p, r, phi, psi) in SI, `rudder` [1/rad^2].
    Raises: ValueError where no gain stabilises the ship.
    Source: Anderson and Moore, Optimal Control, 1990, section 3.2.
    """
    w = frozen(weights, (5,), "weights")
    if (w < 0.0).any() or not rudder > 0.0:
        raise ValueError("weights must not be negative, and that of the rudder must be positive")
    return StateFeedback(gain=ship.b @ riccati(ship.a, ship.b, np.diag(w), rudder) / rudder)


@dataclass(frozen=True)
class HeadingProgramme:
    """Headings [rad] wanted from times [s] on: `times` (n,) growing from 0, `headings` (n,).

    `rate` [rad/s]: at which the wanted heading goes from one to the next, by as many whole turns as they differ;
    infinite: at once.
    """

    times: Array
    headings: Array
    rate: float = np.inf

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.times))
        object.__setattr__(self, "times", frozen(self.times, (n,), "times"))
        object.__setattr__(self, "headings", frozen(self.headings, (n,), "headings"))
        if n == 0 or self.times[0] != 0.0 or not (np.diff(self.times) > 0.0).all():
            raise ValueError("times do not begin at 0 s and grow")
        if not self.rate > 0.0:
            raise ValueError(f"rate is {self.rate} rad/s; it must be positive")
        from_ = [float(self.headings[0])]  # the wanted heading at each of the times
        for k in range(n - 1):
            from_.append(self._after(from_[k], k, float(self.times[k + 1])))
        object.__setattr__(self, "_from", from_)

    def _after(self, start: float, leg: int, time: float) -> float:
        """Return the wanted heading [rad] at a time [s] of a leg that begins at heading `start`."""
        end = float(self.headings[leg])
        if np.isinf(self.rate):
            return end
        reach = self.rate * (time - float(self.times[leg]))
        return start + min(max(end - start, -reach), reach)

    def at(self, time: float, position: Array) -> tuple[float, HeadingProgramme]:
        """Return the heading wanted [rad] at a time [s], and the programme itself: it does not ask the position."""
        leg = int(np.searchsorted(self.times, time, side="right")) - 1
        starts: list[float] = self._from  # type: ignore[attr-defined]
        return self._after(starts[leg], leg, time), self


@dataclass(frozen=True)
class WayPoints:
    """Line-of-sight guidance along legs: `points` (n, 2) [m] north and east, n >= 2.

    `acceptance` [m]: a leg ends within this distance of its end, or past it. `lookahead` [m]: the heading wanted points
    to the leg this far ahead. `leg`: the leg now followed.
    Source: Fossen 2011, section 10.3.2 (lookahead-based steering).
    """

    points: Array
    acceptance: float
    lookahead: float
    leg: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, (len(self.points), 2), "points"))
        if len(self.points) < 2 or not (np.diff(self.points, axis=0) ** 2).sum(axis=1).all():
            raise ValueError("fewer than two way-points, or two running the same")
        if not (self.acceptance > 0.0 and self.lookahead > 0.0):
            raise ValueError("acceptance and lookahead must be positive")

    def at(self, time: float, position: Array) -> tuple[float, WayPoints]:
        """Return the heading wanted [rad] at a position (2,) [m], and the programme with the leg now followed."""
        programme = self
        while programme.leg < len(self.points) - 2 and programme._ended(position):
            programme = replace(programme, leg=programme.leg + 1)
        start, end = programme.points[programme.leg : programme.leg + 2]
        course = float(np.arctan2(*(end - start)[::-1]))
        off = position - start
        across = -off[0] * np.sin(course) + off[1] * np.cos(course)
        return course - float(np.arctan2(across, self.lookahead)), programme

    def _ended(self, position: Array) -> bool:
        start, end = self.points[self.leg : self.leg + 2]
        beyond = (position - end) @ (end - start) >= 0.0
        return bool(beyond or np.hypot(*(position - end)) <= self.acceptance)
