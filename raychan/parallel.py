"""Two threads: one loop over rows of arrays on both, or two functions at once."""

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
    """A property of an object computed once, by one thread: the object's lock `making` is held meanwhile."""

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        if instance is None:
            return self
        with instance.making:
            return super().__get__(instance, owner)


class Stopped(Exception):
    """Raised in the second of two functions when the first has failed or was interrupted."""


class _ThreadState(threading.local):
    """State of a thread: the event that the other of a pair has ended, and the event that it is told to stop."""

    beside: threading.Event | None = None
    stop: threading.Event | None = None


_own = _ThreadState()


@lru_cache(maxsize=1)
def _helper() -> ThreadPoolExecutor:
    # A forked child has none of its parent's threads: it starts its own.
    os.register_at_fork(after_in_child=_helper.cache_clear)
    return ThreadPoolExecutor(1, "raychan-rows")


def parallel_for(n: int, work: Callable[[slice], None], least: int = 2000) -> None:
    """Call `work` with slices that cover rows 0 to n: on two threads from `least` rows on, else on this one.

    The work must release the interpreter's lock, and must not call this again. Within `run_pair` one thread does it
    all.
    """
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
    """Tell whether an error of compiled code is a Ctrl-C: one that arrives while it waits for the interpreter becomes a
    SystemError, since the code returns a result all the same."""
    if not isinstance(failure, SystemError):
        return False
    while failure is not None and not isinstance(failure, KeyboardInterrupt):
        failure = failure.__cause__ or failure.__context__
    return failure is not None


def run_pair(here: Callable[[], A], there: Callable[[], B]) -> tuple[A, B]:
    """Return what two functions return, `here` called by this thread and `there` by another; neither may call this
    again.

    If `here` fails or is interrupted, `there` is stopped at its next `parallel_for`. Raises: what they raise, `here`
    first.
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

    # Not a thread of a pool: one that an interruption leaves behind must not keep the process from ending.
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
