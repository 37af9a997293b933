"""Whether what a function is given as a scene is one."""

from __future__ import annotations

from raychan.world.errors import SceneError, shown
from raychan.world.scene import Scene


def check_scene(scene: object) -> None:
    """Raise SceneError unless it is a Scene; the name of a scene or of a file is none."""
    if not isinstance(scene, Scene):
        allowed = f"a Scene, as Scene.load({shown(scene)})" if isinstance(scene, str) else "a Scene, as Scene.load(...)"
        raise SceneError(f"{shown(scene)} is not possible", key="scene", value=scene, allowed=allowed)
