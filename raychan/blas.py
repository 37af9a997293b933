"""BLAS on one thread while raychan computes.

A thread of BLAS waits for its next work by looking, without sleep, for a tenth of a second after each product of larger
matrices, and takes a core from the threads of `raychan.parallel` meanwhile.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache, wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


class _Limits:
    """The limits on BLAS, from the first of nested or simultaneous calls to the end of the last one."""

    def __init__(self) -> None:
        self._lock, self._calls, self._held = Lock(), 0, dict[bool, Any]()

    def __enter__(self) -> None:
        with self._lock:
            # Looked for again once scipy has brought a BLAS of its own.
            found = "scipy.linalg" in sys.modules
            if found not in self._held:
                self._held[found] = _found(found).limit(limits=1, user_api="blas")
            self._calls += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._calls -= 1
            while self._held and not self._calls:
                self._held.popitem()[1].restore_original_limits()


_LIMITS = _Limits()


def on_one_blas_thread(work: Callable[P, R]) -> Callable[P, R]:
    """Return the function with BLAS on one thread while it runs; afterwards, once no other thread runs such a function,
    on as many as before."""

    @wraps(work)
    def alone(*args: P.args, **named: P.kwargs) -> R:
        with _LIMITS:
            return work(*args, **named)

    return alone


@cache
def _found(scipys: bool) -> Any:
    """Return the libraries of BLAS that are loaded, with those of scipy or without."""
    return ThreadpoolController()
