"""The closed loop of a ship and its laser scanner: bridge or logged poses, beams of a moving deck, a scan at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from raychan.dynamics.ship import DELTA, PHI, PSI, Array, N, P, R, U, V
from raychan.poses import rotation
from raychan.run.ship.bodies import ShipBodies
from raychan.run.ship.bridge import Steered, hermite, pose_and_rates
from raychan.run.ship.places import lost_in
from raychan.run.ship.scene import ShipScene, step_of
from raychan.run.ship.schema import WavesTable
from raychan.sensors.laser import NO_BODY, LaserScan, Scanner, SensorPoses, noisy, scan
from raychan.sensors.laser import beams as directions
from raychan.sensors.sea import SeaState, Waves, waves

_FULL = 2.0 * np.pi


@dataclass(frozen=True)
class Frame:
    """The ship at the start of a scan, and the scan: its beams leave from `time` on.

    time [s]; x, y, z [m] in the world, x to north, y to west, z up; heading [rad] clockwise from north, 0 to 2 pi; roll
    [rad] positive with starboard down, pitch [rad] positive with the bow down; roll_rate, yaw_rate [rad/s], yaw to
    starboard; rudder, rudder_order [rad]; shaft [rev/s]; speed [m/s] through the water; heading_wanted [rad];
    rudder_sign, to which side a positive rudder turns the ship: 1 starboard, -1 port; `beams` the poses of the
    scanner when each beam left; `lost_in`, where the scanner is if it cannot be there (see `ship_places.lost_in`).
    """

    time: float
    x: float
    y: float
    z: float
    heading: float
    roll: float
    pitch: float
    roll_rate: float
    yaw_rate: float
    rudder: float
    rudder_order: float
    shaft: float
    speed: float
    heading_wanted: float
    rudder_sign: int
    scan: LaserScan
    beams: SensorPoses
    lost_in: str

    @property
    def north(self) -> float:
        """Distance [m] to the north of the origin."""
        return self.x

    @property
    def east(self) -> float:
        """Distance [m] to the east of the origin."""
        return -self.y


def hit_points(scanner: Scanner, poses: SensorPoses, met: LaserScan) -> Array:
    """Return the places (h, 3) [m] in the world of a scan's echoes, in the order of its beams."""
    echo = met.body != NO_BODY
    return np.asarray(poses.position[echo] + met.range[echo, None] * directions(scanner, poses)[echo])


def _waves(t: WavesTable, rng: np.random.Generator) -> Waves:
    """Return the waves of a table; headings there are clockwise from north."""
    return waves(SeaState(t.height_m, t.period_s, t.gamma, -float(np.radians(t.heading_deg)), t.spread), rng)


