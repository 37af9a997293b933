"""The threads that help with loops: who takes which task, and who waits for whom."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable


class Loop:
    """Tasks 0 to `count` that threads take one after the other; `within` is the loop of whose tasks one began it."""

    def __init__(self, count: int, task: Callable[[int], None], welcome: int) -> None:
        self._count, self._task, self._turns = count, task, itertools.count()
        self.within = own.loop
        self.welcome = welcome  # threads that may still come to help
        self.running = 0  # threads that help
        self.ended = False
        self.error: BaseException | None = None  # what a helper's task raised

    def work(self) -> None:
        """Do tasks until none is left, or one has failed."""
        outer, own.loop = own.loop, self
        try:
            while not self.ended and (i := next(self._turns)) < self._count:
                self._task(i)
        finally:
            self.ended, own.loop = True, outer

    def lies_within(self, loop: Loop) -> bool:
        """Tell whether this loop was begun by a task of another, or by one of such a loop."""
        outer = self.within
        while outer is not None and outer is not loop:
            outer = outer.within
        return outer is loop


class ThreadState(threading.local):
    """State of a thread: the event that it is told to stop, and the loop of which it does a task."""

    stop: threading.Event | None = None
    loop: Loop | None = None


class Crew:
    """Threads that help with loops that others offer. One that waits for its helpers helps these meanwhile, so that
    none is idle while a task of several loops deep takes long."""

    def __init__(self, default: Callable[[], int]) -> None:
        """Make a crew. Args: default gives how many threads work at most where none are asked for."""
        self._changed, self._asked, self._default = threading.Condition(), 0, default
        self._threads, self._busy = 0, 0
        self._offers: list[Loop] = []
        self._waiting: list[Loop] = []

    def size(self) -> int:
        """Return how many threads work at most, the first one among them."""
        if not self._asked:
            self._asked = self._default()
        return self._asked

    def anew(self) -> Crew:
        """Return a crew of as many threads, none of which has begun."""
        crew = Crew(self._default)
        crew._asked = self._asked
        return crew

    def resize(self, threads: int) -> None:
        """Set how many threads work from now on."""
        with self._changed:
            self._asked = threads
            self._changed.notify_all()

    def free(self) -> int:
        """Return how many threads could help this one now."""
        with self._changed:
            waiting, loop = 0, own.loop
            while self._waiting and loop is not None:
                waiting += self._waiting.count(loop)
                loop = loop.within
            return max(self.size() - 1 - self._busy, 0) + waiting

    def share(self, loop: Loop) -> None:
        """Do a loop with the help of those that come. Raises: what a task raises, once all helpers have ended."""
        self.offer(loop)
        try:
            loop.work()
        finally:
            self.finish(loop)
        if loop.error is not None:
            raise loop.error

    def offer(self, loop: Loop) -> None:
        """Let others help with a loop."""
        with self._changed:
            self._offers.append(loop)
            idle, more = self._threads - self._busy, self.size() - 1 - self._threads
            for _ in range(min(loop.welcome - idle, more)):
                # Not of a pool: one that an interruption leaves behind must not keep the process from ending.
                self._threads += 1
                threading.Thread(target=self._serve, name="raychan-helper", daemon=True).start()
            self._changed.notify_all()

    def finish(self, loop: Loop) -> None:
        """Wait until none helps with a loop any more, and help with the loops that its helpers began."""
        with self._changed:
            loop.ended = True
            if loop in self._offers:
                self._offers.remove(loop)
            while loop.running:
                inner = self._taken(loop)
                if inner is None:
                    self._waiting.append(loop)
                    try:
                        self._changed.wait()
                    finally:
                        self._waiting.remove(loop)
                    continue
                self._changed.release()
                try:
                    self._help(inner)
                finally:
                    self._changed.acquire()

    def _taken(self, outer: Loop | None) -> Loop | None:
        """Return a loop to help with, the one offered first, if there is one; with `outer` one that lies within it."""
        for loop in self._offers:
            if loop.welcome and not loop.ended and (outer is None or loop.lies_within(outer)):
                loop.welcome -= 1
                loop.running += 1
                return loop
        return None

    def _help(self, loop: Loop, serving: bool = False) -> None:
        """Do tasks of a loop that was taken; a thread that serves is free once the loop has one helper less."""
        try:
            loop.work()
        except BaseException as error:
            loop.error = error
        finally:
            with self._changed:
                loop.running -= 1
                self._busy -= serving
                self._changed.notify_all()

    def _serve(self) -> None:
        """Help until there are more threads than asked for."""
        while True:
            with self._changed:
                while (loop := self._taken(None)) is None:
                    if 0 < self._asked <= self._threads:
                        self._threads -= 1
                        return
                    self._changed.wait()
                self._busy += 1
            self._help(loop, serving=True)
            del loop  # and with it the arrays of its tasks


own = ThreadState()
