"""Laser scanner with a turning mirror: beams of a moving deck, nearest hits, range by reflectivity, range noise.

A beam is one ray of no width: divergence and mixed pixels are not modelled. Sensor frame: x ahead, y left, z up; beam
angles run from the right (negative) to the left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import Record, column
from raychan.poses import direction, rotation
from raychan.world.ray_caster import RayCaster

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

NO_BODY, SEA = -1, -2
"""What a beam met besides bodies: nothing within range; the sea."""
REFLECTIVITY = {
    "cardboard, matt black": 0.10,
    "cardboard, grey": 0.20,
    "wood, raw pine, dirty": 0.40,
    "PVC, grey": 0.50,
    "paper, matt white": 0.80,
    "aluminium, black anodised": 1.10,
    "steel, rust-free, shiny": 1.20,
    "steel, very shiny": 1.40,
    "reflectors": 20.0,
}
"""Reflectivity of materials, 1 = a white diffuse surface: Table 2 of the ship paper, the lowest of a span."""


@dataclass(frozen=True)
class Scanner:
    """An LMS221-like scanner.

    Fields: fan [deg]; step [deg]: 1, 0.5 or 0.25; mirror_hz turns of the mirror a second; max_range [m]; dark_range [m]
    to a surface of 10 % reflectivity (assumed: the paper's Figure 9 is lost).
    A step of 1/m deg takes m turns of the mirror, each shifted by a step against the one before: 13.3, 26.7, 53.3 ms.
    Raises: ValueError for another step, or figures that are not above 0.
    """

    fan_deg: float = 180.0
    step_deg: float = 1.0
    mirror_hz: float = 75.0
    max_range: float = 80.0
    dark_range: float = 30.0

    def __post_init__(self) -> None:
        if self.step_deg not in (1.0, 0.5, 0.25):
            raise ValueError(f"step is {self.step_deg} deg; allowed: 1, 0.5, 0.25")
        if not (0.0 < self.fan_deg <= 360.0 and (self.fan_deg / self.step_deg).is_integer()):
            raise ValueError(f"fan is {self.fan_deg} deg; allowed: whole steps up to 360 deg")
        if not min(self.mirror_hz, self.max_range, self.dark_range) > 0.0:
            raise ValueError("mirror_hz, max_range and dark_range; allowed: above 0")

    @property
    def count(self) -> int:
        """Beams of a scan."""
        return round(self.fan_deg / self.step_deg) + 1

    @property
    def angles(self) -> Floats:
        """Angles (n,) [rad] of the beams in the sensor frame, from right to left."""
        return np.radians(-0.5 * self.fan_deg + self.step_deg * np.arange(self.count))

    @property
    def duration(self) -> float:
        """Time [s] from one scan to the next."""
        return round(1.0 / self.step_deg) / self.mirror_hz

    @property
    def times(self) -> Floats:
        """Time (n,) [s] of each beam from the start of the scan."""
        beam, turns = np.arange(self.count), round(1.0 / self.step_deg)
        return (beam % turns + beam * self.step_deg / 360.0) / self.mirror_hz

    def range_limit(self, reflectivity: Floats) -> Floats:
        """Return how far [m] surfaces of a reflectivity are seen.

        A diffuse surface that fills the beam returns power as reflectivity over the square of its distance; the least
        power is that of 10 % at dark_range.
        """
        return np.minimum(self.max_range, self.dark_range * np.sqrt(np.asarray(reflectivity, float) / 0.1))


@dataclass(frozen=True)
class SensorPoses(Record):
    """Where the sensor is when each beam leaves; n beams. Angles as in `raychan.poses`: right side down is positive
    roll, bow down is positive pitch."""

    position: Floats = column("n 3", unit="m")
    yaw: Floats = column("n", unit="rad")
    pitch: Floats = column("n", unit="rad")
    roll: Floats = column("n", unit="rad")


@dataclass(frozen=True)
class LaserScan(Record):
    """What a scan met; n beams."""

    range: Floats = column("n", unit="m", doc="inf where nothing is within range", finite=False)
    body: Ints = column("n", np.int32, doc="body, NO_BODY or SEA")


def beams(scanner: Scanner, poses: SensorPoses) -> Floats:
    """Return the unit directions (n, 3) of the beams in the world, each at the pose of its own time."""
    # `rotation` of arrays (n,) has the beams last: (3, 3, n).
    each: Any = poses.yaw, poses.pitch, poses.roll
    turn = np.moveaxis(rotation(*each), -1, 0)
    return np.ascontiguousarray(np.einsum("nij,nj->ni", turn, direction(scanner.angles)))


def flat_sea_range(origin: Floats, towards: Floats) -> Floats:
    """Return the distance (n,) [m] from points (n, 3) along unit directions (n, 3) to the plane z = 0; inf from below
    or looking up: height over the sine of the angle of depression."""
    down = -towards[:, 2]
    hits = (down > 0.0) & (origin[:, 2] > 0.0)
    return np.divide(origin[:, 2], down, out=np.full(len(down), np.inf), where=hits)


def scan(
    scanner: Scanner, poses: SensorPoses, caster: RayCaster | None, reflectivity: Floats, sea_reflectivity: float = 0.0
) -> LaserScan:
    """Return the nearest hit of each beam.

    Args: poses at the scanner's `times`; caster: bodies, or None; reflectivity (b,) of each body; sea_reflectivity of
    the plane z = 0, 0 for no sea.
    A nearer surface hides what is behind it even where it is too dark to be seen itself.
    """
    towards = beams(scanner, poses)
    distance, body = np.full(len(towards), np.inf), np.full(len(towards), NO_BODY, np.int32)
    limit = np.zeros(len(towards))
    if caster is not None:
        facet, distance = caster.cast(poses.position, towards, np.full(len(towards), -1, np.int32))
        hit = facet >= 0
        body[hit] = caster.facets.body[facet[hit]]
        limit[hit] = scanner.range_limit(np.asarray(reflectivity, float)[body[hit]])
    if sea_reflectivity > 0.0:
        sea = flat_sea_range(poses.position, towards)
        nearer = sea < distance
        distance, body = np.where(nearer, sea, distance), np.where(nearer, np.int32(SEA), body)
        limit[nearer] = scanner.range_limit(np.array(sea_reflectivity))
    seen = distance <= limit
    return LaserScan(range=np.where(seen, distance, np.inf), body=np.where(seen, body, np.int32(NO_BODY)))


def noisy(ideal: LaserScan, deviation: float, rng: np.random.Generator) -> LaserScan:
    """Return the scan with Gaussian noise of a standard deviation [m] on each range that was met, never below 0."""
    noise = rng.normal(0.0, deviation, len(ideal.range))
    return LaserScan(range=np.maximum(ideal.range + noise, 0.0), body=ideal.body)
