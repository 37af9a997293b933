"""raychan: a ray-traced radar channel simulator on Embree.

The public names below are loaded when first used, so that `import raychan` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Scene": "raychan.world.scene",
    "Body": "raychan.world.scene",
    "SceneError": "raychan.world.scene",
    "Material": "raychan.world.material",
    "PEC": "raychan.world.material",
    "simulate": "raychan.run.chain",
    "Result": "raychan.run.result",
    "explain": "raychan.run.provenance",
    "load_result": "raychan.run.store",
    "rcs": "raychan.channel.rcs",
    "specular_paths": "raychan.channel.specular",
}

__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("raychan")
    if name not in _HOME:
        raise AttributeError(f"module 'raychan' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
