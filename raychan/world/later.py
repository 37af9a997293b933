"""Where motion has led the bodies, the radar and the interferers of a scene at a later time: places that may be."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from raychan.scalars import plain
from raychan.world import checks
from raychan.world.body import Body
from raychan.world.errors import SceneError, shown
from raychan.world.limits import LATER, PLACE
from raychan.world.scene_files.schema import RadarTable
from raychan.world.surroundings import check_places

if TYPE_CHECKING:
    from raychan.radar.interferer import Interferer
    from raychan.radar.radar import Radar


def check_time(time: Any) -> float:
    """Return a time [s] as Python's number. Raises: SceneError unless it is a number within its limits."""
    if LATER.problem(time):
        raise SceneError(f"{shown(time)} is not possible", key="time", value=time, allowed=f"a number {LATER.allowed}")
    return plain(time)  # type: ignore[no-any-return]


def table_at(table: RadarTable, radar: Radar) -> RadarTable:
    """Return a radar's table with transmitter and receivers where the radar has them."""
    ends = {"position": radar.position, "rx_position": radar.rx_position}
    return table.model_copy(update={key: None if x is None else x.tolist() for key, x in ends.items()})


def check_later(
    bodies: Iterable[Body], radar: RadarTable | None, interferers: Iterable[Interferer], time: float, file: Any
) -> None:
    """Raise SceneError where motion has led one beyond the places that a scene may have, or a radar into a body.

    Args: bodies, radar and interferers as they stand at that time [s]; file of the scene.
    """
    bodies, interferers = tuple(bodies), tuple(interferers)
    for key, place in _places(bodies, radar, interferers):
        if not all(map(PLACE.allows, place)):
            at = ", ".join(f"{x:g}" for x in place)
            problem = f"motion leads to [{at}] m {time:g} s on"
            raise SceneError(problem, file=file, key=key, value=place, allowed=f"each {PLACE.allowed}")
    try:
        checks.radar_outside(bodies, radar)
        check_places(interferers, bodies, radar)
    except SceneError as e:
        late = f"{e.problem} {time:g} s on"
        raise SceneError(late, file=file, key=e.key, value=e.value, allowed=e.allowed) from None


def _places(
    bodies: Iterable[Body], radar: RadarTable | None, interferers: Iterable[Interferer]
) -> Iterator[tuple[str, list[float]]]:
    """Yield what moves, by the key of its place, and where it is [m]."""
    for body in bodies:
        whole, _, _ = body.name.partition(".")  # limbs are 'NAME.LIMB'
        yield f"bodies.{whole}.position", list(body.motion.position)
    for key in ("position", "rx_position"):
        place = getattr(radar, key, None)
        if place is not None:
            yield f"radar.{key}", place
    for one in interferers:
        yield f"interferers.{one.name}.position", np.asarray(one.radar.position).tolist()
