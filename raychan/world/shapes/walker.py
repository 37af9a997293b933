"""A walking person: rigid segments that follow the gait of Boulic, Magnenat-Thalmann and Thalmann."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from raychan.world.meshes.mesh import Floats, Mesh
from raychan.world.shapes.gait import HIP, Gait
from raychan.world.shapes.piece import SAG, Assembly, Piece
from raychan.world.shapes.skeleton import parameters, roll, swing, yaw
from raychan.world.shapes.solid import capsule, ellipsoid

THIGH, SHANK, ANKLE, FOOT = 0.245, 0.246, 0.039, 0.152
UPPER_ARM, FOREARM, HAND = 0.186, 0.146, 0.108
HALF_HIPS, HALF_SHOULDERS, SHOULDER, CHIN, HEAD = 0.052, 0.122, 0.288, 0.340, 0.130
"""Lengths over the height of the body (Drillis and Contini 1966); shoulder and chin above the hips."""
_SAG = 3.0 * SAG
_SIDES = {"left": 1.0, "right": -1.0}


@dataclass(frozen=True)
class Walker:
    """A person of `height` [m] who walks along +x at `speed` [m/s], at `phase` of the cycle at time 0.

    Allowed: `speed` of 0.053 to 1.59 times `height` a second.
    Raises: ValueError for a speed that nobody of that height walks at.
    """

    height: float = 1.75
    speed: float = 1.4
    phase: float = 0.0
    material: str = "skin"
    max_sag: float = _SAG

    def __post_init__(self) -> None:
        _ = self.gait

    @cached_property
    def gait(self) -> Gait:
        """How this person walks."""
        return Gait(self.height, self.speed)

    def later(self, time: float) -> dict[str, object]:
        """Return the parameters of this person as of a time [s]."""
        phase = (self.phase + time / self.gait.cycle) % 1.0
        return {**parameters(self), "phase": phase}

    def meshes(self) -> dict[str, Mesh]:
        """Return the mesh of each limb; its joint nearest to the trunk is the origin, it hangs along -z."""
        pieces = {"trunk": self._trunk(), "head": self._head()}
        for side in _SIDES:
            for limb, (length, thick, thin) in _LIMBS.items():
                pieces[f"{limb}_{side}"] = [self._hanging(length, thick, thin)]
            pieces[f"forearm_{side}"].append(self._ball((0.020, 0.013, 0.5 * HAND), FOREARM + 0.4 * HAND))
            pieces[f"foot_{side}"] = [self._foot()]
        return {limb: self._made(some) for limb, some in pieces.items()}

    def poses(self, limb: str, time: Floats) -> tuple[Floats, Floats]:
        """Return rotations (t, 3, 3) and origins (t, 3) [m] of a limb at times (t,) [s], the person going along."""
        t = np.asarray(time, float) / self.gait.cycle + self.phase
        name, _, side = limb.partition("_")
        hips = self.gait.pelvis_shift(t) + np.array([0.0, 0.0, HIP * self.height])
        if side and name in ("thigh", "shank", "foot"):
            return self._leg(name, _SIDES[side], t, hips)
        gait, h = self.gait, self.height
        chest = yaw(gait.thorax_yaw(t)) @ swing(-gait.lean(t))
        if name == "trunk":
            return chest, hips
        if name == "head":
            return chest, hips + h * chest @ [0.0, 0.0, CHIN]
        own = t + (0.0 if side == "right" else 0.5)
        upper = chest @ swing(gait.shoulder(own))
        at = hips + h * chest @ [0.0, _SIDES[side] * HALF_SHOULDERS, SHOULDER]
        if name == "arm":
            return upper, at
        return upper @ swing(gait.elbow(own)), at + h * upper @ [0.0, 0.0, -UPPER_ARM]

    def _leg(self, name: str, side: float, t: Floats, hips: Floats) -> tuple[Floats, Floats]:
        gait, h = self.gait, self.height
        pelvis = yaw(gait.pelvis_yaw(t)) @ roll(-gait.pelvis_drop(t))
        own = t + (0.0 if side < 0.0 else 0.5)
        # The leg swings in the plane of walking: the hip makes up for the drop of the pelvis.
        turn = yaw(gait.pelvis_yaw(t)) @ swing(gait.hip(own))
        at = hips + h * pelvis @ [0.0, side * HALF_HIPS, 0.0]
        if name == "thigh":
            return turn, at
        at = at + h * turn @ [0.0, 0.0, -THIGH]
        turn = turn @ swing(-gait.knee(own))
        if name == "shank":
            return turn, at
        return turn @ swing(gait.ankle(own)), at + h * turn @ [0.0, 0.0, -SHANK]

    def _made(self, pieces: list[Piece]) -> Mesh:
        made = Assembly()
        made.add("body", self.material, *pieces)
        return made.mesh()

    def _hanging(self, length: float, thick: float, thin: float) -> Piece:
        h = self.height
        return capsule(np.zeros(3), np.array([0.0, 0.0, -length * h]), thick * h, thin * h, self.max_sag)

    def _ball(self, semi: tuple[float, float, float], below: float, ahead: float = 0.0) -> Piece:
        h = self.height
        whole = ellipsoid((semi[0] * h, semi[1] * h, semi[2] * h), self.max_sag)
        return whole.moved(offset=(ahead * h, 0.0, -below * h))

    def _trunk(self) -> list[Piece]:
        h = self.height
        side = np.array([0.0, 0.095 * h, 0.275 * h])
        shoulders = capsule(side * [1.0, -1.0, 1.0], side, 0.034 * h, 0.034 * h, self.max_sag)
        chest, belly = self._ball((0.066, 0.108, 0.154), -0.17), self._ball((0.066, 0.094, 0.114), -0.02)
        return [chest, belly, shoulders]

    def _head(self) -> list[Piece]:
        h = self.height
        neck = capsule(
            np.array([0.0, 0.0, -0.06 * h]), np.array([0.0, 0.0, 0.02 * h]), 0.034 * h, 0.031 * h, self.max_sag
        )
        return [self._ball((0.054, 0.045, 0.5 * HEAD), -0.5 * HEAD), neck]

    def _foot(self) -> Piece:
        """Return the foot, its ankle the origin, a quarter of it behind."""
        h, radius = self.height, 0.5 * ANKLE
        heel, toe = np.array([-0.25 * FOOT + radius, 0.0, -radius]), np.array([0.75 * FOOT - radius, 0.0, -radius])
        return capsule(h * heel, h * toe, radius * h, 0.95 * radius * h, self.max_sag)


_LIMBS = {
    "thigh": (THIGH, 0.047, 0.032),
    "shank": (SHANK, 0.032, 0.024),
    "arm": (UPPER_ARM, 0.028, 0.024),
    "forearm": (FOREARM, 0.024, 0.017),
}
"""Length, and radii at both ends, over the height of the body; those of the standing pedestrian."""
