"""A scene whose bodies stand a little aside from where they should: turned and shifted, as makers' tolerances allow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from raychan.poses import yaw_pitch_roll
from raychan.records import MIRROR
from raychan.world import checks
from raychan.world.body import Body
from raychan.world.limbs import LimbMotion
from raychan.world.motion import Motion, about
from raychan.world.scene import Scene
from raychan.world.surroundings import check_places

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Displacement:
    """A turn (3,) [rad] about the direction of a vector through the middle of the body, and a shift (3,) [m]; world
    axes."""

    turn: Floats
    shift: Floats


def movable(scene: Scene) -> tuple[str, ...]:
    """Return the names of the bodies that may be displaced: all but mirrors such as the ground; limbs go together."""
    return tuple(dict.fromkeys(_whole(b).name for b in scene.bodies if b.resolved_role != MIRROR))


def displaced(scene: Scene, by: Mapping[str, Displacement]) -> Scene:
    """Return the scene with bodies, by their names, turned and shifted at time 0; meshes and materials are shared.

    Their velocities and turn rates stay as they are. Raises: SceneError where the radar would be inside a body.
    """
    wholes: dict[str, Body] = {}
    bodies = []
    for body in scene.bodies:
        name = _whole(body).name
        if name not in by:
            bodies.append(body)
        elif isinstance(body.motion, LimbMotion):
            bodies.append(_limb(body, body.motion, by[name], wholes))
        else:
            bodies.append(_placed(body, _moved(body.motion, _middle(body), by[name])))
    there = copy(scene)
    there.__dict__.update(bodies=tuple(bodies), _data=None, text="")  # no file says where they stand now
    there.__dict__.pop("warnings", None)
    checks.radar_outside(there.bodies, there.radar_table)
    check_places(there.interferers, there.bodies, there.radar_table)
    return there


def _whole(body: Body) -> Body:
    """Return the body that a limb belongs to, of others the body itself."""
    motion = body.motion
    return motion.whole if isinstance(motion, LimbMotion) and motion.whole is not None else body


def _middle(body: Body) -> Floats:
    return np.asarray(body.motion.to_world(body.geometry.bounds.mean(axis=0)))


def _moved(motion: Motion, middle: Floats, by: Displacement) -> Motion:
    turn = about(by.turn)
    x, y, z = map(float, middle + turn @ (motion.origin() - middle) + by.shift)
    yaw, pitch, roll = yaw_pitch_roll(turn @ motion.rotation())
    return replace(motion, position=(x, y, z), yaw=yaw, pitch=pitch, roll=roll)


def _placed(body: Body, motion: Motion) -> Body:
    """Return the body with a motion; its mesh is shared."""
    place: Sequence[float] = motion.position
    yaw, pitch, roll = (float(np.degrees(a)) for a in (motion.yaw, motion.pitch, motion.roll))
    made = replace(body, position=place, yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
    made.__dict__.update(geometry=body.geometry, motion=motion)
    return made


def _limb(body: Body, motion: LimbMotion, by: Displacement, wholes: dict[str, Body]) -> Body:
    """Return a limb of a displaced body, which turns about its origin; `wholes` holds the bodies displaced already."""
    assert motion.whole is not None and motion.skeleton is not None
    carrier = _moved(motion.carrier, motion.carrier.origin(), by)
    name = motion.whole.name
    if name not in wholes:
        still = _moved(motion.whole.motion, motion.whole.motion.origin(), by)
        yaw, pitch, roll = (float(np.degrees(a)) for a in (still.yaw, still.pitch, still.roll))
        wholes[name] = replace(motion.whole, position=still.position, yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
    return _placed(body, LimbMotion.of(wholes[name], carrier, motion.skeleton, motion.limb, motion.start))
