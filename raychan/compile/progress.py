"""Compiling: how much of it lies ahead of a command, and how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any

from numba.core import event

from raychan.compile.code_cache import unkept
from raychan.compile.jit import KERNELS, Kernel

_EACH = 0.25  # s of a cold run a kernel, two processes on two quiet cores; soon this run has its own mean
_OWN = 20  # kernels after which the mean is this run's own

Told = Callable[[int, int, float], None]


@contextmanager
def watched(tell: Told) -> Iterator[None]:
    """Tell, whenever a kernel is compiled, how many are, how many are still to be at most, and how long these take [s].

    What is still to be compiled is what the modules now imported hold, and no file keeps."""
    with event.install_listener("numba:compile", _Watch(tell)):
        yield


def lost() -> str:
    """Return why compiled code was not kept, for a warning; empty when it was."""
    return f"compiled code could not be kept, so that the next run compiles again: {unkept[0]}" if unkept else ""


def missing() -> list[Kernel]:
    """Return the kernels of the modules now imported that are neither compiled nor kept."""
    return [k for k in KERNELS if not k.overloads and not k.kept.is_there()]


class _Watch(event.Listener):  # type: ignore[misc,no-any-unimported]
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
