"""What surrounds the bodies and the radar of a scene: the air, and other radars that transmit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from raychan.em.atmosphere import Atmosphere
from raychan.scalars import plain
from raychan.world.body import Body
from raychan.world.checks import NEAREST, outside
from raychan.world.errors import SceneError, shown
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.impairments import AtmosphereTable
from raychan.world.scene_files.radar_mount import radar_of
from raychan.world.scene_files.schema import InterfererTable, RadarTable

if TYPE_CHECKING:
    from raychan.radar.interferer import Interferer

_OF_ITS_OWN = {"name", "start_us", "locked"}


def atmosphere_of(given: Any, file: Path | None) -> Atmosphere | None:
    """Return the air of what a scene is given: an object, a table, or None; SceneError for values that cannot be."""
    if given is None:
        return None
    table = asdict(given) if isinstance(given, Atmosphere) else given
    return Atmosphere(**checked(AtmosphereTable, table, file, "atmosphere").model_dump())


def attenuation_of(air: Atmosphere | None, frequency: float, radar: RadarTable | None, file: Path | None) -> float:
    """Return by what a field falls along its path [1/m] at a frequency [Hz]; SceneError where that is not known.

    Rain is that of the radar's polarisation, of V without a radar.
    """
    if air is None:
        return 0.0
    try:
        return air.attenuation(frequency, "V" if radar is None else radar.polarization)
    except ValueError as e:
        raise SceneError(str(e), file=file, key="atmosphere", allowed="no [atmosphere] at this frequency") from None


def interferers_of(given: Any, folder: Path, file: Path | None) -> tuple[Interferer, ...]:
    """Return the interferers of objects or tables; SceneError for values that cannot be, or two of one name."""
    from raychan.radar.interferer import Interferer

    found: list[Interferer] = []
    if isinstance(given, str) or not isinstance(plain(given), Iterable):
        allowed = "a list of Interferer or their tables"
        raise SceneError(f"{shown(given)} is not possible", file=file, key="interferers", value=given, allowed=allowed)
    for one in given:
        if isinstance(one, InterfererTable | Mapping):
            one = _interferer(checked(InterfererTable, one, file, "interferers"), folder, file)
        if not isinstance(one, Interferer):
            wanted = "an Interferer or its table"
            raise SceneError(f"{shown(one)} is not possible", file=file, key="interferers", value=one, allowed=wanted)
        if any(one.name == other.name for other in found):
            raise SceneError("two interferers of one name", file=file, key="interferers.name", value=one.name)
        found.append(one)
    return tuple(found)


def _interferer(table: InterfererTable, folder: Path, file: Path | None) -> Interferer:
    from raychan.radar.interferer import Interferer
    from raychan.radar.processing import Processing

    shared = {name: getattr(table, name) for name in table.model_fields_set - _OF_ITS_OWN}
    try:
        radar = radar_of(RadarTable(**shared), Processing(), folder, file)
    except SceneError as e:
        key = f"interferers.{table.name}.{e.key.removeprefix('radar.')}"
        raise SceneError(e.problem, file=e.file, key=key, value=e.value, allowed=e.allowed) from None
    return Interferer(radar, 1e-6 * table.start_us, table.locked, table.name, table)


def check_places(interferers: Iterable[Interferer], bodies: Iterable[Body], radar: RadarTable | None) -> None:
    """Raise SceneError where an interferer is inside a body, on it, below a mirror, or at the radar's own place, or
    where there is no radar that it could disturb."""
    bodies = tuple(bodies)
    for one in interferers:
        key, at = f"interferers.{one.name}.position", one.radar.position
        if radar is None:
            raise SceneError("an interferer and no radar", key=f"interferers.{one.name}", allowed="a [radar] table")
        ends = (np.array(x) for x in (radar.position, radar.rx_position) if x is not None)
        if min(float(np.linalg.norm(at - end)) for end in ends) < NEAREST:
            raise SceneError(
                "an interferer at the radar's own place", key=key, value=at.tolist(), allowed="a place of its own"
            )
        outside(bodies, at, f"interferer '{one.name}'", key)
