"""Rows: the same work on many rows of arrays, over two threads that are kept between calls."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache


@lru_cache(maxsize=1)
def _helper() -> ThreadPoolExecutor:
    # A forked child has no threads of its parent's: it makes its own.
    os.register_at_fork(after_in_child=_helper.cache_clear)
    return ThreadPoolExecutor(1, "raychan-rows")


def in_two(n: int, work: Callable[[slice], None], least: int = 2000) -> None:
    """Do the work on rows 0 to n, on this thread and another when there are many: it must release the interpreter's
    lock, and may not call this again."""
    if n < least:
        work(slice(0, n))
        return
    other = _helper().submit(work, slice(n // 2, n))
    try:
        work(slice(0, n // 2))
    finally:
        other.result()
