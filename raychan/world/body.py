"""A body: a mesh with materials, a pose and a motion, and perhaps a given radar cross-section."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, Union

import numpy as np

from raychan.radar.declared import is_whole, reals
from raychan.records import Role
from raychan.scalars import plain
from raychan.units import undb
from raychan.world import limits, shapes
from raychan.world.errors import SceneError, nearest, shown
from raychan.world.limbs import LimbMotion, limbs_of
from raychan.world.limits import Limit
from raychan.world.material import Material
from raychan.world.mesh_files.mesh_io import check_crease, from_trimesh, load, matrix_of, mesh_file, oddities
from raychan.world.meshes.creases import uncertain_folds
from raychan.world.meshes.mesh import CREASE_DEG, Floats, Mesh
from raychan.world.motion import Motion
from raychan.world.read_only import kept, listed

if TYPE_CHECKING:
    import trimesh

MeshLike: TypeAlias = Union[Mesh, "trimesh.Trimesh", "trimesh.Scene", str, Path]
"""A mesh of ours, one of trimesh, or the name of a file."""
ROLES = {role.name.lower(): role for role in Role}
_SCALARS = ("yaw_deg", "pitch_deg", "roll_deg", "turn_rate_dps", "swerling", "scale", "crease_deg")
_TABLES = ("params", "materials", "position", "velocity", "spin_dps", "rcs_dbsm", "rcs_point")


@dataclass(frozen=True)
class Body:
    """A body of the scene: `mesh` (Mesh, trimesh or a path) or built-in `shape` with `params`, one of both.

    `unit`, `up`, `forward` (as of a mesh file; of a trimesh `up` is z) and `scale` say how a path or trimesh is read.
    Angles in degrees, turn_rate_dps [deg/s], velocity [m/s], world axes; spin_dps (3,) [deg/s] about its own axes;
    `material` for all parts or `materials` by part (patterns), a name or a Material. `rcs_dbsm` [dBsm], a number or
    (azimuth_deg, dBsm) pairs relative to its heading, makes it a point target at `rcs_point` (body frame [m]) whose
    mesh only blocks; that RCS fluctuates by its Swerling case `swerling`, 0 to 4. Lists and arrays are taken over as
    tuples: what becomes of the caller's later does not matter.
    """

    name: str
    mesh: MeshLike | None = None
    shape: str | None = None
    params: Mapping[str, object] = field(default_factory=dict)
    material: str | Material | None = None
    materials: Mapping[str, str | Material] = field(default_factory=dict)
    position: Sequence[float] = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    velocity: Sequence[float] = (0.0, 0.0, 0.0)
    turn_rate_dps: float = 0.0
    spin_dps: Sequence[float] = (0.0, 0.0, 0.0)
    rcs_dbsm: float | Sequence[tuple[float, float]] | None = None
    rcs_point: Sequence[float] | None = None
    swerling: int = 0
    role: str | None = None
    unit: str = "m"
    up: str | None = None
    forward: str | None = None
    scale: float = 1.0
    crease_deg: float = CREASE_DEG

    def __post_init__(self) -> None:
        # The caller's arrays and lists may go on to the next body, and meshes are made once: a later change of what is
        # given would move bodies of a finished scene, or have no effect.
        for names, taken in ((_SCALARS, plain), (_TABLES, kept)):
            for name in names:
                object.__setattr__(self, name, taken(getattr(self, name)))
        if not isinstance(self.mesh, Mesh | str | Path | None) and hasattr(self.mesh, "copy"):
            object.__setattr__(self, "mesh", self.mesh.copy())

    @cached_property
    def geometry(self) -> Mesh:
        """The mesh in the body's own frame."""
        if (self.mesh is None) == (self.shape is None):
            wrong = "neither shape nor mesh is given" if self.mesh is None else "keys do not fit together"
            raise SceneError(wrong, key=self.name, allowed="either shape or mesh")
        try:
            if isinstance(self.mesh, (str, Path)):
                try:
                    mesh_file(self.mesh)
                except SceneError as e:
                    raise e.of_key("mesh") from None
                return load(self.mesh, self.unit, self.up, self.forward, self.scale, self.crease_deg)
            # Without effect on a shape or a Mesh, but no less wrong beside them.
            check_crease(self.crease_deg)
            turn = matrix_of(self.unit, self.up, self.forward, self.scale)
            if self.shape is not None:
                try:
                    return shapes.build(self.shape, listed(self.params))
                except SceneError as e:
                    raise e.at(key="" if e.key == "shape" else "params") from None
            if isinstance(self.mesh, Mesh):
                return self.mesh
            return from_trimesh(self.mesh, self.crease_deg, turn)
        except SceneError as e:
            raise e.at(key=self.name) from None

    @cached_property
    def motion(self) -> Motion:
        """Pose at time 0 and rates."""
        x, y, z = self._numbers("position", limits.PLACE, 3)
        u, v, w = self._numbers("velocity", limits.SPEED, 3)
        angles = [self._numbers(name, limits.ANGLE)[0] for name in ("yaw_deg", "pitch_deg", "roll_deg")]
        turns = *self._numbers("turn_rate_dps", limits.TURN), *self._numbers("spin_dps", limits.TURN, 3)
        yaw, pitch, roll, turn, *spin = map(float, np.radians([*angles, *turns]))
        return Motion((x, y, z), yaw, pitch, roll, (u, v, w), turn, (spin[0], spin[1], spin[2]))

    def _numbers(self, name: str, limit: Limit, count: int = 1) -> list[float]:
        """Return a field as `count` numbers. Raises: SceneError where they are no numbers or beyond their limit."""
        value = getattr(self, name)
        try:
            given = reals(name, value)
        except ValueError:
            given = np.zeros(0)
        found = given.ravel().tolist()
        if given.shape != (() if count == 1 else (count,)) or not all(map(limit.allows, found)):
            allowed = limit.allowed if count == 1 else f"{count} numbers, each {limit.allowed}"
            raise SceneError(f"{shown(value)} is not possible", key=f"{self.name}.{name}", value=value, allowed=allowed)
        return list(found)

    @cached_property
    def limbs(self) -> tuple[Body, ...]:
        """The rigid bodies 'NAME.LIMB' of which a walker or a cyclist is made; of others the body itself."""
        try:
            try:
                skeleton = shapes.skeleton(self.shape, listed(self.params))
            except SceneError as e:
                raise e.at(key=f"{self.name}.params") from None
            return (
                (self,)
                if skeleton is None or isinstance(self.__dict__.get("motion"), LimbMotion)
                else limbs_of(self, skeleton)
            )
        except SceneError as e:
            raise e.at(key="bodies") from None

    @property
    def moves(self) -> bool:
        """Whether it moves or turns."""
        return self.motion.moves

    def at(self, time: float) -> Body:
        """Return the body where it is at a time [s], itself if it does not move; the mesh is shared."""
        if not self.moves:
            return self
        then = self.motion.at(time)
        yaw, pitch, roll = (float(np.degrees(a)) for a in (then.yaw, then.pitch, then.roll))
        moved = copy(self)  # `replace` would copy a mesh in memory at each instant
        moved.__dict__.pop("limbs", None)
        moved.__dict__.update(position=then.position, yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
        moved.__dict__.update(geometry=self.geometry, motion=then)
        return moved

    @property
    def resolved_role(self) -> Role:
        """What it does besides blocking: as `role` says; else the ground mirrors, a body of given RCS only blocks."""
        if self.role is not None:
            if self.role not in ROLES:
                raise SceneError(
                    f"unknown role '{self.role}'", key=f"{self.name}.role", allowed=nearest(self.role, ROLES)
                )
            return ROLES[self.role]
        if self.rcs_dbsm is not None:
            return Role.BLOCKER
        return Role.MIRROR if self.shape == "ground" else Role.SCATTERER

    @property
    def fluctuates(self) -> bool:
        """Whether its RCS does; SceneError for an unknown Swerling case, or where no RCS is given."""
        known = is_whole(self.swerling) and self.swerling in range(5)
        if not known or (self.swerling and self.rcs_dbsm is None):
            key, allowed = f"{self.name}.swerling", "0, 1, 2, 3 or 4, above 0 only with rcs_dbsm"
            raise SceneError(f"{shown(self.swerling)} is not possible", key=key, value=self.swerling, allowed=allowed)
        return self.swerling > 0

    def part_materials(self) -> list[str | Material]:
        """Return the material of each part: by name or pattern, else the body's, else the shape's, else PEC."""
        mesh = self.geometry
        own = mesh.part_materials or ("pec",) * len(mesh.part_names)
        for pattern in self.materials:
            if not any(_means(pattern, part, mesh.part_names) for part in mesh.part_names):
                allowed = nearest(pattern, mesh.part_names)
                raise SceneError("no such part", key=f"{self.name}.materials.{pattern}", value=pattern, allowed=allowed)
        chosen: list[str | Material] = []
        for part, default in zip(mesh.part_names, own, strict=True):
            fits = [m for pattern, m in self.materials.items() if _means(pattern, part, mesh.part_names)]
            given = (self.materials.get(part), fits[-1] if fits else None, self.material, default)
            chosen.append(next(m for m in given if m is not None))
        return chosen

    def target(self) -> tuple[Floats, Floats]:
        """Return the RCS table: azimuths [rad] relative to the heading, from -pi to pi, and RCS [m2] there.

        A table is linear in dB between its azimuths and wraps around; it is resampled every degree.
        """
        if np.ndim(self.rcs_dbsm) == 0:  # type: ignore[arg-type]
            return np.array([-np.pi, np.pi]), np.full(2, float(undb(self.rcs_dbsm)))
        azimuth, dbsm = self.rcs_table.T
        knots = np.radians(np.arange(-180.0, 181.0))
        return knots, np.asarray(undb(np.interp(np.degrees(knots), azimuth, dbsm, period=360.0)))

    @property
    def rcs_table(self) -> Floats:
        """Azimuths [deg] from -180 on and RCS [dBsm] there (n, 2), none where one figure or none is given; SceneError
        for two values at one azimuth."""
        if np.ndim(self.rcs_dbsm) == 0:  # type: ignore[arg-type]
            return np.zeros((0, 2))
        pairs = np.array(self.rcs_dbsm, float).reshape(-1, 2)
        pairs[:, 0] = (pairs[:, 0] + 180.0) % 360.0 - 180.0
        pairs = pairs[np.argsort(pairs[:, 0])]
        twice = np.flatnonzero(pairs[1:, 0] == pairs[:-1, 0])
        if len(twice):
            problem = f"two values for the azimuth {pairs[twice[0], 0]:g} deg"
            raise SceneError(problem, key=f"{self.name}.rcs_dbsm", allowed="one value for each azimuth")
        return pairs

    def target_point(self) -> Floats:
        """Return where the point target stands in the body frame (3,) [m]."""
        if self.rcs_point is None:
            return np.asarray(self.geometry.bounds.mean(axis=0))
        return np.asarray(self.rcs_point, float)

    def notes(self) -> list[str]:
        """Return warnings about a mesh from outside: its health, a unit or axis that seems wrong, no material."""
        if self.shape:
            return []
        mesh, key = self.geometry, f"bodies.{self.name}."
        said = list(mesh.report.warnings())
        file = self.mesh if isinstance(self.mesh, str | Path) else ""
        said += oddities(mesh, file, self.unit, self.up if file else "z", key)
        folds = uncertain_folds(mesh, f"{key}crease_deg")
        said += [folds] if folds else []
        bare = [] if mesh.part_materials or self.material or self.rcs_dbsm is not None else self._bare_parts()
        if bare:
            what = "it" if len(bare) == len(mesh.part_names) else f"parts {', '.join(bare)}"
            said.append(f"no material given, {what} is taken as a perfect conductor ({key}material)")
        return [f"body '{self.name}': {text}" for text in said]

    def _bare_parts(self) -> list[str]:
        """Return the parts for which `materials` has no name or pattern."""
        parts = self.geometry.part_names
        return [part for part in parts if not any(_means(pattern, part, parts) for pattern in self.materials)]


def _means(pattern: str, part: str, parts: Sequence[str]) -> bool:
    """Return whether a name or pattern means a part; the name of a part is no pattern, whatever brackets it has."""
    return pattern == part if pattern in parts else fnmatchcase(part, pattern)