class ShipLoop:
    """The loop of a scene, at 0 s; equal seeds give equal bytes.

    >>> from raychan.run.ship.scene import ship_scene
    >>> loop = ShipLoop(ship_scene({}))
    >>> loop.step_scan().time, round(loop.now, 4)
    (0.0, 0.0133)
    """

    def __init__(self, scene: ShipScene) -> None:
        self.scene, scanner = scene, scene.scanner
        sensors, sea, self._ranges, swell = np.random.default_rng(scene.tables.run.seed).spawn(4)
        self._steered = None if scene.bridge is None else Steered(scene.bridge, (sensors, sea))
        self._step = step_of(scanner)
        self._steps = round(scanner.duration / self._step)
        self._k = 0
        self._times = scanner.times
        in_step = np.minimum((self._times / self._step).astype(int), self._steps - 1)
        self._of_step = [np.flatnonzero(in_step == step) for step in range(self._steps)]
        self._weights = hermite(self._times / self._step - in_step, self._step)
        water = scene.tables.sea
        self._sea = 0.0 if water is None else water.reflectivity
        self._waves = None if water is None or water.waves is None else _waves(water.waves, swell)
        mount = scene.tables.scanner
        self._arm = mount.position
        angles = np.radians([mount.yaw_deg, mount.pitch_deg, mount.roll_deg])
        self._turned = rotation(*angles) if angles.any() else None
        self._bodies = ShipBodies(scene.bodies, scanner.moving)

    @property
    def now(self) -> float:
        """Time [s] to which the loop has come."""
        return self._k * self._step

    @property
    def scans(self) -> int:
        """Whole scans in the scene's duration."""
        return int(self.scene.duration / (self._steps * self._step) + 1e-9)

    @property
    def done(self) -> bool:
        """Whether the scene's duration holds no other scan."""
        return self._k >= self.scans * self._steps

    @property
    def steerable(self) -> bool:
        """Whether the ship takes orders; logged poses do not."""
        return self._steered is not None

    @property
    def rudder_sign(self) -> int:
        """To which side a positive rudder turns the ship: 1 starboard, -1 port; 1 of logged poses, which have none."""
        return 1 if self._steered is None or self._steered.bridge.ship.b[2] >= 0.0 else -1

    @property
    def takes_shaft(self) -> bool:
        """Whether the ship takes orders for its shaft; the linear ships keep their speed."""
        return self._steered is not None and self._steered.bridge.takes_shaft

    @property
    def state(self) -> Array:
        """Full state (10,) of `dynamics.ship.STATE` now."""
        if self._steered is not None:
            return self._steered.state.copy()
        assert self.scene.poses is not None
        return self.scene.poses.state(self.now)

    def order(self, rudder: float | None = None, shaft: float | None = None) -> None:
        """Override the autopilot: rudder [rad] by the ship's own sign, shaft speed [rev/s]; None gives it back.

        Raises: ValueError where the ship takes no such order.
        """
        if self._steered is None:
            raise ValueError("logged poses take no orders")
        self._steered.order(rudder, shaft)

    def step_scan(self) -> Frame:
        """Carry the loop on by one scan and return it. Raises: ValueError beyond the end of logged poses, or
        where the model does not hold (a container ship that stops)."""
        start, state, moving = self.now, self.state, self._steered
        poses = self._replayed() if moving is None else self._sailed(moving)
        beams = self._mounted(poses)
        swell = None if self._waves is None else self._waves.at(start)
        ideal = scan(self.scene.scanner, beams, self._bodies.at(start), self.scene.reflectivity, self._sea, swell)
        deviation = self.scene.tables.scanner.noise_m
        met = noisy(ideal, deviation, self._ranges) if deviation > 0.0 else ideal
        if moving is not None and moving.lookout is not None:
            # In the world's axes y is west.
            moving.lookout.see(hit_points(self.scene.scanner, beams, met) * [1.0, -1.0, 1.0], self.now)
        return Frame(
            time=start,
            x=float(poses[0, 0]),
            y=float(poses[0, 1]),
            z=float(poses[0, 2]),
            heading=float(state[PSI] % _FULL),
            roll=float(state[PHI]),
            pitch=float(poses[0, 4]),
            roll_rate=float(state[P]),
            yaw_rate=float(state[R]),
            rudder=float(state[DELTA]),
            rudder_order=0.0 if moving is None else moving.ordered,
            shaft=float(state[N]),
            speed=float(np.hypot(state[U], state[V])),
            heading_wanted=float((state[PSI] if moving is None else moving.wanted) % _FULL),
            scan=met,
            rudder_sign=self.rudder_sign,
            beams=beams,
            lost_in=lost_in(beams.position[0], start, self.scene.bodies.bodies, swell),
        )

    def _sailed(self, ship: Steered) -> Array:
        """Return the poses (n, 6) of the ship at each beam, with the ship carried over the scan."""
        poses = np.empty((len(self._times), 6))
        before = pose_and_rates(ship.state)
        for beams in self._of_step:
            ship.step()
            after = pose_and_rates(ship.state)
            poses[beams] = self._weights[beams] @ np.concatenate([before, after])
            before = after
        self._k += self._steps
        return poses

    def _replayed(self) -> Array:
        logged, start = self.scene.poses, self.now
        assert logged is not None
        if start + float(self._times[-1]) > logged.duration:
            raise ValueError(f"the logged poses end at {logged.duration:g} s")
        self._k += self._steps
        return logged.at(start + self._times)

    def _mounted(self, poses: Array) -> SensorPoses:
        """Return the scanner's poses of the ship's (n, 6)."""
        yaw, pitch, roll = poses[:, 3], poses[:, 4], poses[:, 5]
        turn = rotation(yaw, pitch, roll)  # type: ignore[arg-type]
        x, y, z = self._arm
        place = poses[:, :3] + (turn[:, 0] * x + turn[:, 1] * y + turn[:, 2] * z).T
        if self._turned is not None:
            m = np.einsum("ijn,jk->ikn", turn, self._turned)
            level = np.hypot(m[0, 0], m[1, 0])
            upright = level < 1e-9
            yaw = np.where(upright, np.arctan2(-m[0, 1], m[1, 1]), np.arctan2(m[1, 0], m[0, 0]))
            pitch, roll = np.arctan2(-m[2, 0], level), np.where(upright, 0.0, np.arctan2(m[2, 1], m[2, 2]))
        return SensorPoses(position=place, yaw=yaw, pitch=pitch, roll=roll)
