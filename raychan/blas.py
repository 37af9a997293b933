"""BLAS on one thread while raychan computes.

A thread of BLAS waits for its next work by looking, without sleep, for a tenth of a second after each product of larger
matrices, and takes a core from the threads of `raychan.parallel` meanwhile.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


def on_one_blas_thread(work: Callable[P, R]) -> Callable[P, R]:
    """Return the function with BLAS on one thread while it runs, on as many as before afterwards. Of several threads
    that call such functions at once the first one decides when that is."""

    @wraps(work)
    def alone(*args: P.args, **named: P.kwargs) -> R:
        with _found("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas"):
            return work(*args, **named)

    return alone


@cache
def _found(scipys: bool) -> Any:
    """Return the libraries of BLAS that are loaded, looked for again once scipy has brought one of its own."""
    return ThreadpoolController()
