"""Threads: one loop over rows of arrays on all of them, or two functions at once.

As many threads run as were asked for: by `--threads` or `set_threads`, else by the environment variable
RAYCHAN_THREADS, else one for each core. What a row comes to must not depend on the rows beside it: the slices depend
on how many threads are free.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, TypeVar

from raychan.crew import Crew, Loop, own

A = TypeVar("A")
B = TypeVar("B")

VARIABLE = "RAYCHAN_THREADS"
MOST = 1000
_SLICES = 4  # for each thread: more share uneven rows better, fewer call the interpreter less often; not measured


class cached(cached_property):  # type: ignore[type-arg]
    """A property of an object computed once, by one thread: the object's lock `making` is held meanwhile."""

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        if instance is None:
            return self
        with instance.making:
            return super().__get__(instance, owner)


class Stopped(Exception):
    """Raised in the second of two functions when the first has failed or was interrupted."""


def threads() -> int:
    """Return how many threads work at most. Raises: ValueError if RAYCHAN_THREADS is not a number of threads."""
    return _crew.size()


def set_threads(number: int | None) -> None:
    """Set how many threads work at most; None: as RAYCHAN_THREADS says, else one for each core.

    Raises: ValueError for less than 1 or more than 1000.
    """
    if number is not None and not 1 <= number <= MOST:
        raise ValueError(f"threads is {number}; it must be between 1 and {MOST}")
    _crew.resize(number or 0)


def _from_environment() -> int:
    """Return how many threads the environment asks for, else the number of cores that this process may use."""
    text = os.environ.get(VARIABLE, "").strip()
    if not text:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isdecimal() or not 1 <= int(text) <= MOST:
        raise ValueError(f"{VARIABLE} is '{text}'; it must be a whole number between 1 and {MOST}")
    return int(text)


_crew = Crew(_from_environment)


def _start_anew() -> None:
    """Forget threads: a forked child has none of its parent's."""
    global _crew
    _crew = _crew.anew()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_start_anew)


def parallel_for(n: int, work: Callable[[slice], None], least: int = 2000) -> None:
    """Call `work` with slices that cover rows 0 to n, on all threads that are free: none of them has less than half of
    `least` rows.

    Each thread takes the next slice as soon as it is done with one. The work must release the interpreter's lock.
    Raises: what the work raises, once all threads have ended.
    """
    _stop_if_told()
    most = 2 * n // max(least, 1)
    helpers = min(most - 1, _crew.free()) if n >= least else 0
    if helpers < 1:
        work(slice(0, n))
        return
    slices = min(most, _SLICES * (helpers + 1))
    _crew.share(Loop(slices, lambda i: work(slice(i * n // slices, (i + 1) * n // slices)), helpers))


def parallel_tasks(n: int, task: Callable[[int], None]) -> None:
    """Call `task` with 0 to n - 1, on all threads: also on those that become free while it runs.

    Raises: what a task raises, once all threads have ended.
    """
    _stop_if_told()
    if n < 2 or _crew.size() < 2:
        for i in range(n):
            task(i)
    else:
        _crew.share(Loop(n, task, n - 1))


def parallel_map(work: Callable[..., A], *items: Sequence[Any]) -> list[A]:
    """Return what `work` makes of each of the items, in order, made by all threads as in `parallel_tasks`."""
    found: dict[int, A] = {}

    def one(i: int) -> None:
        found[i] = work(*(x[i] for x in items))

    count = min(map(len, items))
    parallel_tasks(count, one)
    return [found[i] for i in range(count)]


def _stop_if_told() -> None:
    if own.stop is not None and own.stop.is_set():
        raise Stopped


def was_interrupted(failure: BaseException | None) -> bool:
    """Tell whether an error of compiled code is a Ctrl-C: one that arrives while it waits for the interpreter becomes a
    SystemError, since the code returns a result all the same."""
    if not isinstance(failure, SystemError):
        return False
    while failure is not None and not isinstance(failure, KeyboardInterrupt):
        failure = failure.__cause__ or failure.__context__
    return failure is not None


def run_pair(here: Callable[[], A], there: Callable[[], B]) -> tuple[A, B]:
    """Return what two functions return, `here` called by this thread and `there` by another, if one becomes free, else
    one after the other.

    If `here` fails or is interrupted, `there` is stopped at its next loop. Raises: what they raise, `here` first.
    """
    if _crew.size() < 2:
        return here(), there()
    stop, found = threading.Event(), list[B]()

    def second(_: int) -> None:
        outer, own.stop = own.stop, stop
        try:
            found.append(there())
        finally:
            own.stop = outer

    other = Loop(1, second, 1)
    _crew.offer(other)
    try:
        first = here()
    except BaseException as failure:
        stop.set()
        _crew.finish(other)
        if was_interrupted(failure):
            raise KeyboardInterrupt from failure
        raise
    try:
        other.work()
    finally:
        _crew.finish(other)
    if other.error is not None:
        raise other.error
    return first, found[0]
