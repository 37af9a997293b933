"""What shapes with limbs share: turns about an axis, and the mesh of all limbs as they stand at time 0."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from raychan.world.meshes.mesh import Floats, Mesh, make_mesh


class Skeleton(Protocol):
    """What a shape with limbs tells: how fast it goes along its +x, its meshes by limb, and their poses over time."""

    @property
    def speed(self) -> float:
        """Speed [m/s]."""

    def meshes(self) -> dict[str, Mesh]:
        """Return the mesh of each limb in a frame of its own."""

    def poses(self, limb: str, time: Floats) -> tuple[Floats, Floats]:
        """Return rotations (t, 3, 3) and origins (t, 3) [m] of a limb at times (t,) [s] in the frame of the body, which
        goes along."""

    def later(self, time: float) -> dict[str, object]:
        """Return the parameters of the shape that stands at time 0 as this one does at a time [s]."""


def at_once(skeleton: Skeleton) -> Mesh:
    """Return the mesh of all limbs as they stand at time 0; parts are limbs, or 'LIMB.PART'."""
    vertices, faces, parts, normals = [], [], [], []
    names: list[str] = []
    materials: list[str] = []
    count = 0
    for limb, mesh in skeleton.meshes().items():
        turn, origin = (x[0] for x in skeleton.poses(limb, np.zeros(1)))
        vertices.append(mesh.vertices @ turn.T + origin)
        faces.append(mesh.faces + count)
        parts.append(mesh.part + len(names))
        normals.append(mesh.normals @ turn.T)
        names += [limb if part == "body" else f"{limb}.{part}" for part in mesh.part_names]
        materials += mesh.part_materials
        count += len(mesh.vertices)
    columns = np.concatenate(vertices), np.concatenate(faces), np.concatenate(parts)
    return make_mesh(*columns, tuple(names), np.concatenate(normals), part_materials=tuple(materials))


def parameters(skeleton: object) -> dict[str, object]:
    """Return the parameters of a skeleton."""
    return {name: getattr(skeleton, name) for name in skeleton.__dataclass_fields__}  # type: ignore[attr-defined]


def swing(angle: Floats) -> Floats:
    """Return rotations (..., 3, 3) by angles [rad] that swing what hangs down forward."""
    return _turn(0, 2, angle)


def yaw(angle: Floats) -> Floats:
    """Return rotations (..., 3, 3) to the left."""
    return _turn(0, 1, angle)


def roll(angle: Floats) -> Floats:
    """Return rotations (..., 3, 3) that lift the left side."""
    return _turn(1, 2, angle)


def _turn(first: int, second: int, angle: Floats) -> Floats:
    """Return rotations (..., 3, 3) that turn one axis towards another."""
    out = np.zeros((*np.shape(angle), 3, 3))
    out[..., range(3), range(3)] = 1.0
    out[..., first, first] = out[..., second, second] = np.cos(angle)
    out[..., second, first] = np.sin(angle)
    out[..., first, second] = -np.sin(angle)
    return out
