"""The instant at which a frame that is traced once is traced: its middle, of which levels, rates and directions are."""

from __future__ import annotations

from typing import Any

from raychan.run.rules import fine_rule
from raychan.run.turning import moves_as_one, needed
from raychan.world.errors import SceneError
from raychan.world.scene import Scene


def traced_at(scene: Scene, model: Any) -> tuple[Scene, float, tuple[str, ...]]:
    """Return a scene as it stands when it is traced, the time [s] of that from the frame's start, and what a user
    should know of it.

    Where nothing moves relative to the radar, or several tracings follow, that is the start.
    """
    time = scene.radar.waveform.centre
    edge = fine_rule(scene.radar, scene.processing, model).refinement.max_edge
    if time <= 0.0 or (moves_as_one(scene) and not scene.interferers) or needed(scene, model.retrace, edge):
        return scene, 0.0, ()
    try:
        then = scene.at(time)
    except SceneError as problem:
        return scene, 0.0, (f"levels, rates and directions are those of the frame's start: by its middle {problem}",)
    # The same scene stands alike at each run of it.
    then._derived = scene._derived.setdefault(("at", time), {})
    return then, time, ()
