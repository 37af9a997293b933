"""The types of arguments, and of the fields of waveforms, radars and impairments, checked in one place."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from os import PathLike
from types import UnionType
from typing import Any, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from raychan.scalars import is_number, plain, shown

__all__ = ["check_declared", "check_type", "finite", "is_number", "is_whole", "reals"]


def finite(name: str, value: object) -> float:
    """Return a number. Raises: ValueError that names the argument, for another type or a number not finite."""
    if not (is_number(value) and math.isfinite(plain(value))):
        raise ValueError(f"{name} = {shown(value)}: must be finite, a number")
    return float(plain(value))


def reals(name: str, given: object) -> NDArray[np.float64]:
    """Return numbers as an array. Raises: ValueError that names the argument, where one is a text, true or None."""
    if isinstance(given, np.ndarray) and given.dtype.kind in "iuf":
        return given.astype(np.float64)
    try:
        held = np.array(given, object)
        if all(map(is_number, held.flat)):
            return held.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name} = {shown(given)}: numbers are wanted")


def check_type(name: str, value: object, *wanted: type[Any], or_none: bool = False) -> None:
    """Raise ValueError that names the argument unless a value is of a type: float a finite number, int a whole one."""
    if value is None and or_none:
        return
    if wanted == (float,):
        finite(name, value)
    elif len(wanted) == 1 and wanted[0] in _ALLOWED:
        says, allows = _ALLOWED[wanted[0]]
        if not allows(value):
            raise ValueError(f"{name} = {shown(value)}: {says}")
    elif not isinstance(value, wanted) or (isinstance(value, type) and Callable not in wanted):
        # A class has the methods of its objects, and would pass for one by a protocol.
        names = [_CALLED.get(x, x.__name__) for x in wanted]
        kinds = " or ".join(f"{'an' if x[0] in 'AEIOU' else 'a'} {x}" for x in names)
        text = value.__name__ if isinstance(value, type) else " ".join(shown(value).split())
        made = f", an object of the class, as {text}(...)" if isinstance(value, type) else ""
        raise ValueError(f"{name} = {text}: {kinds} is wanted{', or None' if or_none else ''}{made}")


def check_declared(kind: Any, given: dict[str, Any]) -> None:
    """Check values by the types that fields of a class declare: numbers finite, whole numbers, true or false, objects.

    Args: kind, the class; given, the values by field, in which numbers and truth values become Python's own of the
    declared type. Arrays, tuples and texts are left to checks of their own.
    Raises: ValueError that names the field.
    """
    for name, (wanted, may_be_none) in _declared(kind).items():
        check_type(f"{kind.__name__}.{name}", given[name], wanted, or_none=may_be_none)
        if wanted in (int, float, bool) and given[name] is not None:
            given[name] = wanted(plain(given[name]))


def is_whole(value: object) -> bool:
    """Return whether a value is a whole number, which a float may be."""
    return is_number(value) and float(plain(value)).is_integer()


_CALLED: dict[Any, str] = {str: "text", PathLike: "path", Callable: "function"}
_ALLOWED: dict[type[Any], tuple[str, Callable[[object], bool]]] = {
    int: ("must be a whole number", is_whole),
    str: ("must be a text", lambda value: isinstance(value, str)),
    bool: ("must be true or false", lambda value: isinstance(plain(value), bool)),
}


@cache
def _declared(kind: Any) -> dict[str, tuple[type[Any], bool]]:
    """Return the fields of a class that declare one type of number or object, and whether each may be None."""
    found = {}
    for name, hint in get_type_hints(kind).items():
        members = get_args(hint) if isinstance(hint, UnionType) else (hint,)
        types = [m for m in members if m is not type(None)]
        if len(types) == 1 and isinstance(types[0], type) and types[0] not in (str, tuple):
            may_be_none = len(types) < len(members) or getattr(kind, name, 0) is None
            found[name] = (types[0], may_be_none)
    return found
