"""Bare Embree: the rays that a computation cast, cast again with nothing around them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import embreex.mesh_construction
import embreex.rtcore_scene
import numpy as np

_CHUNK = 1 << 16
Cast = tuple[Any, np.ndarray, np.ndarray]


@contextmanager
def recorded() -> Iterator[list[Cast]]:
    """Give the list to which every cast inside the block goes: scene, origins and directions (n, 3) float32."""
    casts: list[Cast] = []
    real = embreex.rtcore_scene.EmbreeScene

    class Recorder(real):  # type: ignore[misc,valid-type]
        """An Embree scene that remembers its rays."""

        def run(self, origins: Any, directions: Any, *more: Any, **options: Any) -> Any:
            casts.append((self, np.array(origins), np.array(directions)))
            return real.run(self, origins, directions, *more, **options)

    embreex.rtcore_scene.EmbreeScene = Recorder
    try:
        yield casts
    finally:
        embreex.rtcore_scene.EmbreeScene = real


def replay(casts: list[Cast]) -> tuple[Callable[[], None], int]:
    """Return a call that casts recorded rays again, all that meet one scene together, on both cores; and their number.

    This is the least that a computation which casts them could take.
    """
    scenes = {id(scene): scene for scene, _, _ in casts}
    jobs = []
    for key, scene in scenes.items():
        mine = [(o, d) for s, o, d in casts if id(s) == key]
        origins, directions = (np.ascontiguousarray(np.concatenate(x)) for x in zip(*mine, strict=True))
        starts = range(0, len(origins), _CHUNK)
        jobs += [(scene, origins[i : i + _CHUNK], directions[i : i + _CHUNK]) for i in starts]
    base = embreex.rtcore_scene.EmbreeScene

    def cast(job: Cast) -> None:
        base.run(job[0], job[1], job[2])

    def all_of_them() -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(cast, jobs))

    return all_of_them, sum(len(o) for _, o, _ in jobs)
