"""The instant at which a frame is traced: its middle, of which levels, rates and directions are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raychan.run.rules import fine_rule
from raychan.run.turning import (
    carried_over,
    check_often,
    fluctuating,
    middle_chirp,
    moves_as_one,
    needed,
    passing_phases,
    unfollowed,
)
from raychan.world.errors import SceneError
from raychan.world.scene import Scene
from raychan.world.scene_files.schema import PREVIEW


@dataclass(frozen=True)
class Instant:
    """A scene at the start of a frame, and as it stands when its paths are traced."""

    start: Scene
    scene: Scene
    time: float
    """[s] from the frame's start; 0 where nothing moves relative to the radar."""
    often: bool
    """Whether the frame takes several tracings, of which this is the one of the middle."""
    notes: tuple[str, ...] = ()
    """What a user should know of it."""
    carried: NDArray[np.bool_] | None = None
    """Which bodies (b,) are carried on from its one tracing, where some are."""


def traced_at(scene: Scene, model: Any) -> Instant:
    """Return a scene as it stands when it is traced.

    Raises: SceneError where a frame takes several tracings and its radar or bodies allow one only.
    """
    edge, wave = fine_rule(scene.radar, scene.processing, model).refinement.max_edge, scene.radar.waveform
    often = model.mode != PREVIEW and needed(scene, model.retrace, edge)
    if often:
        check_often(scene, model.retrace)
    once = not often and model.mode != PREVIEW
    bent = passing_phases(scene) if once else np.zeros(len(scene.bodies))
    carried = carried_over(scene, model.retrace, bent)
    told = model.retrace != 1 and wave.n_chirps > 2
    # Routes are carried on from the start of a ramp.
    time = wave.start_of(middle_chirp(wave.n_chirps)) if often or carried.any() else wave.centre
    if time <= 0.0 or (moves_as_one(scene) and not scene.interferers):
        return Instant(scene, scene, 0.0, often)
    try:
        then = scene.at(time)
    except SceneError as problem:
        if often:
            raise
        late = f"levels, rates and directions are those of the frame's start: by its middle {problem}"
        left = unfollowed(scene, bent, None, "levels of its start") if told else ()
        return Instant(scene, scene, 0.0, often, (late, *left))
    # The same scene stands alike at each run of it.
    then._derived = scene._derived.setdefault(("at", time), {})
    notes = _uneven(scene) if often else ()
    if told:
        notes += unfollowed(scene, bent, carried)
    return Instant(scene, then, time, often, notes, carried if carried.any() else None)


def _uneven(scene: Scene) -> tuple[str, ...]:
    """Return a line if targets fluctuate that should be carried on between tracings."""
    if not (names := fluctuating(scene)):
        return ()
    return (
        f"{', '.join(names)}: what fluctuates and passes while others turn has constant rates from one tracing to the "
        "next, so levels are off, and echoes beside it may be none (model.retrace = 1 traces the frame once)",
    )
