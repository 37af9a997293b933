"""Compiling: numba, with code kept on disk until something that it was made of changes.

Numba keeps compiled code by the text of the file in which a function stands. What that function calls from other files,
and the constants it takes from them, are compiled into it all the same: left to itself, numba would go on using them
as they were.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

_CONSTANTS = int, float, complex, str, tuple


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return numba's `njit` with these options; with `cache`, code is kept as long as no file has changed of the
    compiled functions within reach of this one, nor a constant it may have taken from elsewhere."""

    def compiled(function: Callable[..., Any]) -> Any:
        made = numba.njit(**options)(function)
        if options.get("cache"):
            kept = made._cache._cache_file
            kept._source_stamp = made.stamp = hashlib.sha256(_within_reach(function, kept._source_stamp)).digest()
        return made

    return compiled


def _within_reach(function: Callable[..., Any], own: Any) -> bytes:
    """Return the stamp of a function's own file, and all that its module has brought in before it was compiled."""
    seen = [repr(own)]
    for name, value in sorted(function.__globals__.items()):
        if name.startswith("__"):
            continue
        if isinstance(value, _CONSTANTS):
            seen.append(f"{name}={value!r}")
        elif isinstance(value, np.ndarray):
            seen.append(f"{name}={value.dtype}{value.shape}{value.tobytes()!r}")
        elif getattr(value, "__module__", None) != function.__module__:
            seen.append(f"{name}:{getattr(value, 'stamp', b'')!r}" if callable(value) else name)
    return "\n".join(seen).encode()
