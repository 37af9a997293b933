"""How many kernels a command has compiled, and how many are still to be compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any

from numba.core import event

from raychan.compile.code_cache import unkept
from raychan.compile.jit import KERNELS, Kernel

_EACH = 0.08  # s a kernel in a cold run, two processes on two quiet cores, until this run has a mean of its own
_OWN = 20  # kernels after which that is so

Told = Callable[[int, int, float], None]


@contextmanager
def watched(tell: Told) -> Iterator[None]:
    """Call `tell`, whenever a kernel is compiled, with how many are, how many more are to be compiled at most, and
    how long these take [s]: those of the modules now imported that are not cached."""
    with event.install_listener("numba:compile", _Watch(tell)):
        yield


def lost() -> str:
    """Return why compiled code could not be cached, for a warning; empty if it could."""
    return f"compiled code could not be kept, so that the next run compiles again: {unkept[0]}" if unkept else ""


def missing() -> list[Kernel]:
    """Return the kernels of the modules now imported that are neither compiled nor cached."""
    return [k for k in KERNELS if not k.overloads and not k.kept.is_there()]


class _Watch(event.Listener):  # type: ignore[misc,no-any-unimported]
    """Counts compiled kernels and times them; a kernel that is compiled within another counts, but not its time."""

    def __init__(self, tell: Told) -> None:
        self._tell = tell
        self._done, self._depth, self._begun, self._spent = 0, 0, 0.0, 0.0

    def on_start(self, event: Any) -> None:
        if not isinstance(event.data["dispatcher"], Kernel):
            return
        if self._depth == 0:
            self._begun = perf_counter()
            self._say()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        if not isinstance(event.data["dispatcher"], Kernel):
            return
        self._depth -= 1
        self._done += 1
        if self._depth == 0:
            self._spent += perf_counter() - self._begun
            self._say()

    def _say(self) -> None:
        each = self._spent / self._done if self._done >= _OWN else _EACH
        ahead = len(missing())
        self._tell(self._done, ahead, ahead * each)
