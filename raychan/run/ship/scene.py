"""The scene of a ship: model, steering, programme, laser scanner, sea and bodies, from a TOML file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raychan.run.ship.bridge import Bridge, bridge_of
from raychan.run.ship.replay import PoseFile, read_poses
from raychan.run.ship.schema import ScannerTable, ShipBodyTable, ShipFile, SpotTable
from raychan.sensors.laser import REFLECTIVITY, Scanner
from raychan.sensors.spot import Echo, Spot
from raychan.world.body import Body
from raychan.world.errors import SceneError, is_guess, nearest
from raychan.world.scene import Scene
from raychan.world.scene_files import bundled, overrides
from raychan.world.scene_files.build import scene_text
from raychan.world.scene_files.errors import checked

Floats = NDArray[np.float64]
_STEP = 1.0 / 75.0  # s: so often rudder and autopilot act at least, however slow the mirror
_REFLECTIVITY = 0.5  # of a body without a material: between wood and paper


@dataclass(frozen=True)
class ShipScene:
    """A ship's scene: its tables, and what is made of them.

    `bodies`, a scene of theirs; `reflectivity` (b,) of `bodies.bodies`; `bridge`, or `poses` in its place.
    """

    title: str
    text: str
    path: Path | None
    tables: ShipFile
    scanner: Scanner
    bodies: Scene
    reflectivity: Floats
    bridge: Bridge | None
    poses: PoseFile | None

    @property
    def names(self) -> list[str]:
        """Names of the bodies, which a scan numbers from 0."""
        return [body.name for body in self.bodies.bodies]

    @property
    def warnings(self) -> list[str]:
        """Return lines on what is likely a mistake."""
        deck = 0.0 if self.poses is None else float(self.poses.pose[:, 2].min())
        height = deck + self.tables.scanner.position[2]
        said = list(self.bodies.warnings)
        if height <= 0.0 and self.tables.sea is not None:
            said.append(f"the scanner is {-height:g} m below the water line and meets no sea (scanner.position)")
        return said

    @property
    def ends_early(self) -> list[str]:
        """Return a line where the logged poses end before the duration of the scene."""
        wanted = self.tables.run.duration_s
        if self.poses is None or self.poses.duration >= wanted:
            return []
        last = f"the log ends after {self.poses.duration:g} s, before run.duration_s = {wanted:g}"
        return [f"{last}: the voyage ends with it"]

    @property
    def duration(self) -> float:
        """How long [s] the voyage is: as the scene says, and no longer than the logged poses."""
        wanted = self.tables.run.duration_s
        return wanted if self.poses is None else min(wanted, self.poses.duration)


def read_ship_scene(name_or_path: str | Path, changes: Sequence[str] = ()) -> ShipScene:
    """Return the ship's scene of a TOML file, or one that comes with raychan by its name, such as 'ship_turn'.

    Args: changes of keys, each written 'dotted.key=value'.
    Raises: SceneError where file, syntax, key or value is wrong.
    """
    text, file = scene_text(name_or_path, bundled.ship_names())
    data = overrides.parsed(text, file)
    text += "".join(f"\n# changed: {c}" for c in changes)
    return ship_scene(overrides.changed(data, changes, file), file, text)


def ship_scene(data: object, path: Path | None = None, text: str = "") -> ShipScene:
    """Return the ship's scene of tables as they stand in its file. Raises: SceneError."""
    if isinstance(data, Mapping) and "radar" in data:
        raise SceneError("is a scene of a radar, not of a ship", file=path, key="radar", allowed="raychan run")
    tables: ShipFile = checked(ShipFile, data, path)
    folder = Path.cwd() if path is None else path.parent
    try:
        scanner = _scanner(tables.scanner)
        bridge = poses = None
        if tables.replay is None:
            bridge = bridge_of(tables, step_of(scanner))
        elif tables.avoidance is not None:
            raise SceneError("keys do not fit together", key="avoidance", allowed="avoidance without replay")
        else:
            poses = _poses(folder / tables.replay.file, tables.replay.max_gap_s, scanner.duration)
        bodies = Scene(bodies=[_body(t, folder) for t in tables.bodies], path=path, folder=folder)
        given = {t.name: _reflectivity(t) for t in tables.bodies}
    except SceneError as error:
        raise error.at(file=path) from None
    if tables.run.duration_s < scanner.duration:
        allowed = f"at least one scan, {scanner.duration:.4g} s"
        raise SceneError("is too short", file=path, key="run.duration_s", value=tables.run.duration_s, allowed=allowed)
    reflectivity = np.array([given[body.name.split(".")[0]] for body in bodies.bodies], float)
    title = tables.scene.title
    return ShipScene(title, text, path, tables, scanner, bodies, reflectivity, bridge, poses)


def _poses(file: Path, max_gap: float, scan: float) -> PoseFile:
    """Return the logged poses of a file, which must last a scan [s]. Raises: SceneError."""
    try:
        poses = read_poses(file, max_gap)
    except SceneError as error:
        raise (error.of_key(f"replay.{error.key}") if error.key else error) from None
    if poses.duration < scan * (1.0 - 1e-9):  # as `ShipLoop.scans` counts
        allowed = f"at least one scan, {scan:.4g} s"
        problem = f"the log lasts {poses.duration:g} s from its first row to its last"
        raise SceneError(problem, file=file, value=poses.duration, allowed=allowed)
    return poses


def step_of(scanner: Scanner) -> float:
    """Return the step [s] of a loop: a turn of the mirror, or, where that takes longer than _STEP, a part of it."""
    turn = 1.0 / scanner.mirror_hz
    return turn / max(1, math.ceil(turn / _STEP - 1e-9))


def _scanner(t: ScannerTable) -> Scanner:
    try:
        spot = None if t.spot is None else _spot(t.spot)
        return Scanner(
            t.fan_deg, t.step_deg, t.mirror_hz, t.max_range_m, t.dark_range_m, spot=spot, lambert=t.lambert,
            moving=t.motion,
        )  # fmt: skip
    except SceneError as error:
        raise error.at(key="scanner") from None


def _spot(t: SpotTable) -> Spot:
    return Spot(t.divergence_mrad * 1e-3, t.exit_mm * 1e-3, t.rings, Echo[t.echo.upper()], t.merge_m)


def _body(t: ShipBodyTable, folder: Path) -> Body:
    return Body(
        name=t.name,
        mesh=None if t.mesh is None else folder / t.mesh,
        shape=t.shape,
        params=t.params,
        material="pec",  # of a radar; a laser beam asks the reflectivity
        position=t.position,
        yaw_deg=t.yaw_deg,
        pitch_deg=t.pitch_deg,
        roll_deg=t.roll_deg,
        velocity=t.velocity_mps,
        turn_rate_dps=t.turn_rate_dps,
        unit=t.unit,
        up=t.up,
        forward=t.forward,
        scale=t.scale,
        crease_deg=t.crease_deg,
    )


def _reflectivity(t: ShipBodyTable) -> float:
    if t.material is None:
        return _REFLECTIVITY if t.reflectivity is None else t.reflectivity
    if t.material not in REFLECTIVITY:
        key, allowed = f"bodies.{t.name}.material", nearest(t.material, REFLECTIVITY)
        if not is_guess(allowed):  # names hold commas
            allowed = "one of " + ", ".join(map(repr, REFLECTIVITY))
        raise SceneError(f"unknown material '{t.material}'", key=key, value=t.material, allowed=allowed)
    return REFLECTIVITY[t.material]
