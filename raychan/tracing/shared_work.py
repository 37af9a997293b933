"""Work that is shared by threads: several parts of one launch at once."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import TypeVar

from raychan.parallel import parallel_map
from raychan.world.geometry import Geometry

T = TypeVar("T")


def all_of(geometry: Geometry, tasks: Sequence[Callable[[], T]]) -> list[T]:
    """Return what tasks return, in order, done by all threads that are free; their rays count for the calling thread.

    No task may depend on another.
    """
    caller, elsewhere = threading.get_ident(), list[int]()

    def one(task: Callable[[], T]) -> T:
        before = geometry.rays
        made = task()
        if threading.get_ident() != caller:
            rays = geometry.rays - before
            elsewhere.append(rays)
            geometry.count_rays(-rays)  # they are the caller's
        return made

    found = parallel_map(one, tasks)
    geometry.count_rays(sum(elsewhere))
    return found
