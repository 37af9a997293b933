"""What numba has found out about a built-in function for some types of arguments, remembered.

For every `a + b` numba asks all implementations of `+` (of numbers, arrays, texts, dates ...) whether they take these
types, some of them by searching through all loops of a ufunc: a fifth of the time of compiling. The answer depends on
the function, the types and the options of the compilation alone. This rests on how numba's types of functions are
built; with a version of numba that it was not tested with, numba asks every time.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from numba import types
from numba.core.targetconfig import ConfigStack
from numba.core.types.functions import BaseFunction

from raychan.compile.linked import FITS

_FUNCTION: Any = BaseFunction
_asked = _FUNCTION.get_call_type  # numba's own
_PLAIN = types.Number, types.Boolean, types.Array, types.Literal, types.BaseTuple, types.NoneType, types.SliceType
_found: dict[tuple[Any, ...], tuple[Any, Any]] = {}  # signature and key of the implementation, by question


@contextlib.contextmanager
def remembered_typing() -> Iterator[None]:
    """Let numba ask once only, within the block, for the types of arguments that kernels have."""
    if not FITS or _FUNCTION.get_call_type is _get_call_type:
        yield
        return
    _FUNCTION.get_call_type = _get_call_type
    try:
        yield
    finally:
        _FUNCTION.get_call_type = _asked


def _get_call_type(function: Any, context: Any, args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
    """Return the signature of a call, as numba's method does."""
    plain = type(function) is types.Function and not kws and all(isinstance(kind, _PLAIN) for kind in args)
    if not plain:
        return _asked(function, context, args, kws)
    question: tuple[Any, ...] = function, context, args
    if question not in _found:
        question += (repr(getattr(ConfigStack.top_or_none(), "_values", None)),)
    if question not in _found:
        signature = _asked(function, context, args, kws)
        implementation = function._impl_keys[signature.args]
        # Only what is compiled from Python depends on the options: else the answer serves all of them (740 of 927).
        plain = implementation is function.typing_key
        question = question[:3] if plain else question
        _found[question] = signature, implementation
    signature, implementation = _found[question]
    function._impl_keys[signature.args] = implementation  # another's, after a question with other options
    return signature
