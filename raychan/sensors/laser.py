"""Laser scanner with a turning mirror: beams of a moving deck, nearest hits, range by reflectivity, range noise.

A beam is one ray of no width, or has a `sensors.spot`. Sensor frame: x ahead, y left, z up; beam angles run from
the right (negative) to the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.columns import Record, column
from raychan.poses import direction, rotation
from raychan.radar.declared import check_type
from raychan.sensors.arguments import number, one_each
from raychan.sensors.sea import Waves, flat_sea_range, wavy_sea_range
from raychan.sensors.spot import Spot
from raychan.world import limits
from raychan.world.errors import SceneError
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
_LIMITS = {
    "fan_deg": limits.FAN_DEG,
    "step_deg": limits.SCAN_STEP_DEG,
    "mirror_hz": limits.MIRROR_HZ,
    "max_range": limits.BEAM_RANGE,
    "dark_range": limits.BEAM_RANGE,
}


@dataclass(frozen=True)
class Scanner:
    """An LMS221-like scanner.

    Fields: fan [deg]; step [deg]: 1, 0.5 or 0.25; mirror_hz turns of the mirror a second; max_range [m]; dark_range [m]
    to a surface of 10 % reflectivity (assumed: the paper's Figure 9 is lost); spot of a beam, None for a ray of
    no width; lambert: whether power falls with the cosine of the angle of incidence (Table 2 does not say); moving:
    whether each beam leaves at its own time, or all at the scan's start, as the paper has it.
    A step of 1/m deg takes m turns of the mirror, each shifted by a step against the one before: 13.3, 26.7, 53.3 ms.
    Numbers have the limits of scene files. Raises: ValueError with what is allowed.
    """

    fan_deg: float = 180.0
    step_deg: float = 1.0
    mirror_hz: float = 75.0
    max_range: float = 80.0
    dark_range: float = 30.0
    spot: Spot | None = None
    lambert: bool = False
    moving: bool = True

    def __post_init__(self) -> None:
        for name, limit in _LIMITS.items():
            object.__setattr__(self, name, float(number(f"Scanner.{name}", getattr(self, name), limit)))
        if self.step_deg not in (1.0, 0.5, 0.25):
            raise SceneError(f"{self.step_deg!r} is not possible", key="step_deg", allowed="1, 0.5 or 0.25")
        if not (self.fan_deg / self.step_deg).is_integer():
            allowed = f"whole steps of {self.step_deg:g} deg, up to 360 deg"
            raise SceneError(f"{self.fan_deg!r} is not possible", key="fan_deg", allowed=allowed)
        check_type("Scanner.spot", self.spot, Spot, or_none=True)
        check_type("Scanner.lambert", self.lambert, bool)
        check_type("Scanner.moving", self.moving, bool)

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
        """Time (n,) [s] of each beam from the start of the scan; 0 unless `moving`."""
        if not self.moving:
            return np.zeros(self.count)
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


@dataclass(frozen=True)
class MovingBodies:
    """Bodies that share one velocity: a beam is cast at them in the frame that moves with them.

    Fields: caster of them where they stand `age` [s] before the start of the scan; velocity (3,) [m/s]; numbers (b,)
    of the caster's bodies in the scan.
    """

    caster: RayCaster
    velocity: Floats
    numbers: Ints
    age: float = 0.0

    def later(self, age: float) -> MovingBodies:
        """Return the same bodies for a scan that starts at an age [s]."""
        return replace(self, age=age)


@dataclass(frozen=True)
class Targets:
    """What beams may meet.

    Fields: caster of bodies that stand still, groups of bodies that move, or None; reflectivity (b,) of each body;
    sea_reflectivity, 0 for no sea; waves of the sea about z = 0, None for a flat one.
    Water mirrors: what comes back from the sea is foam's and ripples'. Its reflectivity is yours to give; with
    `Scanner.lambert` it counts times the sine of the grazing angle.
    Raises: ValueError unless reflectivity has one number for each body, within the limits of scene files.
    """

    caster: RayCaster | Sequence[MovingBodies] | None
    reflectivity: Floats
    sea_reflectivity: float = 0.0
    waves: Waves | None = None

    def __post_init__(self) -> None:
        count = max((int(group.numbers.max(initial=-1)) for group in self.groups), default=-1) + 1
        values = one_each("reflectivity", self.reflectivity, count, "body", limits.REFLECTIVITY)
        object.__setattr__(self, "reflectivity", values)
        sea = number("sea_reflectivity", self.sea_reflectivity, limits.REFLECTIVITY)
        object.__setattr__(self, "sea_reflectivity", sea)

    @property
    def groups(self) -> Sequence[MovingBodies]:
        """The bodies in groups of one velocity."""
        if self.caster is None:
            return ()
        if isinstance(self.caster, RayCaster):
            numbers = np.arange(len(self.caster.facets.role), dtype=np.int32)
            return (MovingBodies(self.caster, np.zeros(3), numbers),)
        return self.caster


def beams(scanner: Scanner, poses: SensorPoses) -> Floats:
    """Return the unit directions (n, 3) of the beams in the world, each at the pose of its own time."""
    return _beams(scanner, poses)[0]


def _beams(scanner: Scanner, poses: SensorPoses) -> tuple[Floats, Floats]:
    """Return the unit directions (n, 3) of the beams and of the mirror's axis."""
    if len(poses.yaw) != scanner.count:
        raise ValueError(f"poses: {len(poses.yaw)} given; allowed: one for each beam of the scanner, {scanner.count}")
    # `rotation` of arrays (n,) has the beams last: (3, 3, n).
    each: Any = poses.yaw, poses.pitch, poses.roll
    turn = np.moveaxis(rotation(*each), -1, 0)
    towards = np.einsum("nij,nj->ni", turn, direction(scanner.angles))
    return np.ascontiguousarray(towards), np.ascontiguousarray(turn[:, :, 2])


def first_hits(
    scanner: Scanner, targets: Targets, origin: Floats, towards: Floats, time: Floats, together: int = 1
) -> tuple[Floats, Ints, Floats]:
    """Return what rays of no width meet first, seen or not.

    Args: origin (n, 3) [m]; towards (n, 3) unit; time (n,) [s] of each on the sea's clock; together: so
    many rows after each other are of one beam.
    Returns: distance (n,) [m], inf for nothing (of waves: within max_range); body (n,), NO_BODY or SEA; how much it
    reflects (n,), times the cosine of incidence with `lambert`.
    """
    n = len(towards)
    distance, body, reflects = np.full(n, np.inf), np.full(n, NO_BODY, np.int32), np.zeros(n)
    for group in targets.groups:
        caster, velocity = group.caster, group.velocity
        start = origin - (group.age + time)[:, None] * velocity if velocity.any() else origin
        facet, along = caster.cast(start, towards, np.full(n, -1, np.int32))
        hit = (facet >= 0) & (along < distance)
        met = facet[hit]
        distance = np.where(hit, along, distance)
        body[hit] = group.numbers[caster.facets.body[met]]
        reflects[hit] = targets.reflectivity[body[hit]]
        if scanner.lambert:
            reflects[hit] *= np.abs(np.einsum("ij,ij->i", towards[hit], caster.normal[met]))
    if targets.sea_reflectivity > 0.0:
        sea = (
            flat_sea_range(origin, towards)
            if targets.waves is None
            else wavy_sea_range(targets.waves, origin, towards, time, np.minimum(distance, scanner.max_range), together)
        )
        nearer = sea < distance
        distance, body = np.where(nearer, sea, distance), np.where(nearer, np.int32(SEA), body)
        reflects[nearer] = targets.sea_reflectivity
        if scanner.lambert:
            normal = np.array([0.0, 0.0, 1.0])
            if targets.waves is not None:
                x, y, _ = (origin[nearer] + sea[nearer, None] * towards[nearer]).T
                normal = targets.waves.normal(x, y, time[nearer])
            reflects[nearer] *= -(normal * towards[nearer]).sum(axis=1)
    return distance, body, reflects


def scan(
    scanner: Scanner,
    poses: SensorPoses,
    caster: RayCaster | Sequence[MovingBodies] | None,
    reflectivity: Floats,
    sea_reflectivity: float = 0.0,
    waves: Waves | None = None,
) -> LaserScan:
    """Return the nearest hit of each beam.

    Args: poses at the scanner's `times`; the rest as in `Targets`, the waves' time 0 being the scan's start
    (`Waves.at`). Raises: ValueError for poses that are not one for each beam, and as `Targets`.
    A nearer surface hides what is behind it even where it is too dark to be seen itself.
    """
    targets, (towards, axis) = Targets(caster, reflectivity, sea_reflectivity, waves), _beams(scanner, poses)
    spot = scanner.spot
    if spot is None:
        distance, body, reflects = first_hits(scanner, targets, poses.position, towards, scanner.times)
        seen = distance <= scanner.range_limit(reflects)
        return LaserScan(range=np.where(seen, distance, np.inf), body=np.where(seen, body, np.int32(NO_BODY)))
    rays = spot.sub_rays(poses.position, towards, axis)
    each = len(rays[0]) // len(towards)
    distance, body, reflects = first_hits(scanner, targets, *rays, np.repeat(scanner.times, each), each)
    # Power over the least that is detected: 1 where a surface is at its `range_limit`.
    power = np.where(distance <= scanner.max_range, reflects / 0.1 * (scanner.dark_range / distance) ** 2, 0.0)
    shape = len(towards), each
    ranges, bodies = spot.report(distance.reshape(shape), body.reshape(shape), power.reshape(shape), NO_BODY)
    return LaserScan(range=ranges, body=bodies)


def noisy(ideal: LaserScan, deviation: float, rng: np.random.Generator) -> LaserScan:
    """Return the scan with Gaussian noise of a standard deviation [m] on each range that was met, never below 0.

    Raises: ValueError for a deviation that cannot be."""
    deviation = number("deviation", deviation, limits.DEVIATION)
    noise = rng.normal(0.0, deviation, len(ideal.range))
    return LaserScan(range=np.maximum(ideal.range + noise, 0.0), body=ideal.body)
