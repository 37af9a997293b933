"""A ship about a straight course: dx/dt = A x + B delta, the ship paper's printed matrices, exact steps in time.

Euler's forward step is unstable on the printed matrix beyond 0.8 us (its roll is stiff and nearly undamped), so steps
are matrix exponentials: exact for a rudder that moves evenly over the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]

KNOT = 1852.0 / 3600.0
"""One knot [m/s]."""
LINEAR_STATE = ("v", "p", "r", "phi", "psi")
"""Sway velocity [m/s], roll rate [rad/s], yaw rate [rad/s], roll [rad], heading [rad]."""
STATE = ("u", "v", "r", "x", "y", "psi", "p", "phi", "delta", "n")
"""All that moves, in the order of Fossen's MSS: [m/s] [m/s] [rad/s] [m] [m] [rad] [rad/s] [rad] [rad] [rev/s]."""
U, V, R, X, Y, PSI, P, PHI, DELTA, N = range(10)
OF_LINEAR = (V, P, R, PHI, PSI)
"""Where the linear state stands in the full one."""


def frozen(values: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """Return a read-only copy of an array; ValueError if its shape is another or a value is not finite."""
    array = np.array(values, float)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}, not {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has values that are not finite")
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class LinearShip:
    """A ship about a straight course at constant speed, x = (v, p, r, phi, psi).

    Args: `a` (5, 5) and `b` (5,) in SI, `speed` [m/s] along the course. The sign of `b[2]` tells to which side a
    positive rudder turns: positive to starboard.
    Raises: ValueError.
    Source: Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, section 7.
    """

    a: Array
    b: Array
    speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "a", frozen(self.a, (5, 5), "a"))
        object.__setattr__(self, "b", frozen(self.b, (5,), "b"))
        if not 0.0 < self.speed < np.inf:
            raise ValueError(f"speed is {self.speed} m/s; it must be positive")

    def poles(self, gain: ArrayLike | None = None) -> NDArray[np.complex128]:
        """Return the eigenvalues (5,) complex [rad/s], with the rudder amidships or at -gain x; slowest decay last."""
        closed = self.a if gain is None else self.a - np.outer(self.b, frozen(gain, (5,), "gain"))
        values = np.linalg.eigvals(closed)
        return np.asarray(values[np.argsort(values.real, kind="stable")])

    def controllability(self) -> Array:
        """Return (5, 5) columns B, AB, ... A^4 B: of rank 5 where the rudder reaches every state."""
        columns = [self.b]
        for _ in range(4):
            columns.append(self.a @ columns[-1])
        return np.stack(columns, axis=1)


@dataclass(frozen=True)
class ExactStep:
    """x(t + dt) = state x + rudder delta(t) + motion (delta(t + dt) - delta(t)), for a rudder that moves evenly.

    Arrays: `state` (5, 5), `rudder` (5,), `motion` (5,); `dt` [s].
    Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 1998, section 6.3 (first-order hold).
    """

    state: Array
    rudder: Array
    motion: Array
    dt: float

    def __call__(self, x: Array, before: float, after: float) -> Array:
        """Return the state (5,) one step on, for the rudder [rad] before and after."""
        return np.asarray(self.state @ x + self.rudder * before + self.motion * (after - before))


def exact_step(ship: LinearShip, dt: float) -> ExactStep:
    """Return the step over `dt` [s], by the matrix exponential of the ship with rudder angle and rate appended."""
    if not 0.0 < dt < np.inf:
        raise ValueError(f"dt is {dt} s; it must be positive")
    whole = np.zeros((7, 7))
    whole[:5, :5] = ship.a * dt
    whole[:5, 5] = ship.b * dt
    whole[5, 6] = 1.0
    grown = expm(whole)
    return ExactStep(state=grown[:5, :5], rudder=grown[:5, 5], motion=grown[:5, 6], dt=dt)


def natural_frequency_and_damping(pole: complex) -> tuple[float, float]:
    """Return the natural frequency [rad/s] and the damping ratio of a complex pole [rad/s]."""
    return abs(pole), -pole.real / abs(pole)


def block_coefficient(
    length: float, beam: float, draught: float, displacement: float, density: float = 1025.0
) -> float:
    """Return displacement [kg] over density [kg/m3] and the block's volume [m3]: above 1 no hull can be."""
    return displacement / (density * length * beam * draught)


def world_pose(state: Array) -> tuple[Array, Array, Array]:
    """Return position (..., 3) [m], yaw and roll [rad] in the world (y left, z up) of full states (..., 10).

    Yaw turns left there, heading turns right here; roll lowers starboard in both.
    """
    s = np.asarray(state, float)
    place = np.stack([s[..., X], -s[..., Y], np.zeros_like(s[..., X])], axis=-1)
    return place, np.asarray(-s[..., PSI]), np.asarray(s[..., PHI])


def over_ground(state: Array) -> Array:
    """Return the velocity (2,) [m/s] to north and east of a full state (10,)."""
    u, psi = float(state[U]), float(state[PSI])
    c, s, across = math.cos(psi), math.sin(psi), float(state[V]) * math.cos(float(state[PHI]))
    return np.array([c * u - s * across, s * u + c * across])


_PRINTED_A = (
    (-0.0725, 0.0, 0.0062, 0.0038, 0.0),
    (0.0025, -0.0003, -0.0199, -379.9796, 0.0),
    (-0.03, -0.0006, -0.0489, -0.0018, 0.0),
    (0.0, 1.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0, 0.0),
)
_PRINTED_B = (0.0248, -0.0007, -0.0129, 0.0, 0.0)
PRINTED = LinearShip(a=np.array(_PRINTED_A), b=np.array(_PRINTED_B), speed=20.0 * KNOT)
"""The ship paper's equation 4 as printed. Its last row is zero, so that the heading never changes; a positive rudder
turns to port; it rolls in 0.32 s, as no ship of 175 m does."""
CORRECTED = LinearShip(
    a=np.array((*_PRINTED_A[:4], (0.0, 0.0, 1.0, 0.0, 0.0))), b=np.array(_PRINTED_B), speed=20.0 * KNOT
)
"""Equation 4 with dpsi/dt = r in the last row: the paper's own closed-loop eigenvalues then come out. Nothing else is
changed, neither the roll stiffness."""
PRINTED_GAIN = frozen((2.4448, -0.0786, -12.6437, 0.4462, -1.0), (5,), "gain")
"""Equation 6; the rudder that damps is delta = -gain x."""
PRINTED_POLES = (-0.0002 + 19.4931j, -0.0002 - 19.4931j, -0.1008 + 0.0393j, -0.1008 - 0.0393j, -0.1435 + 0j)
"""Equation 7 without its printed factor 1e5 [rad/s]."""
PRINTED_RICCATI = frozen(
    1e5
    * np.array(
        (
            (0.0001, 0.0, -0.001, 0.0, -0.0002),
            (0.0, 0.0166, 0.0, 0.0, 0.0),
            (-0.001, 0.0, 0.0087, 0.0003, 0.0012),
            (0.0, 0.0, 0.0003, 6.3045, 0.0),
            (-0.0002, 0.0, 0.0012, 0.0, 0.0002),
        )
    ),
    (5, 5),
    "S",
)
"""Equation 8, the solution of the Riccati equation as printed: four decimals of 1e5."""
