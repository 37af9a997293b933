"""A beam of finite width: sub-rays over its spot, and the one range that a scanner reports of their echoes.

Where a spot falls on two surfaces the scanner may report a range between them, where nothing is: a mixed pixel (Ye and
Borenstein, IEEE Int. Conf. on Robotics and Automation 2002, pp. 2512-2518, on a scanner of this family).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from raychan.compile.jit import njit
from raychan.scalars import shown
from raychan.sensors.arguments import number
from raychan.world import limits

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class Echo(IntEnum):
    """Which echo of a beam is reported.

    FIRST: the nearest that is strong enough, as a receiver that times the leading edge does. STRONGEST: that of the
    most energy. MEAN: all energy as one echo, whatever lies between.
    """

    FIRST = 0
    STRONGEST = 1
    MEAN = 2


_FIRST, _MEAN = int(Echo.FIRST), int(Echo.MEAN)
_LIMITS = {
    "divergence": limits.DIVERGENCE_MRAD.times(1e-3, "rad"),
    "exit_diameter": limits.SPOT_MM.times(1e-3, "m"),
    "rings": limits.RINGS,
    "merge": limits.MERGE_M,
}


@dataclass(frozen=True)
class Spot:
    """The width of a beam and how its echoes become one range.

    Fields: divergence [rad], full angle, and exit_diameter [m] of the circle at 1/e^2 of the axis' intensity: 13 mm +
    4.6 mrad times distance (SICK, LMS500 operating instructions 8013796, section 3.5.2, high resolution; taken for the
    LMS221, whose figure is lost); rings of sub-rays about the central one, 6, 12, ... on each (the energy beside an
    edge is right to 0.25 of all with 1 ring, to 0.09 with 4: `test_spot.py`; 7 and 61 rays a beam); echo: which is
    reported; merge [m]: echoes nearer than this flow into one, whose range is the mean by energy: half the length of a
    pulse of 3 ns (assumed).
    FIRST is the default: scanners of this family report one range a beam, of the pulse's leading edge.
    Numbers have the limits of scene files. Raises: ValueError with what is allowed.
    """

    divergence: float = 4.6e-3
    exit_diameter: float = 0.013
    rings: int = 1
    echo: Echo = Echo.FIRST
    merge: float = 0.45

    def __post_init__(self) -> None:
        for name, limit in _LIMITS.items():
            value = number(f"Spot.{name}", getattr(self, name), limit, whole=name == "rings")
            object.__setattr__(self, name, value)
        if not isinstance(self.echo, Echo):
            allowed = ", ".join(f"Echo.{name}" for name in Echo.__members__)
            raise ValueError(f"Spot.echo = {shown(self.echo)}; allowed: {allowed}")

    @property
    def pattern(self) -> tuple[Floats, Floats]:
        """Places (k, 2) of the sub-rays in radii of the spot, and the share (k,) of the energy that each carries.

        Ring j of n lies at j / n of the radius and has the energy of a Gaussian beam, exp(-2 r^2), from (j - 1/2) / n
        to (j + 1/2) / n; the outermost has what lies beyond, too. Source, of rings of sub-rays: Winiwarter et al.
        2022, Remote Sensing of Environment 269, 112772 (HELIOS++).
        """
        places, shares = [np.zeros((1, 2))], [np.ones(1)]
        outside = 1.0
        for j in range(1, self.rings + 1):
            beyond = math.exp(-2.0 * ((j - 0.5) / self.rings) ** 2)
            shares[-1] *= outside - beyond
            outside = beyond
            angle = 2.0 * math.pi * np.arange(6 * j) / (6 * j)
            places.append(j / self.rings * np.stack([np.cos(angle), np.sin(angle)], axis=1))
            shares.append(np.full(6 * j, 1.0 / (6 * j)))
        shares[-1] *= outside
        return np.concatenate(places), np.concatenate(shares)

    def sub_rays(self, origin: Floats, towards: Floats, up: Floats) -> tuple[Floats, Floats]:
        """Return origins and unit directions (n * k, 3) of the sub-rays of beams (n, 3), those of a beam together.

        Args: up (n, 3) unit, across each beam.
        """
        places, _ = self.pattern
        side = np.cross(up, towards)
        across = places[:, 0, None] * side[:, None] + places[:, 1, None] * up[:, None]
        lines = towards[:, None] + math.tan(0.5 * self.divergence) * across
        lines /= np.sqrt(np.einsum("nki,nki->nk", lines, lines))[..., None]
        starts = origin[:, None] + 0.5 * self.exit_diameter * across
        return starts.reshape(-1, 3), lines.reshape(-1, 3)

    def report(self, distance: Floats, body: Ints, power: Floats, none: int) -> tuple[Floats, Ints]:
        """Return the range (n,) [m] and the body (n,) that a scanner reports.

        Args: distance (n, k) [m] of the sub-rays' hits, inf for none; body (n, k); power (n, k) that each would
        return if it carried the whole beam, in units of the least that is detected; none: what stands for no body.
        """
        _, share = self.pattern
        found: tuple[Floats, Ints] = _reported(distance, body, power * share, int(self.echo), self.merge, none)
        return found


@njit(cache=True, nogil=True)
def _echo(distance, body, power, near, far):  # type: ignore[no-untyped-def]
    """Return energy, mean range by energy, and the body of the strongest sub-ray of hits (k,) from `near` to `far`."""
    energy, moment, strongest, of = 0.0, 0.0, 0.0, np.int32(-1)
    for m in range(len(distance)):
        r = distance[m]
        if near <= r <= far and r < np.inf:
            energy += power[m]
            moment += power[m] * (r - near)
            if power[m] > strongest:
                strongest, of = power[m], body[m]
    return energy, near + (moment / energy if energy > 0.0 else 0.0), of


@njit(cache=True, nogil=True)
def _reported(distance, body, power, echo, merge, none):  # type: ignore[no-untyped-def]
    """Return range and body of each row: see `Spot.report`."""
    n, k = distance.shape
    ranges, bodies = np.full(n, np.inf), np.full(n, none, np.int32)
    for i in range(n):
        best = 0.0
        nearest = distance[i].min()
        for j in range(k):
            near, far = (nearest, np.inf) if echo == _MEAN else (distance[i, j], distance[i, j] + merge)
            energy, at, of = _echo(distance[i], body[i], power[i], near, far)
            # Less than the least power: no echo, but for what rounding takes of a surface just at its limit.
            if energy >= 1.0 - 1e-12 and ((at < ranges[i]) if echo == _FIRST else (energy > best)):
                best, ranges[i], bodies[i] = energy, at, of
    return ranges, bodies
