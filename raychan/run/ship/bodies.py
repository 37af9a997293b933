"""The bodies around a ship as its scanner casts at them, those that move where they are at each beam's own time."""

from __future__ import annotations

import numpy as np

from raychan.sensors.laser import MovingBodies
from raychan.world.body import Body
from raychan.world.ray_caster import RayCaster
from raychan.world.scene import Scene


class ShipBodies:
    """The bodies of a scene in groups of one velocity, each with a ray caster.

    Bodies that do not turn keep their caster: only their place moves. Those that turn, and the limbs of walkers, are
    posed anew at the start of each scan and move on evenly within it.
    Args: scene of the bodies; moving whether the beams of a scan leave at times of their own.
    """

    def __init__(self, scene: Scene, moving: bool) -> None:
        bodies = scene.bodies
        self._still: RayCaster | None = None
        self._even: list[MovingBodies] = []
        self._turning: list[tuple[Scene, list[int]]] = []
        if not any(body.moves for body in bodies):
            self._still = RayCaster(scene.facets(), scene.static_geometry) if bodies else None
            return
        even: dict[tuple[float, ...], list[int]] = {}
        turning: list[list[int]] = []
        for k, body in enumerate(bodies):
            if not body.motion.turns:
                even.setdefault(tuple(body.motion.velocity), []).append(k)
            elif moving or not turning:
                turning.append([k])
            else:
                turning[0].append(k)  # at the start of a scan alone, velocities do not count
        for velocity, numbers in even.items():
            part = _part(scene, [bodies[k] for k in numbers])
            caster = RayCaster(part.facets(), part.static_geometry)
            self._even.append(MovingBodies(caster, np.array(velocity), np.array(numbers, np.int32)))
        self._turning = [(_part(scene, [bodies[k] for k in numbers]), numbers) for numbers in turning]

    def at(self, time: float) -> RayCaster | tuple[MovingBodies, ...] | None:
        """Return what a scan that starts at a time [s] casts at; None without bodies."""
        if self._still is not None or not (self._even or self._turning):
            return self._still
        found = [group.later(time) for group in self._even]
        for scene, numbers in self._turning:
            part = scene.at(time)
            velocity = np.array(part.bodies[0].motion.velocity)
            caster = RayCaster(part.facets(), part.static_geometry)
            found.append(MovingBodies(caster, velocity, np.array(numbers, np.int32)))
        return tuple(found)


def _part(scene: Scene, bodies: list[Body]) -> Scene:
    return Scene(bodies=bodies, path=scene.path, folder=scene.folder)
