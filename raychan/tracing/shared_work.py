"""Work that is shared by threads: several parts of one launch at once."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import TypeVar

from raychan.parallel import parallel_for
from raychan.world.geometry import Geometry

T = TypeVar("T")


def all_of(geometry: Geometry, tasks: Sequence[Callable[[], T]]) -> list[T]:
    """Return what tasks return, in order, done by all threads that are free; their rays count for the calling thread.

    No task may depend on another.
    """
    found: dict[int, T] = {}
    caller, elsewhere = threading.get_ident(), []

    def some(rows: slice) -> None:
        before = geometry.rays
        for i in range(len(tasks))[rows]:
            found[i] = tasks[i]()
        if threading.get_ident() != caller:
            elsewhere.append(geometry.rays - before)

    parallel_for(len(tasks), some, least=2)
    geometry.count_rays(sum(elsewhere))
    return [found[i] for i in range(len(tasks))]
