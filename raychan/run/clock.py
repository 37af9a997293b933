"""Seconds and progress by stage of a run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from raychan.radar.declared import check_type

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done, 0 to 1."""

STAGES = ("geometry", "check", "trace", "synthesize", "detect", "explain")


class Clock:
    """Seconds by stage; tells the progress of each."""

    def __init__(self, progress: Progress | None = None) -> None:
        check_type("progress", progress, Callable, or_none=True)  # type: ignore[arg-type]
        self.tell = progress or (lambda stage, share: None)
        self.timings: dict[str, float] = {}
        self.begun = time.perf_counter()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage."""
        self.tell(name, 0.0)
        start = time.perf_counter()
        yield
        self.timings[name] = time.perf_counter() - start
        self.tell(name, 1.0)
