"""Rows: work on many rows of arrays over two threads that are kept between calls, and two works at once."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, lru_cache
from typing import Any, TypeVar

A = TypeVar("A")
B = TypeVar("B")


class cached(cached_property):  # type: ignore[type-arg]
    """A property of an object made once, by one thread: the object's lock `making` is held meanwhile."""

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        if instance is None:
            return self
        with instance.making:
            return super().__get__(instance, owner)


class Stopped(Exception):
    """Raised in the second of two works when the first has failed or was interrupted."""


class _Own(threading.local):
    """What a thread knows: whether another is at work beside it, and whether it was told to stop."""

    beside: threading.Event | None = None
    stop: threading.Event | None = None


_own = _Own()


@lru_cache(maxsize=1)
def _helper() -> ThreadPoolExecutor:
    # A forked child has no threads of its parent's: it makes its own.
    os.register_at_fork(after_in_child=_helper.cache_clear)
    return ThreadPoolExecutor(1, "raychan-rows")


def parallel_for(n: int, work: Callable[[slice], None], least: int = 2000) -> None:
    """Do the work on rows 0 to n, on this thread and another when there are many: it must release the interpreter's
    lock, and may not call this again. Beside another work (`run_pair`) this thread does it alone."""
    if _own.stop is not None and _own.stop.is_set():
        raise Stopped
    if n < least or (_own.beside is not None and not _own.beside.is_set()):
        work(slice(0, n))
        return
    other = _helper().submit(work, slice(n // 2, n))
    try:
        work(slice(0, n // 2))
    finally:
        other.result()


def was_interrupted(failure: BaseException | None) -> bool:
    """Tell whether a fault of compiled code is a Ctrl-C: one that reaches it while it waits for the interpreter becomes
    a SystemError, since it gives back a result all the same."""
    if not isinstance(failure, SystemError):
        return False
    while failure is not None and not isinstance(failure, KeyboardInterrupt):
        failure = failure.__cause__ or failure.__context__
    return failure is not None


def run_pair(here: Callable[[], A], there: Callable[[], B]) -> tuple[A, B]:
    """Return what two works return, one done by this thread and one by another; neither may call this again.

    Where the first fails or is interrupted the other is stopped at its next rows. Raises: what they raise, the first's
    before the other's.
    """
    ended, stop = threading.Event(), threading.Event()
    found: list[B] = []
    failed: list[BaseException] = []

    def second() -> None:
        _own.beside, _own.stop = ended, stop
        try:
            found.append(there())
        except BaseException as error:
            failed.append(error)
        finally:
            ended.set()

    # No thread of a pool: one that an interruption leaves behind must not keep the process from ending.
    other = threading.Thread(target=second, name="raychan-beside", daemon=True)
    _own.beside = ended
    try:
        other.start()
        first = here()
        ended.set()
        other.join()
    except BaseException as failure:
        stop.set()
        ended.set()
        if other.is_alive():
            other.join()
        if was_interrupted(failure):
            raise KeyboardInterrupt from failure
        raise
    finally:
        _own.beside = None
    if failed:
        raise failed[0]
    return first, found[0]
