"""A pedestrian of capsules and ellipsoids, standing or in mid-stride."""

from __future__ import annotations

import numpy as np

from raychan.world.meshes.mesh import Floats, Mesh
from raychan.world.shapes.piece import SAG, Assembly
from raychan.world.shapes.solid import capsule, ellipsoid


def pedestrian(height: float = 1.75, stride: float = 0.0, material: str = "skin", max_sag: float = SAG) -> Mesh:
    """Return a person facing +x; height [m] overall, stride [m] between the feet (0 standing).

    Origin: on the ground between the feet. Parts: head, torso, arm_left, arm_right, leg_left, leg_right. Proportions:
    about those of the 50th-percentile man (Drillis and Contini 1966, segment lengths over height).
    """
    made = Assembly()
    s, sag = height / 1.75, 3.0 * max_sag
    swing = float(np.arcsin(min(0.5 * stride / (0.86 * s), 0.6)))

    def at(x: float, y: float, z: float) -> Floats:
        return s * np.array([x, y, z])

    made.add("head", material, ellipsoid((0.095 * s, 0.078 * s, 0.115 * s), sag).moved(offset=(0.0, 0.0, 1.635 * s)))
    made.add("head", material, capsule(at(0.0, 0.0, 1.38), at(0.0, 0.0, 1.56), 0.06 * s, 0.055 * s, sag))
    chest = ellipsoid((0.115 * s, 0.19 * s, 0.27 * s), sag).moved(offset=(0.0, 0.0, 1.22 * s))
    hips = ellipsoid((0.115 * s, 0.165 * s, 0.2 * s), sag).moved(offset=(0.0, 0.0, 0.96 * s))
    shoulders = capsule(at(0.0, -0.17, 1.4), at(0.0, 0.17, 1.4), 0.06 * s, 0.06 * s, sag)
    made.add("torso", material, chest, hips, shoulders)
    for part, side in (("left", 1.0), ("right", -1.0)):
        turn = side * swing
        knee = at(0.43 * np.sin(turn) + 0.02, 0.095 * side, 0.92 - 0.43 * np.cos(turn))
        ankle = at(0.84 * np.sin(turn), 0.095 * side, 0.0)
        ankle[2] = 0.07 * s
        hip = at(0.0, 0.09 * side, 0.92)
        foot = ankle + at(0.15, 0.02 * side, -0.07) + [0.0, 0.0, 0.036 * s]
        heel = ankle * [1.0, 1.0, 0.0] + [-0.02 * s, 0.0, 0.04 * s]
        leg = [capsule(hip, knee, 0.082 * s, 0.055 * s, sag), capsule(knee, ankle, 0.055 * s, 0.042 * s, sag)]
        made.add(f"leg_{part}", material, *leg, capsule(heel, foot, 0.04 * s, 0.036 * s, sag))
        elbow = at(-0.28 * np.sin(turn), 0.25 * side, 1.4 - 0.29 * np.cos(turn))
        wrist = elbow + at(-0.25 * np.sin(turn) + 0.08, 0.0, -0.25 * np.cos(turn))
        shoulder = at(0.0, 0.215 * side, 1.4)
        hand = ellipsoid((0.035 * s, 0.022 * s, 0.08 * s), sag)
        low = wrist + at(0.015, 0.0, -0.07)
        arm = [capsule(shoulder, elbow, 0.05 * s, 0.042 * s, sag), capsule(elbow, wrist, 0.042 * s, 0.03 * s, sag)]
        made.add(f"arm_{part}", material, *arm, hand.moved(offset=(low[0], low[1], low[2])))
    return made.mesh()
