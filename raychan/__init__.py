"""raychan: a ray-traced radar channel simulator on Embree.

The public names below are loaded when first used, so that `import raychan` costs nothing.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

_PLACES = (os.path.dirname(__file__), os.path.expanduser("~"))
if "NUMBA_CACHE_DIR" not in os.environ and not any(os.access(place, os.W_OK) for place in _PLACES):
    # Compiled loops are kept beside the package or in the home; where neither can be written, numba refuses to run.
    import atexit
    import shutil
    import tempfile

    os.environ["NUMBA_CACHE_DIR"] = _kept = tempfile.mkdtemp(prefix="raychan-")
    atexit.register(shutil.rmtree, _kept, ignore_errors=True)

_HOME = {
    "Scene": "raychan.world.scene",
    "Body": "raychan.world.scene",
    "SceneError": "raychan.world.scene",
    "Material": "raychan.world.material",
    "PEC": "raychan.world.material",
    "simulate": "raychan.run.simulate",
    "trace": "raychan.run.stages",
    "transfer": "raychan.run.stages",
    "synthesize": "raychan.run.stages",
    "range_doppler": "raychan.run.stages",
    "detect": "raychan.run.stages",
    "SceneRoutes": "raychan.run.stages",
    "Result": "raychan.run.result",
    "explain": "raychan.run.explain",
    "load_result": "raychan.run.storage",
    "rcs": "raychan.run.rcs",
    "specular_paths": "raychan.run.specular_paths",
    "visibility": "raychan.study.visibility",
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
