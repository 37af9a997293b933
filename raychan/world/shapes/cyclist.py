"""A cyclist: wheels that roll, cranks that turn, and legs that follow the pedals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from raychan.world.meshes.mesh import Floats, Mesh
from raychan.world.shapes.curve import steps
from raychan.world.shapes.piece import SAG, Assembly, Piece, grid
from raychan.world.shapes.skeleton import parameters, swing
from raychan.world.shapes.solid import capsule, ellipsoid
from raychan.world.shapes.walker import FOOT, SHANK, THIGH

WHEEL, TYRE = 0.34, 0.018
"""Outer radius of a wheel and half width of its tyre [m]: 622 mm rims, 35 mm tyres (ISO 5775)."""
CRANK, GEAR = 0.17, 2.6
"""Length of a crank [m], and turns of the wheel a turn of the cranks."""
_REAR, _FRONT, _BRACKET = np.array([-0.49, 0.0, WHEEL]), np.array([0.56, 0.0, WHEEL]), np.array([-0.05, 0.0, 0.28])
_SPOKES = 16  # half of a wheel's: as many facets as the rest of the wheel
_ANKLE = np.array([-0.10, 0.0, 0.11])  # m: from the pedal's axle
_SAG = 3.0 * SAG
_SIDES = {"left": 1.0, "right": -1.0}


@dataclass(frozen=True)
class Cyclist:
    """Person of `height` [m] riding along +x at `speed` [m/s]; `phase` turns of the right pedal past its top at time 0.

    Allowed: `height` 1.45 to 2.1 m, whom the bicycle fits, and `speed` up to 30 m/s.
    Raises: ValueError for a person whom the bicycle does not fit.
    """

    height: float = 1.75
    speed: float = 5.0
    phase: float = 0.0
    material: str = "skin"
    max_sag: float = _SAG

    def __post_init__(self) -> None:
        if not 1.45 <= self.height <= 2.1:
            raise ValueError(f"height = {self.height:g} m: the bicycle fits 1.45 to 2.1 m")

    @property
    def hip(self) -> Floats:
        """Where the hips are (3,) [m]: nine tenths of a stretched leg above the lower pedal."""
        below = _BRACKET - [0.0, 0.0, CRANK] + _ANKLE
        return np.array([-0.24, 0.0, below[2] + 0.9 * (THIGH + SHANK) * self.height])

    @cached_property
    def shoulders(self) -> Floats:
        """Where the shoulders are (3,) [m]: the trunk leans 35 deg forward."""
        return self.hip + 0.288 * self.height * np.array([np.sin(0.61), 0.0, np.cos(0.61)])

    def later(self, time: float) -> dict[str, object]:
        """Return the parameters of this cyclist as of a time [s]."""
        turns = self.speed * time / (2.0 * np.pi * WHEEL)
        return {**parameters(self), "phase": self.phase + turns / GEAR}

    def meshes(self) -> dict[str, Mesh]:
        """Return the mesh of each limb; joints and axles are the origins, legs hang along -z."""
        h, leg = self.height, {}
        for side in _SIDES:
            leg[f"thigh_{side}"] = self._made(self._rod([0, 0, 0], [0, 0, -THIGH * h], 0.047 * h, 0.032 * h))
            leg[f"shank_{side}"] = self._made(self._rod([0, 0, 0], [0, 0, -SHANK * h], 0.032 * h, 0.024 * h))
            heel, toe = [-0.25 * FOOT * h, 0.0, -0.06], [0.75 * FOOT * h, 0.0, -0.06]
            leg[f"foot_{side}"] = self._made(self._rod(heel, toe, 0.036, 0.034))
        wheels = {name: self._wheel() for name in ("wheel_front", "wheel_rear")}
        return {"frame": self._frame(), "rider": self._made(*self._rider()), **wheels, "crank": self._crank(), **leg}

    def poses(self, limb: str, time: Floats) -> tuple[Floats, Floats]:
        """Return rotations (t, 3, 3) and origins (t, 3) [m] of a limb at times (t,) [s], the bicycle going along."""
        t = np.asarray(time, float)
        rolled = self.speed * t / WHEEL + 2.0 * np.pi * GEAR * self.phase
        cranked = rolled / GEAR
        still = np.zeros_like(t)
        name, _, side = limb.partition("_")
        if name == "wheel":
            return swing(-rolled), still[:, None] + (_FRONT if side == "front" else _REAR)
        if name == "crank":
            return swing(-cranked), still[:, None] + _BRACKET
        if name in ("frame", "rider"):
            return swing(still), still[:, None] + np.zeros(3)
        return self._leg(name, _SIDES[side], cranked)

    def _leg(self, name: str, side: float, cranked: Floats) -> tuple[Floats, Floats]:
        """Return the poses of a leg that reaches from the hip to the pedal."""
        turned = cranked + (0.0 if side < 0.0 else np.pi)
        pedal = _BRACKET + CRANK * np.stack([np.sin(turned), 0.0 * turned, np.cos(turned)], axis=-1)
        out = np.array([0.0, 0.09 * side, 0.0])
        hip, ankle = self.hip + out, pedal + _ANKLE + out
        if name == "foot":
            return swing(0.0 * turned), ankle
        way = ankle - hip
        far = np.hypot(way[:, 0], way[:, 2])
        thigh, shank = THIGH * self.height, SHANK * self.height
        # The law of cosines; knees bend forward.
        lifted = np.arccos((thigh**2 + far**2 - shank**2) / (2.0 * thigh * far))
        turn = swing(np.arctan2(way[:, 0], -way[:, 2]) + lifted)
        if name == "thigh":
            return turn, np.broadcast_to(hip, ankle.shape)
        knee = hip + turn @ [0.0, 0.0, -thigh]
        down = ankle - knee
        return swing(np.arctan2(down[:, 0], -down[:, 2])), knee

    def _rod(self, start: object, stop: object, r0: float, r1: float) -> Piece:
        return capsule(np.asarray(start, float), np.asarray(stop, float), r0, r1, min(self.max_sag, 0.25 * min(r0, r1)))

    def _made(self, *pieces: Piece) -> Mesh:
        made = Assembly()
        made.add("body", self.material, *pieces)
        return made.mesh()

    def _frame(self) -> Mesh:
        """Return frame, fork, bars and saddle."""
        head, bars = np.array([0.42, 0.0, 0.86]), np.array([0.44, 0.0, 0.98])
        saddle = self.hip - [0.04, 0.0, 0.09]
        wide = np.array([0.0, 0.27, 0.0])
        main = ((_BRACKET, head), (_BRACKET, saddle), (saddle, head))
        rods = [self._rod(one, other, 0.017, 0.017) for one, other in main]
        rods += [
            self._rod(bars - wide, bars + wide, 0.012, 0.012),
            self._rod(head, bars, 0.014, 0.014),
        ]
        for side in (-0.06, 0.06):
            out = np.array([0.0, side, 0.0])
            rods += [self._rod(head + 0.3 * out, _FRONT + out, 0.012, 0.012)]
            rods += [self._rod(start + 0.3 * out, _REAR + out, 0.009, 0.009) for start in (_BRACKET, saddle)]
        made = Assembly()
        made.add("tubes", "metal", *rods)
        seat = ellipsoid((0.13, 0.07, 0.03), self.max_sag).moved(offset=(saddle[0], 0.0, saddle[2]))
        made.add("saddle", "rubber", seat)
        return made.mesh()

    def _rider(self) -> list[Piece]:
        """Return trunk, head and arms."""
        h, hip, top = self.height, self.hip, self.shoulders
        head = ellipsoid((0.054 * h, 0.045 * h, 0.065 * h), self.max_sag)
        up = (top - hip) / np.linalg.norm(top - hip)
        at = top + 0.12 * h * up
        pieces = [self._rod(hip + 0.03 * up, top, 0.078 * h, 0.088 * h), self._rod(top, at, 0.034 * h, 0.031 * h)]
        pieces.append(head.moved(offset=(at[0] + 0.02, 0.0, at[2])))
        for side in _SIDES.values():
            shoulder, grip = top + np.array([0.0, 0.1 * h * side, 0.0]), np.array([0.43, 0.25 * side, 1.0])
            elbow = 0.5 * (shoulder + grip) + [0.0, 0.05 * side, -0.06]
            pieces += [self._rod(shoulder, elbow, 0.028 * h, 0.024 * h), self._rod(elbow, grip, 0.024 * h, 0.02 * h)]
        return pieces

    def _crank(self) -> Mesh:
        """Return both cranks with the axles of their pedals, the right one up."""
        made = Assembly()
        for side in (-1.0, 1.0):
            root, end = np.array([0.0, 0.055 * side, 0.0]), np.array([0.0, 0.055 * side, -CRANK * side])
            made.add("body", "metal", self._rod(root, end, 0.012, 0.010))
            made.add("body", "metal", self._rod(end, end + np.array([0.0, 0.09 * side, 0.0]), 0.015, 0.015))
        return made.mesh()

    def _wheel(self) -> Mesh:
        """Return a wheel about the y axis: tyre, rim, hub and spokes."""
        made = Assembly()
        made.add("tyre", "rubber", _torus(WHEEL - TYRE, TYRE, self.max_sag))
        made.add("rim", "metal", _torus(WHEEL - 2.0 * TYRE - 0.008, 0.010, self.max_sag))
        spokes = [self._rod([0.0, -0.045, 0.0], [0.0, 0.045, 0.0], 0.018, 0.018)]
        for k in range(_SPOKES):
            out = np.array([np.cos(2.0 * np.pi * k / _SPOKES), 0.0, np.sin(2.0 * np.pi * k / _SPOKES)])
            hub = 0.016 * out + [0.0, 0.035 * (-1.0) ** k, 0.0]
            spokes.append(self._rod(hub, (WHEEL - 2.0 * TYRE - 0.016) * out, 0.001, 0.001))
        made.add("spokes", "metal", *spokes)
        return made.mesh()


def _torus(around: float, thick: float, sag: float) -> Piece:
    """Return a ring of radius `around` about the y axis, itself of radius `thick` [m]."""
    u = np.linspace(0.0, 2.0 * np.pi, 4 * int(np.ceil(steps(around + thick, 2.0 * np.pi, sag) / 4.0)) + 1)[:, None]
    v = np.linspace(0.0, 2.0 * np.pi, max(8, steps(thick, 2.0 * np.pi, sag)) + 1)[None]
    u[-1], v[0, -1] = 0.0, 0.0
    normals = np.stack([np.cos(u) * np.cos(v), np.sin(v) + 0.0 * u, -np.sin(u) * np.cos(v)], axis=-1)
    spine = np.stack([np.cos(u) + 0.0 * v, 0.0 * (u + v), -np.sin(u) + 0.0 * v], axis=-1)
    return grid(around * spine + thick * normals, normals)
