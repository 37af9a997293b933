"""Threads: one loop over rows of arrays on all of them, or two functions at once.

As many threads run as were asked for: by `--threads` or `set_threads`, else by the environment variable
RAYCHAN_THREADS, else one for each core. What a row comes to must not depend on the rows beside it: the slices depend
on how many threads are free.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from itertools import count
from typing import Any, TypeVar

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


class _ThreadState(threading.local):
    """State of a thread: the event that it is told to stop."""

    stop: threading.Event | None = None


class _Crew:
    """Threads that help: a loop or a second function takes those that are free and gives them back."""

    def __init__(self) -> None:
        self._lock, self._asked, self._out = threading.Lock(), 0, 0
        self._pool: ThreadPoolExecutor | None = None

    def size(self) -> int:
        """Return how many threads work at most, the first one among them."""
        if not self._asked:
            self._asked = _from_environment()
        return self._asked

    def resize(self, threads: int) -> None:
        """Set how many threads work from now on."""
        self._asked, self._pool = threads, None

    def take(self, most: int) -> int:
        """Return how many threads, up to `most`, now help the caller."""
        with self._lock:
            got = max(min(most, self.size() - 1 - self._out), 0)
            self._out += got
            return got

    def give_back(self, threads: int) -> None:
        """Let threads help others again."""
        with self._lock:
            self._out -= threads

    def pool(self) -> ThreadPoolExecutor:
        """Return the threads themselves."""
        with self._lock:
            if self._pool is None:
                self._pool = ThreadPoolExecutor(max(self.size() - 1, 1), "raychan-rows")
            return self._pool


_own = _ThreadState()
_crew = _Crew()


def _start_anew() -> None:
    """Forget threads: a forked child has none of its parent's."""
    global _crew
    asked = _crew._asked
    _crew = _Crew()
    _crew._asked = asked


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_start_anew)


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


def parallel_for(n: int, work: Callable[[slice], None], least: int = 2000) -> None:
    """Call `work` with slices that cover rows 0 to n, on all threads that are free: none of them has less than half of
    `least` rows.

    Each thread takes the next slice as soon as it is done with one. The work must release the interpreter's lock.
    Raises: what the work raises, once all threads have ended.
    """
    if _own.stop is not None and _own.stop.is_set():
        raise Stopped
    most = 2 * n // max(least, 1)
    helpers = _crew.take(most - 1) if n >= least else 0
    if not helpers:
        work(slice(0, n))
        return
    slices = min(most, _SLICES * (helpers + 1))
    turns, failed = count(), threading.Event()

    def shift() -> None:
        while not failed.is_set() and (i := next(turns)) < slices:
            try:
                work(slice(i * n // slices, (i + 1) * n // slices))
            except BaseException:
                failed.set()
                raise

    try:
        pool = _crew.pool()
        others = [pool.submit(shift) for _ in range(helpers)]
        try:
            shift()
        finally:
            # One that has not begun is not waited for: its slices are done.
            rest = [other for other in others if not other.cancel()]
            first = [error for other in rest if (error := other.exception()) is not None]
    finally:
        _crew.give_back(helpers)
    if first:
        raise first[0]


def was_interrupted(failure: BaseException | None) -> bool:
    """Tell whether an error of compiled code is a Ctrl-C: one that arrives while it waits for the interpreter becomes a
    SystemError, since the code returns a result all the same."""
    if not isinstance(failure, SystemError):
        return False
    while failure is not None and not isinstance(failure, KeyboardInterrupt):
        failure = failure.__cause__ or failure.__context__
    return failure is not None


def run_pair(here: Callable[[], A], there: Callable[[], B]) -> tuple[A, B]:
    """Return what two functions return, `here` called by this thread and `there` by another, if one is free, else one
    after the other.

    If `here` fails or is interrupted, `there` is stopped at its next `parallel_for`. Raises: what they raise, `here`
    first.
    """
    if not _crew.take(1):
        return here(), there()
    stop, given_back = threading.Event(), threading.Lock()
    found: list[B] = []
    failed: list[BaseException] = []

    def one_ended() -> None:
        # Whichever ends first leaves its thread to the other.
        if given_back.acquire(blocking=False):
            _crew.give_back(1)

    def second() -> None:
        _own.stop = stop
        try:
            found.append(there())
        except BaseException as error:
            failed.append(error)
        finally:
            one_ended()

    # Not a thread of a pool: one that an interruption leaves behind must not keep the process from ending.
    other = threading.Thread(target=second, name="raychan-beside", daemon=True)
    try:
        other.start()
        first = here()
        one_ended()
        other.join()
    except BaseException as failure:
        stop.set()
        one_ended()
        if other.is_alive():
            other.join()
        if was_interrupted(failure):
            raise KeyboardInterrupt from failure
        raise
    if failed:
        raise failed[0]
    return first, found[0]
