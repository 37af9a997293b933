"""Human walking: the joint angles and the pelvis over one cycle, by speed.

Boulic, Magnenat-Thalmann, Thalmann, A global human walking model with real-time kinematic personification, The Visual
Computer 6 (1990), pp. 344-358, appendices A to D. Its relative velocity RV is the speed in hip heights a second. The
cycle begins with the strike of the right heel; the left side is half a cycle later. Control points are joined by
monotonic cubics (Fritsch and Carlson 1980), whose extrema are the control points.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

Floats = NDArray[np.float64]

HIP = 0.530
"""Height of the hip over the body's (Drillis and Contini 1966)."""
SLOWEST, FASTEST = 0.1, 3.0
"""Relative velocities [1/s] that the model covers; below, it stands still."""
_SLOW, _QUICK = 0.5, 1.3  # relative velocities between which the angles' control points stay as they are
_SPAN = FASTEST - _QUICK


@dataclass(frozen=True)
class Gait:
    """A way of walking: height [m] of the person and speed [m/s] on level ground.

    Times are in cycles from the strike of the right heel; angles [rad] grow as a limb swings forward or bends.
    Raises: ValueError for a speed that nobody of that height walks at.
    """

    height: float
    speed: float

    def __post_init__(self) -> None:
        if not SLOWEST <= self.relative <= FASTEST:
            low, high = SLOWEST * HIP * self.height, FASTEST * HIP * self.height
            raise ValueError(
                f"speed = {self.speed:g} m/s: a person of {self.height:g} m walks at {low:.2f} to {high:.2f}"
            )

    @property
    def relative(self) -> float:
        """Speed in hip heights a second."""
        return self.speed / (HIP * self.height)

    @property
    def cycle(self) -> float:
        """Duration [s] of two steps; their length is 1.346 sqrt(RV) hip heights."""
        return 1.346 / float(np.sqrt(self.relative))

    @property
    def support(self) -> float:
        """Share of the cycle in which a foot is on the ground."""
        return 0.752 - 0.143 / self.cycle

    def pelvis_shift(self, t: Floats) -> Floats:
        """Return how far the pelvis (..., 3) [m] is from its even motion at hip height: forward, left, up."""
        small = min(self.relative, _SLOW)
        # Above RV 0.5 the paper prints two amplitudes with a minus, -0.032 and -0.021, which breaks both off there; the
        # second then makes the standing foot slide by 0.47 m/s rms in place of 0.36 (height 1.75 m, speed 1.4 m/s).
        up, side, ahead = 0.015 * self.relative, 0.128 * small * (1.0 - small), 0.084 * small * (1.0 - small)
        shift = [
            ahead * _sine(2.0 * t + 2.0 * (0.625 - self.support)),
            # Towards the leg that bears the weight.
            -side * _sine(t - 0.1),
            up * (_sine(2.0 * t - 0.35) - 1.0),
        ]
        return HIP * self.height * np.stack(shift, axis=-1)

    def lean(self, t: Floats) -> Floats:
        """Return by how much the trunk leans forward."""
        small = min(self.relative, _SLOW)
        return np.radians(8.0 * small * (1.0 - small) * (1.0 - _sine(2.0 * t - 0.1)))

    def pelvis_drop(self, t: Floats) -> Floats:
        """Return by how much the pelvis falls on the left, whose leg swings while the right one stands."""
        t = np.mod(t, 1.0)
        first = np.where(t < 0.15, 1.0 - _cosine(10.0 / 3.0 * t), 1.0 + _cosine(10.0 / 7.0 * (t - 0.15)))
        late = t - 0.5
        second = np.where(late < 0.15, 1.0 - _cosine(10.0 / 3.0 * late), 1.0 + _cosine(10.0 / 7.0 * (late - 0.15)))
        return np.radians(1.66 * self.relative * np.where(t < 0.5, first, -second))

    def pelvis_yaw(self, t: Floats) -> Floats:
        """Return by how much the pelvis turns left, the right hip forward."""
        return np.radians(4.0 * self.relative * _cosine(t))

    def thorax_yaw(self, t: Floats) -> Floats:
        """Return by how much the shoulders turn left, against the pelvis."""
        return -self._thorax(np.mod(t, 1.0))

    def hip(self, t: Floats) -> Floats:
        """Return the flexion of the right hip."""
        return self._hip(np.mod(t, 1.0))

    def knee(self, t: Floats) -> Floats:
        """Return the flexion of the right knee."""
        return self._knee(np.mod(t, 1.0))

    def ankle(self, t: Floats) -> Floats:
        """Return by how much the right foot is drawn up."""
        return self._ankle(np.mod(t, 1.0))

    def shoulder(self, t: Floats) -> Floats:
        """Return by how much the right upper arm swings forward."""
        most = 9.88 * self.relative
        return np.radians(3.0 - 0.5 * most - most * _cosine(t))

    def elbow(self, t: Floats) -> Floats:
        """Return the flexion of the right elbow."""
        return self._elbow(np.mod(t, 1.0))

    @cached_property
    def _more(self) -> float:
        """How far the speed is from _QUICK to FASTEST, 0 to 1."""
        return max(0.0, self.relative - _QUICK) / _SPAN

    @cached_property
    def _less(self) -> float:
        """Of the swing at _SLOW, what is left at a lower speed."""
        return min(1.0, self.relative / _SLOW)

    @cached_property
    def _hip(self) -> PchipInterpolator:
        m, s = self._more, self._less
        if m == 0.0:
            return _curve([0.5, 0.9], [-15.0 * s, 25.0 * s])
        return _curve([0.5, 0.9, 0.9 + 0.2 * m], [-15.0, 25.0 + 6.0 * m, 25.0 + 5.0 * m])

    @cached_property
    def _knee(self) -> PchipInterpolator:
        m = self._more
        bent = 70.0 * self._less if m == 0.0 else 70.0 - 5.0 * m
        return _curve(
            [0.17 - 0.05 * m, 0.4, 0.75 - 0.05 * m, 1.0 - 0.03 * m], [3.0 + 22.0 * m, 3.0, bent, 3.0 + 3.0 * m]
        )

    @cached_property
    def _ankle(self) -> PchipInterpolator:
        m, s = self._more, self._less
        flat = -3.0 + 5.0 * m
        down, up, push = -3.0 - 15.0 * s + 4.0 * m, -3.0 + 11.0 * s - 3.0 * m, -3.0 - 17.0 * s - 8.0 * m
        return _curve([0.0, 0.08, 0.5 - 0.1 * m, self.support, 0.85], [flat, down, up, push, flat])

    @cached_property
    def _thorax(self) -> PchipInterpolator:
        one, other = 4.0 / 3.0 * self.relative, 1.5 * self.relative
        return _curve([0.1, 0.4, 0.6, 0.9], [one, -other, -one, other])

    @cached_property
    def _elbow(self) -> PchipInterpolator:
        v, m = self.relative, self._more
        if v < _SLOW:
            return _curve([0.05, 0.5, 0.9], [6.0 * v + 3.0, 34.0 * v + 3.0, 10.0 * v + 3.0])
        n = min(1.0, (v - _SLOW) / (_QUICK - _SLOW))
        bent = [6.0 + 8.0 * n - 6.0 * m, 20.0 + 24.0 * n + 26.0 * m, 8.0 + 9.0 * n - 6.0 * m]
        return _curve([0.05, 0.5 + 0.01 * n + 0.04 * m, 0.9 - 0.1 * m], bent)


def _sine(cycles: Floats) -> Floats:
    return np.asarray(np.sin(2.0 * np.pi * cycles))


def _cosine(cycles: Floats) -> Floats:
    return np.asarray(np.cos(2.0 * np.pi * cycles))


def _curve(at: list[float], degrees: list[float]) -> PchipInterpolator:
    """Return the periodic curve [rad] over [0, 1] of control points at times of the cycle and angles [deg]."""
    times = np.concatenate([np.array(at) + shift for shift in (-2.0, -1.0, 0.0, 1.0, 2.0)])
    return PchipInterpolator(times, np.radians(np.tile(degrees, 5)), extrapolate=False)
