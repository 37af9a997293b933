"""Bodies that move in themselves, as walkers and cyclists do: rigid limbs, each a body with a motion of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from raychan.poses import yaw_pitch_roll
from raychan.records import Role
from raychan.world.errors import SceneError
from raychan.world.meshes.mesh import Floats
from raychan.world.motion import Motion
from raychan.world.shapes.skeleton import Skeleton

if TYPE_CHECKING:
    from raychan.world.body import Body

_STEP = 1e-5  # s, of a difference quotient: off by 1e-7 m/s for limbs, whose jerk is under 1e3 m/s^3


@dataclass(frozen=True)
class LimbMotion(Motion):
    """The motion of a limb: pose and velocity at time 0 in the fields of Motion, any other time by the skeleton.

    Args: carrier the motion of the whole body; skeleton; limb its name; start [s] time 0 here on the carrier's clock.
    """

    carrier: Motion = Motion()
    skeleton: Skeleton | None = None
    limb: str = ""
    start: float = 0.0
    whole: Body | None = None
    """The body at the carrier's time 0."""

    @classmethod
    def of(cls, whole: Body, carrier: Motion, skeleton: Skeleton, limb: str, start: float = 0.0) -> LimbMotion:
        """Return the motion of a limb of a body counted from a time [s]."""
        bare = cls(carrier=carrier, skeleton=skeleton, limb=limb, start=start, whole=whole)
        turns, origins = bare.poses(np.zeros(1))
        yaw, pitch, roll = yaw_pitch_roll(turns[0])
        x, y, z = map(float, origins[0])
        u, v, w = map(float, bare.velocity_of_origin())
        return replace(bare, position=(x, y, z), yaw=yaw, pitch=pitch, roll=roll, velocity=(u, v, w))

    @property
    def moves(self) -> bool:
        """A limb does."""
        return True

    @property
    def turns(self) -> bool:
        """A limb does."""
        return True

    def poses(self, times: Floats) -> tuple[Floats, Floats]:
        """Return rotations (t, 3, 3) to world axes and origins (t, 3) [m] at times (t,) [s]."""
        assert self.skeleton is not None
        late = np.asarray(times, float) + self.start
        turns, origins = self.skeleton.poses(self.limb, late)
        axes = self.carrier.rotation()
        place = np.asarray(self.carrier.position) + late[:, None] * np.asarray(self.carrier.velocity)
        return axes @ turns, origins @ axes.T + place

    def origin(self, time: float = 0.0) -> Floats:
        """Return the limb's origin (3,) [m] at a time [s]."""
        return self.poses(np.array([time]))[1][0]

    def rotation(self, time: float = 0.0) -> Floats:
        """Return the matrix (3, 3) from the limb's to world axes at a time [s]."""
        return self.poses(np.array([time]))[0][0]

    def velocity_of_origin(self, time: float = 0.0) -> Floats:
        """Return the velocity (3,) [m/s] of the limb's origin at a time [s]."""
        before, after = self.poses(time + _STEP * np.array([-0.5, 0.5]))[1]
        return np.asarray((after - before) / _STEP)

    def spin(self, time: float = 0.0) -> Floats:
        """Return the turn-rate vector (3,) [rad/s], world axes, at a time [s]."""
        before, after = self.poses(time + _STEP * np.array([-0.5, 0.5]))[0]
        rate = (after - before) / _STEP @ (0.5 * (before + after)).T
        return np.array([rate[2, 1] - rate[1, 2], rate[0, 2] - rate[2, 0], rate[1, 0] - rate[0, 1]]) / 2.0

    def swerve(self, time: float) -> float:
        """Return how far [m] the origin is from even motion a time [s] before or after now."""
        before, now, after = self.poses(time * np.array([-1.0, 0.0, 1.0]))[1]
        return float(np.linalg.norm(before - 2.0 * now + after)) / 2.0

    def at(self, time: float) -> LimbMotion:
        """Return the same motion counted from a time [s]."""
        assert self.whole is not None and self.skeleton is not None
        return LimbMotion.of(self.whole, self.carrier, self.skeleton, self.limb, self.start + time)


def limbs_of(body: Body, skeleton: Skeleton) -> tuple[Body, ...]:
    """Return the limbs of a body as bodies 'NAME.LIMB'; they go along its +x at the skeleton's speed.

    Raises: SceneError where the body has a motion, a role or an RCS of its own.
    """
    given = {
        "velocity_mps": any(body.velocity),
        "turn_rate_dps": bool(body.turn_rate_dps),
        "spin_dps": any(body.spin_dps),
        "rcs_dbsm": body.rcs_dbsm is not None,
        "role": body.role is not None and body.role != Role.SCATTERER.name.lower(),
    }
    for key, wrong in given.items():
        if wrong:
            allowed = "left out: it goes along yaw_deg by params.speed, and its limbs scatter"
            raise SceneError(f"a {body.shape} moves and scatters by itself", key=f"{body.name}.{key}", allowed=allowed)
    still = body.motion
    u, v, w = map(float, skeleton.speed * still.rotation()[:, 0])
    carrier = replace(still, velocity=(u, v, w))
    made = []
    for limb, mesh in skeleton.meshes().items():
        motion = LimbMotion.of(body, carrier, skeleton, limb)
        yaw, pitch, roll = (float(np.degrees(a)) for a in (motion.yaw, motion.pitch, motion.roll))
        one = replace(
            body, name=f"{body.name}.{limb}", position=motion.position, yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll,
            velocity=motion.velocity,
        )  # fmt: skip
        one.__dict__.update(geometry=mesh, motion=motion)
        made.append(one)
    return tuple(made)


def alike(one: Body, other: Body) -> bool:
    """Return whether two bodies are limbs of one."""
    first, second = one.motion, other.motion
    return isinstance(first, LimbMotion) and isinstance(second, LimbMotion) and first.whole is second.whole


def wholes(bodies: Sequence[Body]) -> Iterator[Body]:
    """Yield bodies with limbs put together again, as they stand at their time 0."""
    seen: set[str] = set()
    for body in bodies:
        motion = body.motion
        if not isinstance(motion, LimbMotion):
            yield body
            continue
        whole, skeleton = motion.whole, motion.skeleton
        assert whole is not None and skeleton is not None
        if whole.name not in seen:
            seen.add(whole.name)
            if motion.start == 0.0:
                yield whole
            else:
                place = motion.carrier.origin(motion.start)
                yield replace(whole, position=tuple(map(float, place)), params=skeleton.later(motion.start))
